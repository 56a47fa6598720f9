"""Enclosed volume as a quadratic form of amplitudes: V(S + D a) = V(S) + g · a + ½ a · H a.

Volume is cubic in positions. Roundings and muscles move the skin away from its bones, in two of three dimensions, so
the third power of amplitudes is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.quality import closing_fans, enclosed_volume
from warpjld.geometry.surface import Surface

__all__ = ["ClosedSurface", "VolumeForm", "any_of"]


def any_of(chosen: NDArray[np.bool_], corners: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether any corner of a face, edge or hinge (N, k) is chosen; far quicker than ``any`` along so short an axis."""
    out = chosen[corners[:, 0]]
    for k in range(1, corners.shape[1]):
        out = out | chosen[corners[:, k]]
    return out


class ClosedSurface:
    """Faces of a surface with the fans that close its open rims, around one more point for each of them.

    Attributes:
        faces: Shape (T + B, 3).
        rims: Mean of each rim's vertices, shape (rims, V).
        volume: At rest [m³].
    """

    def __init__(self, surface: Surface) -> None:
        boundary, loop = closing_fans(surface.faces)
        count, rims = len(surface.vertices), int(loop.max(initial=-1)) + 1
        share = 1.0 / np.bincount(loop, minlength=rims)[loop]
        self.rims = sp.csr_array((share, (loop, boundary[:, 0])), shape=(rims, count))
        fans = np.column_stack([boundary[:, ::-1], count + loop])
        self.faces = np.concatenate([surface.faces.astype(np.int64), fans])
        self.volume = float(enclosed_volume(surface.vertices, surface.faces))

    def volume_of(self, points: NDArray[np.float64]) -> float:
        """Volume [m³] of positions (V, 3)."""
        centred = points - points.mean(axis=0)
        everywhere = np.concatenate([centred, self.rims @ centred])
        # of a · (b × c), six products a coordinate triple, none of which needs its own vector
        x, y, z = (everywhere[:, k][self.faces] for k in range(3))
        six = x[:, 0] * (y[:, 1] * z[:, 2] - z[:, 1] * y[:, 2])
        six += y[:, 0] * (z[:, 1] * x[:, 2] - x[:, 1] * z[:, 2])
        six += z[:, 0] * (x[:, 1] * y[:, 2] - y[:, 1] * x[:, 2])
        return float(six.sum()) / 6.0


@dataclass(frozen=True, eq=False)
class VolumeForm:
    """Lost volume of one pose [m³] by p amplitudes.

    Attributes:
        constant: V(S) − V of the rest surface.
        slope: g, shape (p,).
        curvature: H, shape (p, p).
    """

    constant: float
    slope: NDArray[np.float64]
    curvature: NDArray[np.float64]

    @staticmethod
    def of(
        surface: ClosedSurface, points: NDArray[np.float64], moved: NDArray[np.int64], directions: sp.csr_array
    ) -> VolumeForm:
        """Of positions S (V, 3) and directions D (3 n, p) of the n vertices that move."""
        centred = points - points.mean(axis=0)
        everywhere = np.concatenate([centred, surface.rims @ centred])
        touched = np.zeros(len(everywhere), dtype=bool)
        touched[moved] = True
        hung = np.flatnonzero(surface.rims @ touched[: len(points)].astype(np.float64))
        touched[len(points) + hung] = True
        faces = surface.faces[any_of(touched, surface.faces)]
        used = np.unique(faces)
        number = np.full(len(everywhere), -1)
        number[used] = np.arange(len(used))
        faces, local = number[faces], everywhere[used]
        rows = _directions_of(directions, moved, surface.rims, hung, number)
        a, b, c = (local[faces[:, k]] for k in range(3))
        slope = np.zeros_like(local)
        for k, normal in enumerate((np.cross(b, c), np.cross(c, a), np.cross(a, b))):
            for axis in range(3):
                slope[:, axis] += np.bincount(faces[:, k], normal[:, axis], minlength=len(local))
        bilinear = _bilinear(local, faces)
        curvature = (rows.T @ (bilinear @ rows)).toarray()
        constant = surface.volume_of(points) - surface.volume
        return VolumeForm(constant, rows.T @ slope.ravel() / 6.0, (curvature + curvature.T) / 2.0)

    def lost(self, change: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """V(S + D a) − V of the rest surface [m³], and its derivative by a."""
        bent = self.curvature @ change
        return float(self.constant + self.slope @ change + 0.5 * change @ bent), self.slope + bent


def _bilinear(points: NDArray[np.float64], faces: NDArray[np.int64]) -> sp.csr_array:
    """Second derivatives of the volume by positions, shape (3 n, 3 n): for corners a, b of a face, u · (v × c) / 6."""
    rows, columns, values = [], [], []
    for first, second, other in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        c = points[faces[:, other]] / 6.0
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            # u_i (v_j c_k − v_k c_j)
            for axis, value in ((j, c[:, k]), (k, -c[:, j])):
                one, two = 3 * faces[:, first] + i, 3 * faces[:, second] + axis
                rows += [one, two]
                columns += [two, one]
                values += [value, value]
    size = 3 * len(points)
    index = (np.concatenate(rows), np.concatenate(columns))
    return sp.coo_array((np.concatenate(values), index), shape=(size, size)).tocsr()


def _directions_of(
    directions: sp.csr_array,
    moved: NDArray[np.int64],
    rims: sp.csr_array,
    hung: NDArray[np.int64],
    number: NDArray[np.int64],
) -> sp.csr_array:
    """D of the vertices that move, (3 n, p), as D of all numbered points; the centres of rims move with their mean."""
    parts, places = [directions], [moved]
    if hung.size:
        mean = rims[hung][:, moved]
        axes = [sp.csr_array(mean @ directions[k::3]) for k in range(3)]
        parts.append(sp.vstack([axes[k][n : n + 1] for n in range(len(hung)) for k in range(3)], format="csr"))
        places.append(rims.shape[1] + hung)
    stacked = sp.vstack(parts, format="csr").tocoo()
    row, axis = np.divmod(stacked.coords[0], 3)
    rows = 3 * number[np.concatenate(places)[row]] + axis
    shape = (3 * (int(number.max()) + 1), directions.shape[1])
    return sp.coo_array((stacked.data, (rows, stacked.coords[1])), shape=shape).tocsr()
