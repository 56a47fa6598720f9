"""The visible skin where it rests on something: what the elements' flat faces leave of overlap is taken away (R104)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact.obstacles import Obstacle

__all__ = ["clear_of"]


def clear_of(
    vertices: NDArray[np.float64], obstacles: Sequence[Obstacle], time: float, *, most: float = 1.5e-3
) -> NDArray[np.float64]:
    """Skin vertices put on the surface of obstacles they are a little inside of, shape (V, 3).

    Contact holds for nodes and faces of the mesh. The visible skin is finer: between nodes it bulges beyond the flat
    faces, and so into what those rest on.

    Args:
        vertices: The carried skin [m], shape (V, 3).
        obstacles: What it may rest on.
        time: Time of the equilibrium.
        most: Depth up to which a vertex is moved [m]; what is deeper is no matter of flat faces and stays to be seen.

    Raises:
        InputError: A depth that is none.
    """
    if not most > 0.0:
        raise InputError(f"most: want a depth above 0 m, got {most}")
    out = np.array(vertices, dtype=np.float64)
    for obstacle in obstacles:
        found = obstacle.project(out, time)
        inside = (found.distance < 0.0) & (found.distance > -most)
        out[inside] = found.closest[inside]
    return out
