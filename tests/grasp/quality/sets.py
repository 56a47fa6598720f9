"""Textbook contact sets."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.grasp.quality import Contacts


def two_on_sphere(radius: float, friction: float, spin: float = 0.0) -> Contacts:
    """Antipodal, on the x axis."""
    points = radius * np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    tangents = np.array([[0, 1.0, 0], [0, 1.0, 0]])
    return Contacts(points, -points, friction, spin, tangents)


def ring_on_sphere(radius: float, friction: float, count: int = 3, latitude: float = 0.0) -> Contacts:
    """Evenly spaced on a circle of latitude [rad]; tangents run up the meridian."""
    angles = 2.0 * np.pi * np.arange(count) / count
    flat = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    up = np.array([0.0, 0.0, 1.0])
    directions = np.cos(latitude) * flat + np.sin(latitude) * up
    meridian = np.cos(latitude) * up - np.sin(latitude) * flat
    return Contacts(radius * directions, -directions, friction, 0.0, meridian)


def four_on_box(half: float, friction: float) -> Contacts:
    """In the middle of the four sides of a box of width and depth 2 × half."""
    points = half * np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 1.0, 0], [0, -1.0, 0]])
    return Contacts(points, -points, friction, 0.0, np.tile([0.0, 0, 1.0], (4, 1)))


def least_on_sphere(support: Callable[[np.ndarray], np.ndarray]) -> float:
    """Least value of a function of directions (…, 6): random directions, and the best of them walked downhill."""
    rng = np.random.default_rng(11)
    best = rng.normal(size=(40_000, 6))
    best = best[np.argsort(support(best))[:100]]
    best /= np.linalg.norm(best, axis=1, keepdims=True)
    for step in np.geomspace(0.2, 1e-5, 90):
        tried = best[:, None] + step * rng.normal(size=(len(best), 40, 6))
        tried = np.concatenate([best[:, None], tried], axis=1)
        tried /= np.linalg.norm(tried, axis=2, keepdims=True)
        best = tried[np.arange(len(best)), support(tried).argmin(axis=1)]
    return float(support(best).min())
