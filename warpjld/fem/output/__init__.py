"""Stresses, files for ParaView and pictures of a solution."""
