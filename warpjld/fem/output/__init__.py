"""Stresses, ParaView files and pictures of a solution."""
