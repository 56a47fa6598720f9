"""Swelling amplitudes of the joints, fitted at binding so that flexing a joint preserves the volume of the surface.

A tube that bends about its axis keeps its volume but for a few hundredths. Flesh does not surround its joints as a
tube: where a joint lies near the outer side, most of the flesh is on the inside of the bend, and the wedge that closes
there is larger than the one that opens outside; the ball of a thumb or a buttock has no counterpart at all. The lost
volume is measured at binding, joint by joint, and restored over both adjacent segments, on the outside and the flanks:
in one place it would be a lump, and inside the bend it would be folded in again.

Flexing one joint moves everything beyond it as a rigid body about the joint, so with the joint as the origin only faces
that deform change the sum Σ a · (b × c) / 6.

Where digits are joined by webs, or lie so close that their flesh is one, flexing one alone crushes what joins it to its
neighbours, and flexing all together does not. So joints of one rank are also measured together, and their amplitudes
multiplied by the factor that serves both best.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.drivers import drive, initial_ratio
from warpjld.covering.parameters import default_parameters
from warpjld.covering.quality import closing_fans
from warpjld.covering.rows import Rows, rows_of, scalar_inputs
from warpjld.geometry.rotations import rotate, unit
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton.channels import FLEXION
from warpjld.skeleton.kinematics import poses_from_angles
from warpjld.skeleton.tree import CHANNELS

if TYPE_CHECKING:
    import scipy.sparse as sp

    from warpjld.covering.covering import Covering
    from warpjld.covering.parameters import Parameters
    from warpjld.skeleton.tree import Skeleton
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["volume_keeping"]

# fractions of the largest flexion that are measured; the loss grows faster than the flexion ratio, the swelling in
# proportion to it
_PARTS = (0.33, 0.67, 1.0)
_WIDEST = np.radians(110.0)  # largest flexion that is measured: beyond, limbs touch each other
_MOST = 1.0  # upper bound of the amplitudes; with 6/5 volume is preserved no better, and fingers collide earlier
_ALIKE = 0.7  # smallest cosine between a joint's axis and the mean axis of the joints of its rank
_STEPS = 4  # Gauss-Newton steps for one amplitude
_ABDUCTION = CHANNELS.index("abduction")


def volume_keeping(covering: Covering) -> NDArray[np.float64]:
    """Swelling amplitudes with which flexing joints, singly and together, preserves the flesh's volume, shape (J,).

    They lie between 0 and 1: a joint whose flesh gains volume gets 0, and the upper bound applies where hardly any
    flesh lies on the outside of a joint.
    """
    skeleton = covering.skeleton
    largest = np.minimum(skeleton.limits[:, FLEXION, 1], _WIDEST)
    bends = (skeleton.parents >= 0) & np.array([bool(c) for c in skeleton.children]) & (largest > 1e-6)
    amplitudes, lost = np.zeros(len(skeleton)), np.zeros(len(skeleton))
    joints = np.flatnonzero(bends)
    if not joints.size or not len(covering.flesh.faces):
        return amplitudes
    angles = [_measured(skeleton, int(joint), largest[joint]) for joint in joints]
    poses = poses_from_angles(skeleton, np.concatenate(angles))
    last = np.cumsum([len(a) for a in angles])
    default = default_parameters(skeleton)
    parameters = replace(covering.parameters, inflation=default.inflation, muscle=default.muscle, palm=default.palm)
    bending = _Bending(covering, rows_of(covering.fields, skeleton, covering.anchors, parameters))
    drivers = drive(skeleton, covering.anchors, poses)
    scalars = scalar_inputs(covering.anchors, parameters, drivers)
    turns = np.concatenate([drivers.halfway, drivers.rotations], axis=1)
    for joint, own, end in zip(joints, angles, last, strict=True):
        frames = np.arange(end - len(own), end)
        part = bending.around(int(joint))
        if part is not None:
            ratio = drivers.flexion_ratio[frames, joint]
            fitted = part.amplitude(drivers.positions[frames], turns[frames], scalars[frames], ratio)
            amplitudes[joint], lost[joint] = fitted
    return amplitudes * _together(covering, bending, parameters, amplitudes, lost)


def _together(
    covering: Covering,
    bending: _Bending,
    parameters: Parameters,
    amplitudes: NDArray[np.float64],
    lost: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Factors of the amplitudes (J,), the same for all joints of a rank, shape (J,).

    Least squares over the poses in which the joints of a rank are flexed singly, where the factor 1 leaves no error and
    0 the volume ``lost`` [m³] (J,), and the one in which they are flexed together, which counts as all the others.
    """
    skeleton = covering.skeleton
    ranks = [joints for joints in _ranks(skeleton) if (amplitudes[joints] > 0.0).sum() > 1]
    factors = np.ones(len(skeleton))
    if not ranks:
        return factors
    angles = np.repeat(skeleton.initial[None], len(ranks), axis=0)
    for row, joints in zip(angles, ranks, strict=True):
        row[joints, FLEXION] = np.minimum(skeleton.limits[joints, FLEXION, 1], _WIDEST)
    drivers = drive(skeleton, covering.anchors, poses_from_angles(skeleton, angles))
    turns = np.concatenate([drivers.halfway, drivers.rotations], axis=1)
    whole = bending.whole(amplitudes)
    scalars = scalar_inputs(covering.anchors, parameters, drivers)
    gained = whole.gained(drivers.positions, turns, scalars, bending.swelling(drivers.flexion_ratio * amplitudes))
    for joints, (without, swollen) in zip(ranks, gained, strict=True):
        singly = float(lost[joints] @ lost[joints])
        slope, weight = swollen - without, len(joints)
        square = singly + weight * slope**2
        if square > 0.0:
            factors[joints] = np.clip((singly - weight * slope * without) / square, 0.0, 1.0)
    return factors


def _ranks(skeleton: Skeleton) -> list[NDArray[np.int64]]:
    """Groups of joints of the same rank: at the same depth below the same branching joint, with nearly the same flexion
    axis. Fingers form such groups; the thumb beside them does not belong to them."""
    ranks: dict[tuple[int, int], list[int]] = {}
    for joint in range(len(skeleton)):
        above, steps = int(skeleton.parents[joint]), 1
        while above >= 0 and len(skeleton.children[above]) == 1:
            above, steps = int(skeleton.parents[above]), steps + 1
        if above >= 0:
            ranks.setdefault((above, steps), []).append(joint)
    out = []
    for joints in ranks.values():
        axes = skeleton.axes[joints]
        alike = np.array(joints)[axes @ unit(axes.sum(axis=0)) > _ALIKE]
        if len(alike) > 1:
            out.append(alike)
    return out


def _measured(skeleton: Skeleton, joint: int, largest: float) -> NDArray[np.float64]:
    """Angles of the poses in which one joint is measured, shape (F, J, channels): flexed, and where its abduction
    exceeds its flexion, as at a thumb's root, also abducted to either side."""
    angles = np.repeat(skeleton.initial[None], len(_PARTS), axis=0)
    angles[:, joint, FLEXION] = largest * np.array(_PARTS)
    sideways = skeleton.limits[joint, _ABDUCTION]
    if sideways[1] <= largest:
        return angles
    both = np.repeat(angles[None], 2, axis=0)
    both[:, :, joint, _ABDUCTION] = 0.5 * sideways[:, None] * np.array(_PARTS)
    return np.concatenate([angles, *both])


class _Bending:
    """A closed surface, from which the part that one joint deforms can be extracted."""

    def __init__(self, covering: Covering, rows: Rows) -> None:
        self._rows = rows
        self._skeleton, self._swellings = covering.skeleton, covering.fields.swellings.tocsc()
        self._rest, self._ends = covering.surface.vertices, covering.anchors.ends
        count = len(self._rest)
        boundary, loop = closing_fans(covering.flesh.faces)
        fans = np.column_stack([boundary[:, ::-1], count + loop])  # closes each open rim with a fan around its mean
        self._faces = np.concatenate([covering.flesh.faces.astype(np.int64), fans])
        rims = int(loop.max(initial=-1)) + 1
        share = 1.0 / np.maximum(np.bincount(loop, minlength=rims), 1)[loop]
        mean = sp.csr_array((share, (loop, boundary[:, 0])), shape=(rims, count))
        self._corners = sp.vstack([sp.eye_array(count, format="csr"), mean], format="csr")

    def whole(self, amplitudes: NDArray[np.float64]) -> _Part:
        """Whole surface, for joints with these swelling amplitudes, shape (J,)."""
        rows, initial = self._rows, initial_ratio(self._skeleton)
        swelling = self._swellings @ amplitudes
        at_rest = (self._swellings @ (initial * amplitudes)) / (1.0 + rows.scales[:, : len(initial)] @ initial)
        return _Part(np.zeros(3), self._rest, self._faces, self._corners, swelling, at_rest, rows)

    def swelling(self, amplitudes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Swelling of every vertex by joints with these amplitudes (F, J), shape (F, V)."""
        return np.asarray((self._swellings @ amplitudes.T).T)

    def around(self, joint: int) -> _Part | None:
        """The part of the surface whose faces deform when a joint is flexed; None where there is none."""
        skeleton, rows, joints = self._skeleton, self._rows, len(self._skeleton)
        beyond = np.zeros(joints)
        beyond[joint] = 1.0
        for child in range(joint + 1, joints):
            if skeleton.parents[child] >= 0:
                beyond[child] = beyond[skeleton.parents[child]]
        places = beyond.copy()
        places[joint] = 0.0
        turned = rows.turns @ np.concatenate([places, beyond])
        moved = rows.positions @ places
        pivot = rows.positions[:, [joint]].toarray().ravel()
        still = (turned == 0.0) & (moved == 0.0)
        whole = (np.abs(turned - 1.0) < 1e-9) & (np.abs(moved + pivot - 1.0) < 1e-9)
        grows = [rows.scales[:, [joint]], self._swellings[:, [joint]]]
        grows.append(rows.muscles[:, np.flatnonzero((self._ends == joint).any(axis=1))])
        grown = sum((np.diff(m.tocsr().indptr) for m in grows), np.zeros(len(self._rest))) > 0
        bends = self._corners @ (~(still | whole) | grown).astype(np.float64) > 0.0
        faces = self._faces[bends[self._faces].any(axis=1)]
        if not len(faces):
            return None
        used = np.unique(faces)
        number = np.zeros(len(bends), dtype=np.int64)
        number[used] = np.arange(len(used))
        corners = self._corners[used]
        vertices = np.unique(corners.indices)
        swelling = self._swellings[:, [joint]].toarray().ravel()[vertices]
        initial = initial_ratio(skeleton)
        grown = 1.0 + rows.scales[vertices][:, : len(initial)] @ initial
        entries = np.repeat(np.isin(np.arange(len(self._rest)), vertices), np.diff(rows.muscles.indptr))
        return _Part(
            skeleton.rest[joint],
            self._rest[vertices],
            number[faces],
            corners[:, vertices],
            swelling,
            initial[joint] * swelling / grown,
            Rows(
                rows.positions[vertices],
                rows.turns[vertices],
                rows.scales[vertices],
                rows.muscles[vertices],
                rows.heights[entries],
                rows.offset[vertices],
            ),
        )


_Line = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Positions of a frame as a function of the amplitude [m]: the part without inflation, the offsets inflated without
swelling, and the swelling at amplitude 1, shapes (n, 3)."""


@dataclass(frozen=True, eq=False)
class _Part:
    """The part of a surface that one joint deforms, n vertices.

    Attributes:
        pivot: Rest position of the joint [m], shape (3,).
        rest: Rest positions [m], shape (n, 3).
        faces: Triangles over the rows of ``corners``, shape (T, 3).
        corners: Sparse map from the n vertices to the corners of faces, which include the means of open rims.
        swelling: The joint's swelling field, shape (n,).
        at_rest: Swelling field times the joint's flexion ratio at rest, relative to all other inflation, shape (n,).
        rows: Coefficients of the n vertices.
    """

    pivot: NDArray[np.float64]
    rest: NDArray[np.float64]
    faces: NDArray[np.int64]
    corners: sp.csr_array
    swelling: NDArray[np.float64]
    at_rest: NDArray[np.float64]
    rows: Rows

    def amplitude(
        self,
        positions: NDArray[np.float64],
        turns: NDArray[np.float64],
        scalars: NDArray[np.float64],
        ratio: NDArray[np.float64],
    ) -> tuple[float, float]:
        """Swelling amplitude of the least squared volume error over F frames (Gauss–Newton), and the volume [m³] lost
        without it where the joint is flexed farthest.

        Args:
            positions: Joint positions [m], shape (F, J, 3).
            turns: Halfway rotations and bones' rotations, shape (F, 2 J, 4).
            scalars: From ``scalar_inputs``, shape (F, inputs).
            ratio: Flexion ratio of the joint, shape (F,).
        """
        before = self._volume(self.rest - self.pivot)
        lines = self._lines(positions, turns, scalars, ratio[:, None] * self.swelling)
        gained = self._volumes(lines, 0.0) - before
        # only directions of motion that lose volume are fitted: a thumb may gain volume to one side and lose it to the
        # other
        loses = gained.reshape(-1, len(_PARTS)).sum(axis=1) < 0.0
        lines = [line for line, counts in zip(lines, np.repeat(loses, len(_PARTS)), strict=True) if counts]
        best = 0.0
        for _ in range(_STEPS if lines else 0):
            lost = self._volumes(lines, best) - before
            step = 1e-3
            slope = self._volumes(lines, best + step) - before - lost
            square = float(slope @ slope) / step
            if square <= 0.0:
                return 0.0, 0.0
            best = min(max(best - float(slope @ lost) / square, 0.0), _MOST)
        return best, max(-float(gained[len(_PARTS) - 1]), 0.0)

    def gained(
        self,
        positions: NDArray[np.float64],
        turns: NDArray[np.float64],
        scalars: NDArray[np.float64],
        swelling: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Change of the volume of every frame [m³] without swelling and with it, shape (F, 2); swelling of every frame
        and vertex in ``swelling``, shape (F, n), else as :meth:`amplitude`."""
        lines, before = self._lines(positions, turns, scalars, swelling), self._volume(self.rest - self.pivot)
        return np.stack([self._volumes(lines, amplitude) - before for amplitude in (0.0, 1.0)], axis=1)

    def _lines(
        self,
        positions: NDArray[np.float64],
        turns: NDArray[np.float64],
        scalars: NDArray[np.float64],
        swelling: NDArray[np.float64],
    ) -> list[_Line]:
        """Positions of every frame as a function of the amplitude; arguments as of :meth:`gained`."""
        rows, lines = self.rows, []
        for k in range(len(positions)):
            turn = unit(rows.turns @ turns[k])
            out = rotate(turn, rows.offset)
            grown = (1.0 + rows.scales @ scalars[k, : rows.scales.shape[1]])[:, None]
            vertex = np.repeat(np.arange(len(rows.offset)), np.diff(rows.muscles.indptr))
            driven = rows.muscles.data * scalars[k, rows.scales.shape[1] :][rows.muscles.indices]
            muscle = [np.bincount(vertex, driven * height, len(rows.offset)) for height in rows.heights.T]
            base = rows.positions @ positions[k] - self.pivot + rotate(turn, np.stack(muscle, axis=1))
            lines.append((base, grown * out, swelling[k, :, None] * out))
        return lines

    def _volumes(self, lines: list[_Line], amplitude: float) -> NDArray[np.float64]:
        """Volume of every frame [m³], shape (frames,). Offsets are divided by the swelling at rest, so that the rest
        pose stays exact."""
        thinner = (1.0 + amplitude * self.at_rest)[:, None]
        return np.array([self._volume(base + (own + amplitude * out) / thinner) for base, own, out in lines])

    def _volume(self, points: NDArray[np.float64]) -> float:
        """Contribution of the part's faces to the enclosed volume [m³]."""
        a, b, c = ((self.corners @ points)[self.faces[:, k]] for k in range(3))
        return float(np.einsum("ti,ti->", a, np.cross(b, c))) / 6.0
