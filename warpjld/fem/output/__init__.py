"""Stresses, files for ParaView, pictures, and tables of a solution."""
