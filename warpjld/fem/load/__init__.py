"""Loads and prescribed displacements."""
