"""Geometry without skeletons: triangulated surfaces, normals, winding numbers, rotations and scales."""
