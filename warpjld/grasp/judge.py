"""How good a closed hand's grasp is: what touches, how deep, whether it holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.grasp.both_ways import BothWays
from warpjld.grasp.finer import FinerSkin
from warpjld.grasp.kept import kept_with
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.quality.closure import force_closure
from warpjld.grasp.quality.contacts import Contacts
from warpjld.grasp.quality.touch import ContactPatches
from warpjld.grasp.quality.wrench_space import least_resistance
from warpjld.grasp.segments import SEGMENTS, vertex_segments
from warpjld.grasp.touching import touching_patches
from warpjld.skeleton import Poses

__all__ = ["Judge", "Verdict", "check_friction", "hand_side", "judge"]

_TOUCH = 5e-4  # skin this near touches [m]
_NEARLY = 2.5e-3  # the same at a first look [m]
_SPACING = 1.5e-3  # of the skin's points [m]
_EDGES = 8  # of friction cones
_DIGIT = 0.01  # what a digit more is worth, in epsilon [N]


@dataclass(frozen=True)
class Verdict:
    """Judgement of one closed hand.

    Attributes:
        closed: Force closure by the contacts that can press.
        epsilon: Ferrari–Canny epsilon of these [N], norm L1, torques over the object's largest radius.
        digits: Digits that press, thumb included, e.g. ``thumb``.
        palm: Whether the palm presses.
        depth: Depth of hand and object in one another [m], see ``BothWays``.
    """

    closed: bool
    epsilon: float
    digits: tuple[str, ...]
    palm: bool
    depth: float

    def __repr__(self) -> str:
        held = "force closed" if self.closed else "not force closed"
        by = ", ".join([*self.digits, *(["palm"] if self.palm else [])]) or "nothing"
        return f"Verdict({held}, epsilon {self.epsilon:.3f} N, {by} presses, depth {1e3 * self.depth:.2f} mm)"

    @property
    def score(self) -> float:
        """epsilon + 0.01 N a digit where the grasp is force closed, else 0."""
        return self.epsilon + _DIGIT * len(self.digits) if self.closed else 0.0


class Judge:
    """Judges hands that closed on an object.

    Only contacts count with which a hand can press: those on the inner side of digits and palm, where a segment's skin
    normal does not point to the back of the hand. A digit that merely leans on the object with its back holds nothing.

    Args:
        both: Hand and object, which stands at its own place.
        side: Which hand of the covering.
        friction: Coulomb coefficient.
    """

    def __init__(self, both: BothWays, side: str, friction: float) -> None:
        covering, thing = both.covering, both.thing
        self.both, self.friction = both, friction
        self._center = thing.centroid
        self._radius = float(np.linalg.norm(thing.vertices - thing.centroid, axis=1).max())
        self._skin, self._finer = kept_with(covering, _skin), kept_with(covering, _finer_skin)
        self._segments = vertex_segments(covering, side)
        skeleton = covering.skeleton
        joints = [f"{side}.{name}" if name != "palm" else f"{side}.middle.base" for name in SEGMENTS]
        self._joints = np.array([skeleton.names.index(name) if name in skeleton.names else 0 for name in joints])
        # segment × flexion axis points to the back of the hand (R20)
        self._inner = -np.cross(skeleton.directions[self._joints], skeleton.axes[self._joints])
        palm = skeleton.names.index(f"{side}.wrist")
        self._joints[-1] = palm

    def first_look(self, poses: Poses, vertices: NDArray[np.floating]) -> NDArray[np.float64]:
        """Rank hands that closed roughly; larger is better, shape (G,), 0 and below for what will hardly do."""
        ranks = np.zeros(len(vertices))
        for g, (patches, depth) in enumerate(self._patches(self._skin, vertices, _NEARLY)):
            contacts, digits, palm = self._pressing(patches, poses.rotations[g])
            deep = max(0.0, depth - 1e-3)
            if ("thumb" not in digits and not palm) or len(digits) < 2:
                ranks[g] = -1.0
                continue
            closure = force_closure(contacts, self._center, torque_scale=self._radius, edges=6)
            ranks[g] = closure.margin + 0.04 * len(digits) + 0.1 * closure.closed - 50.0 * deep
        return ranks

    def judge(self, poses: Poses, vertices: NDArray[np.floating], depths: NDArray[np.float64]) -> list[Verdict]:
        """Judge G hands.

        Args:
            poses: Of the closed hands.
            vertices: Their deformed skins [m], shape (G, V, 3).
            depths: Of hands and object in one another [m], see ``BothWays``, shape (G,).
        """
        found = []
        for g, (patches, depth) in enumerate(self._patches(self._finer, vertices, _TOUCH)):
            contacts, digits, palm = self._pressing(patches, poses.rotations[g])
            epsilon = least_resistance(contacts, self._center, torque_scale=self._radius, edges=_EDGES)
            # a ball about the origin inside the wrench space is force closure
            found.append(Verdict(epsilon > 0.0, epsilon, digits, palm, max(float(depths[g]), depth)))
        return found

    def _patches(
        self, finer: FinerSkin, vertices: NDArray[np.floating], tolerance: float
    ) -> Iterator[tuple[ContactPatches, float]]:
        """Patches of contact in the object's frame, and depth of the skin's points, of every hand."""
        place, parts = self.both.thing.place, self._segments[finer.parents]
        local = place.to_local(vertices.reshape(-1, 3))[0].reshape(vertices.shape)
        for skin in local:
            yield touching_patches(finer, parts, self.both.near, skin, tolerance)

    def _pressing(
        self, patches: ContactPatches, rotations: NDArray[np.float64]
    ) -> tuple[Contacts, tuple[str, ...], bool]:
        rows = [SEGMENTS.index(name) for name in patches.names]
        own = Rotation.from_quat(self.both.thing.place.rotation[0]).inv()
        turns = own * Rotation.from_quat(rotations[self._joints[rows]]) if rows else None
        inner = turns.apply(self._inner[rows]) if turns is not None else np.zeros((0, 3))
        kept = np.flatnonzero((inner * patches.skin_normals).sum(axis=1) > 0.0)
        spin = patches.contacts(self.friction).spin
        contacts = Contacts(patches.points[kept], patches.normals[kept], np.array(self.friction), spin[kept])
        names = [patches.digits[k] for k in kept]
        return contacts, tuple(dict.fromkeys(n for n in names if n != "palm")), "palm" in names


def judge(
    covering: Covering, thing: GraspObject, poses: Poses, *, side: str | None = None, friction: float = 0.6
) -> list[Verdict]:
    """How well closed hands hold an object: contacts that can press, force closure, depth.

    Args:
        covering: The hand, smooth method.
        thing: The object, where it stands.
        poses: Closed hands, one a frame.
        side: ``left`` or ``right``; may be left out for a single hand.
        friction: Coulomb coefficient.

    Returns:
        One verdict a frame.

    Raises:
        InputError: No such hand, or no such coefficient.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering, ball = wj.bind(hand), wj.shapes.ball(0.06)
        >>> grasp = wj.find_grasp(covering, ball, count=32)
        >>> (verdict,) = wj.judge(covering, ball, grasp.poses(hand.skeleton))
        >>> verdict.closed, verdict.depth < 1e-3  # m
        (True, True)
    """
    side = hand_side(covering, side)
    check_friction(friction)
    both = BothWays(covering, thing)
    skins = covering.deform(poses)
    depths = both.depths(skins).max(axis=1)
    return Judge(both, side, friction).judge(poses, skins, depths)


def hand_side(covering: Covering, side: str | None) -> str:
    """Which hand of a covering is meant; the only one where none is named.

    Raises:
        InputError: No such hand, or two of them.
    """
    sides = [s for s in ("left", "right") if f"{s}.middle.base" in covering.skeleton.names]
    wanted = side or (sides[0] if len(sides) == 1 else "")
    if wanted not in sides:
        raise InputError(f"side: want one of {', '.join(sides) or 'a hand'}, got '{wanted}'")
    return wanted


def check_friction(friction: float) -> None:
    """Refuse what is no coefficient of friction.

    Raises:
        InputError: It is not.
    """
    if not (np.isfinite(friction) and friction > 0.0):
        raise InputError(f"friction: want a number above 0, got {friction:g}")


def _skin(covering: Covering) -> FinerSkin:
    return FinerSkin(covering.surface.vertices, covering.surface.faces, np.inf)


def _finer_skin(covering: Covering) -> FinerSkin:
    return FinerSkin(covering.surface.vertices, covering.surface.faces, _SPACING)
