"""Hands and objects: measuring, closing and judging grasps."""
