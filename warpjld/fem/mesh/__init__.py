"""Meshes of 8-node hexahedra: generated, fitted to surfaces, or read from files; embedded surfaces."""
