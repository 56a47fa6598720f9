"""Surfaces, rotations and what both rest on."""
