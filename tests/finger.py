"""A small rig: what is quick to bind."""

import numpy as np

from warpjld.geometry.surface import weld_surface
from warpjld.rig import Rig
from warpjld.skeleton import Skeleton, default_limits


def finger() -> Rig:
    """Two phalanges along -z in a closed tube."""
    names = ("left.index.base", "left.index.knuckle2", "left.index.tip")
    rest = np.array([[0, 0, 0], [0, 0, -0.05], [0, 0, -0.09]])
    skeleton = Skeleton(
        names, np.array([-1, 0, 1], dtype=np.int32), rest, np.tile([-1.0, 0, 0], (3, 1)), default_limits(names)
    )
    around, along = np.meshgrid(np.arange(16) * np.pi / 8, np.linspace(0.005, -0.095, 21), indexing="xy")
    ring = np.stack([0.008 * np.cos(around), 0.008 * np.sin(around), along], axis=-1).reshape(-1, 3)
    vertices = np.vstack([ring, [[0, 0, 0.01], [0, 0, -0.1]]])
    faces = []
    for i in range(20):
        for k in range(16):
            a, b = 16 * i + k, 16 * i + (k + 1) % 16
            faces += [[a, a + 16, b], [b, a + 16, b + 16]]
    faces += [[336, k, (k + 1) % 16] for k in range(16)]
    faces += [[337, 320 + (k + 1) % 16, 320 + k] for k in range(16)]
    return Rig("finger", skeleton, weld_surface(vertices, faces))
