"""Meshes of 8-node hexahedra: generated, fitted into surfaces, read from files, and what they carry."""
