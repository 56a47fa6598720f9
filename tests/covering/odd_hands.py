"""Hands that differ in kind from those of the data folder, made of round cones about their bones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import about, rotate
from warpjld.geometry.surface import weld_surface
from warpjld.hand.contour import contour
from warpjld.rig import Rig
from warpjld.skeleton import Skeleton, default_limits

__all__ = ["KINDS", "odd_hand"]

Array = NDArray[np.float64]

_DIGITS = ("thumb", "index", "middle", "ring", "pinky")
_PHALANGES = ("base", "knuckle2", "knuckle3", "tip")
_ACROSS = {"index": -0.024, "middle": -0.003, "ring": 0.016, "pinky": 0.033}  # places of the knuckles [m]
_ALONG = {"index": 0.088, "middle": 0.09, "ring": 0.086, "pinky": 0.076}
_BONES = {"index": (0.043, 0.026, 0.022), "middle": (0.046, 0.029, 0.023), "ring": (0.043, 0.028, 0.023),
          "pinky": (0.034, 0.021, 0.02)}  # fmt: skip


@dataclass(frozen=True)
class _Kind:
    """How a hand differs from a plain one.

    Attributes:
        digits: Its digits.
        thick: Factor of the radii.
        spacing: Of the grid that it is contoured on [m].
        bent: Flexion of every finger's joints at rest [degrees].
        aside: Offset of the joints from the middle of the flesh, outwards, as a share of the radius.
        stretch: Factors of the coordinates.
        apart: Whether every segment is a piece of its own.
        nails: Whether every digit has a nail, a shell of its own.
    """

    digits: tuple[str, ...] = _DIGITS
    thick: float = 1.0
    spacing: float = 0.003
    bent: float = 0.0
    aside: float = 0.0
    stretch: tuple[float, float, float] = (1.0, 1.0, 1.0)
    apart: bool = False
    nails: bool = False


KINDS = {
    "plain": _Kind(),
    "coarse": _Kind(spacing=0.0075),
    "thick fingers": _Kind(thick=1.35),
    "half closed": _Kind(bent=35.0),
    "joints off centre": _Kind(aside=0.5),
    "joints below centre": _Kind(aside=-0.5),
    "nails": _Kind(nails=True),
    "jointed pieces": _Kind(apart=True),
    "four digits": _Kind(digits=("thumb", "index", "middle", "ring"), thick=1.2),
    "stretched": _Kind(stretch=(1.5, 0.8, 1.0)),
    "thin": _Kind(thick=0.6, spacing=0.002),
    "dense": _Kind(spacing=0.0012),
}


def _joints(kind: _Kind) -> dict[str, Array]:
    """Places of the joints of a left hand: fingers along +x, the thumb towards +z, its back up along +y."""
    places = {"wrist": np.zeros(3)}
    flexion = np.radians(kind.bent)
    for digit in kind.digits:
        if digit == "thumb":
            start, direction, axis = np.array([0.025, -0.008, 0.022]), np.array([0.62, -0.25, 0.74]), np.zeros(3)
            bones: tuple[float, ...] = (0.044, 0.032, 0.026)
        else:
            start, direction, axis = (
                np.array([_ALONG[digit], 0.0, -_ACROSS[digit]]),
                np.array([1.0, 0, 0]),
                -np.eye(3)[2],
            )
            bones = _BONES[digit]
        places[f"{digit}.base"] = start
        turned = direction / np.linalg.norm(direction)
        for phalanx, length in zip(_PHALANGES[1:], bones, strict=True):
            if axis.any():
                turned = rotate(about(flexion * axis[None])[0], turned)
            start = start + length * turned
            places[f"{digit}.{phalanx}"] = start
    return places


def _cones(places: dict[str, Array], kind: _Kind) -> list[tuple[str, Array, Array, float, float]]:
    """Name of the joint, ends and radii of every round cone of flesh."""
    out = []
    for digit in kind.digits:
        thick = kind.thick * (0.0105 if digit == "thumb" else 0.0075 if digit == "pinky" else 0.0085)
        if digit != "thumb":
            out.append(("wrist", places["wrist"], places[f"{digit}.base"], 0.0145, 0.0115))
        else:
            out.append(("wrist", places["wrist"], places["thumb.base"], 0.016, 0.014))
        for k, (a, b) in enumerate(pairwise(_PHALANGES)):
            first, last = ((1.3 if digit == "thumb" and not k else 1.0) - 0.06 * k), 0.94 - 0.06 * k
            out.append((f"{digit}.{a}", places[f"{digit}.{a}"], places[f"{digit}.{b}"], thick * first, thick * last))
    return out


def _distance(cones: list[tuple[str, Array, Array, float, float]]) -> Callable[[Array], Array]:
    """Signed distance of a smooth union of round cones."""

    def distance(points: Array) -> Array:
        out = np.full(len(points), 0.05)
        for _, a, b, first, last in cones:
            bone = b - a
            share = np.clip((points - a) @ bone / (bone @ bone), 0.0, 1.0)
            one = np.linalg.norm(points - a - share[:, None] * bone, axis=1) - (first + share * (last - first))
            blend = 0.35 * min(first, last)
            near = np.clip(0.5 + 0.5 * (out - one) / blend, 0.0, 1.0)
            out = out * (1.0 - near) + one * near - blend * near * (1.0 - near)
        return out

    return distance


def odd_hand(name: str) -> Rig:
    """The hand of a kind."""
    kind = KINDS[name]
    places = _joints(kind)
    cones = _cones(places, kind)
    pieces = [[cone] for cone in cones] if kind.apart else [cones]
    meshes = []
    for piece in pieces:
        ends = np.array([end for cone in piece for end in cone[1:3]])
        meshes.append(contour(_distance(piece), ends.min(axis=0) - 0.03, ends.max(axis=0) + 0.03, kind.spacing))
    for digit in kind.digits if kind.nails else ():
        middle = 0.35 * places[f"{digit}.knuckle3"] + 0.65 * places[f"{digit}.tip"] + [0.0, 0.0068, 0.0]

        def nail(points: Array, middle: Array = middle) -> Array:
            return np.asarray((np.linalg.norm((points - middle) / [0.006, 0.0014, 0.0045], axis=1) - 1.0) * 0.0014)

        meshes.append(contour(nail, middle - 0.012, middle + 0.012, 0.001))
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    vertices = np.concatenate([v for v, _ in meshes])
    faces = np.concatenate([f + start for (_, f), start in zip(meshes, starts, strict=False)])
    if kind.aside:
        for digit in kind.digits:
            for phalanx in _PHALANGES[:3]:
                places[f"{digit}.{phalanx}"] = places[f"{digit}.{phalanx}"] + [0.0, kind.aside * 0.0085, 0.0]
    names = tuple(f"left.{joint}" for joint in places)
    parents = [-1]
    for joint in list(places)[1:]:
        digit, phalanx = joint.split(".")
        parents.append(0 if phalanx == "base" else len(parents) - 1)
    rest = np.array(list(places.values())) * kind.stretch
    axes = np.tile([0.0, 0.0, -1.0], (len(names), 1))
    for digit in ("thumb",):
        along = np.array([0.62, -0.25, 0.74]) * kind.stretch
        palm = np.array([0.55, 0.0, -0.83])
        axis = np.cross(along, palm - along * (along @ palm) / (along @ along))
        axes[[k for k, n in enumerate(names) if n.startswith(f"left.{digit}")]] = axis / np.linalg.norm(axis)
    skeleton = Skeleton(names, np.array(parents, dtype=np.int32), rest, axes, default_limits(names))
    return Rig(name, skeleton, weld_surface(vertices * kind.stretch, faces.astype(np.int64)))
