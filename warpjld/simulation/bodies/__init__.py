"""Deformable bodies with their boundary conditions, rigid obstacles, and the contact model assembled from them."""
