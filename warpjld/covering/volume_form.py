"""Enclosed volume as a quadratic function of amplitudes: V(S + D a) = V(S) + g · a + ½ a · H a.

Volume is cubic in positions. Roundings and muscles move the skin perpendicularly to its bones, in two of three
dimensions, so the third power of amplitudes is omitted.
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
    """Whether any corner of a face, edge or hinge (N, k) is chosen; far faster than ``any`` along so short an axis."""
    out = chosen[corners[:, 0]]
    for k in range(1, corners.shape[1]):
        out = out | chosen[corners[:, k]]
    return out


class ClosedSurface:
    """A surface whose boundary loops (rims) are closed by fans around one additional point each.

    Attributes:
        faces: Triangles with those of the fans, shape (T + B, 3); additional points follow the V vertices.
        rims: Matrix that averages each rim's vertices, shape (rims, V).
        volume: Volume at rest [m³].
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
        # a · (b × c) written out by coordinates, without temporary vectors
        x, y, z = (everywhere[:, k][self.faces] for k in range(3))
        six = x[:, 0] * (y[:, 1] * z[:, 2] - z[:, 1] * y[:, 2])
        six += y[:, 0] * (z[:, 1] * x[:, 2] - x[:, 1] * z[:, 2])
        six += z[:, 0] * (x[:, 1] * y[:, 2] - y[:, 1] * x[:, 2])
        return float(six.sum()) / 6.0


@dataclass(frozen=True, eq=False)
class VolumeForm:
    """Volume of one pose relative to rest [m³], as a quadratic function of p amplitudes.

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
        """The function around positions S [m] (V, 3), with derivatives D (3 n, p) of the n vertices ``moved``."""
        centred = points - points.mean(axis=0)
        everywhere = np.concatenate([centred, surface.rims @ centred])
        touched = np.zeros(len(everywhere), dtype=bool)
        touched[moved] = True
        touched_rims = np.flatnonzero(surface.rims @ touched[: len(points)].astype(np.float64))
        touched[len(points) + touched_rims] = True
        faces = surface.faces[any_of(touched, surface.faces)]
        used = np.unique(faces)
        number = np.full(len(everywhere), -1)
        number[used] = np.arange(len(used))
        faces, local = number[faces], everywhere[used]
        rows = _directions_of(directions, moved, surface.rims, touched_rims, number)
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
    """Second derivatives of the volume by positions, shape (3 n, 3 n): u · (v × c) / 6 for each pair of corners of a
    face that move by u and v, c the third."""
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
    touched_rims: NDArray[np.int64],
    number: NDArray[np.int64],
) -> sp.csr_array:
    """Derivatives of the moved vertices (3 n, p), as those of all numbered points; centres of rims get their mean's.

    Args:
        directions: Derivatives of the moved vertices, shape (3 n, p).
        moved: Their indices, shape (n,).
        rims: As in :class:`ClosedSurface`.
        touched_rims: Rims with moved vertices.
        number: Row of each point in the result, -1 for those left out.
    """
    parts, places = [directions], [moved]
    if touched_rims.size:
        mean = rims[touched_rims][:, moved]
        axes = [sp.csr_array(mean @ directions[k::3]) for k in range(3)]
        parts.append(sp.vstack([axes[k][n : n + 1] for n in range(len(touched_rims)) for k in range(3)], format="csr"))
        places.append(rims.shape[1] + touched_rims)
    stacked = sp.vstack(parts, format="csr").tocoo()
    row, axis = np.divmod(stacked.coords[0], 3)
    rows = 3 * number[np.concatenate(places)[row]] + axis
    shape = (3 * (int(number.max()) + 1), directions.shape[1])
    return sp.coo_array((stacked.data, (rows, stacked.coords[1])), shape=shape).tocsr()
