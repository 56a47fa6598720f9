"""Obstacles: rigid or prescribed surfaces with closest-point projection."""
