"""Obstacles: rigid and prescribed surfaces, and the closest points of them."""
