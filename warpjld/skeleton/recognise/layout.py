"""Layout of the canonical joint list: parents first, every joint of the file assigned to one canonical joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.hand import HAND_PARENTS
from warpjld.skeleton.recognise.flesh import JointFlesh
from warpjld.skeleton.recognise.kept import kept_joints
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["Layout", "lay_out"]

_FALLBACK_PARENTS = {
    "wrist": "elbow",
    "elbow": "shoulder",
    "shoulder": "clavicle",
    "knee": "hip",
    "ankle": "knee",
} | {"ball": "ankle"}

_TRUNK = ("pelvis", "spine", "neck", "head")
_NO_TRUNK = (len(_TRUNK), 0)


@dataclass
class Layout:
    """Canonical joints, parents first.

    Attributes:
        names: Canonical names.
        parents: Parent indices, -1 for the root.
        sources: Joint of the file for each canonical joint, -1 for added ones.
        positions: Rest positions.
        owner: Canonical joint that each joint of the file belongs to, shape (N,).
        notes: Joints that were merged or kept.
    """

    names: list[str]
    parents: list[int]
    sources: list[int]
    positions: NDArray[np.float64]
    owner: NDArray[np.int64]
    notes: list[str] = field(default_factory=list)

    def add(self, name: str, parent: str, position: NDArray[np.float64]) -> None:
        """Append an extremity that the file does not have."""
        self.parents.append(self.names.index(parent))
        self.names.append(name)
        self.sources.append(-1)
        self.positions = np.vstack([self.positions, position])


def lay_out(
    tree: SourceTree,
    roles: Roles,
    hand_points: Mapping[str, Mapping[str, NDArray[np.float64]]],
    flesh: JointFlesh | None = None,
) -> Layout:
    """Order recognised and remaining joints, and assign the file's joints to them.

    Limbs are single segments: twist bones, and joints that subdivide a limb or lie between two recognised ones, belong
    to the recognised joint above them, with their weights. JLD distributes a twist along a segment, and a bisector
    plane in the middle of a limb would only add a crease. Face bones belong to the head. Joints without skin (helpers,
    sockets, targets) belong to the joint above them. All other unrecognised joints are kept, with their names in lower
    case.

    Args:
        tree: The file's joints.
        roles: Recognised joints; every hand has a side.
        hand_points: Per side, positions of its 25 joints, names without the side.
        flesh: Which joints own skin; None without painted weights.
    """
    named = dict(roles.body)
    for hand in roles.hands:
        named |= {f"{hand.side}.{name}": joint for name, joint in hand.joints.items()}
    of_source = {joint: name for name, joint in named.items()}
    notes: list[str] = []
    kept = kept_joints(tree, of_source, flesh or JointFlesh(tree, None), roles.left_out, notes)
    of_source |= kept
    named |= {name: joint for joint, name in kept.items()}

    places = {name: tree.positions[joint] for name, joint in named.items()}
    above: dict[str, str | None] = {}
    in_hands = {f"{side}.{short}": point for side, points in hand_points.items() for short, point in points.items()}
    places |= in_hands
    for name, joint in named.items():
        if name not in in_hands or name.endswith(".wrist"):
            parent = next((of_source[j] for j in tree.ancestors(joint) if j in of_source), None)
            if parent is None or tree.flat:  # a flat file's parents carry no information
                parent = _fallback(name, named)
            above[name] = parent
    for side, points in hand_points.items():
        above.setdefault(f"{side}.wrist", _fallback(f"{side}.wrist", named))
        for short, hand_parent in HAND_PARENTS.items():
            if short in points and hand_parent is not None:
                above[f"{side}.{short}"] = f"{side}.{hand_parent}"
    _one_root(above, notes)
    order = _parents_first(above)
    number = {name: i for i, name in enumerate(order)}
    owner = np.array([_owner(tree, j, of_source, number) for j in range(len(tree))])
    return Layout(
        names=order,
        parents=[-1 if (parent := above[name]) is None else number[parent] for name in order],
        sources=[named.get(name, -1) for name in order],
        positions=np.array([places[name] for name in order]),
        owner=owner,
        notes=notes,
    )


def _fallback(name: str, named: Mapping[str, int]) -> str | None:
    """Parent by anatomy, for joints without a usable parent in the file."""
    side, _, part = name.rpartition(".")
    if side.rpartition(".")[2].startswith("toe"):  # left.toe1.base and the like
        side, part = side.partition(".")[0], "ball"
    above = f"{side}.{_FALLBACK_PARENTS.get(part, '')}"
    if above in named:
        return above
    trunk = [n for n in sorted(named, key=_place_in_trunk) if _place_in_trunk(n) < _NO_TRUNK]
    if name in trunk:
        below = trunk[: trunk.index(name)]
        return below[-1] if below else None
    spine = [n for n in trunk if not n.startswith(("neck", "head"))]
    if part in ("clavicle", "shoulder") and spine:
        return spine[-1]
    return "pelvis" if "pelvis" in named else None


def _place_in_trunk(name: str) -> tuple[int, int]:
    """Sort key of trunk joints, from pelvis to head."""
    part = name.rstrip("0123456789")
    if part not in _TRUNK:
        return _NO_TRUNK
    return _TRUNK.index(part), int(name[len(part) :] or 0)


def _one_root(above: dict[str, str | None], notes: list[str]) -> None:
    roots = [name for name, parent in above.items() if parent is None]
    if len(roots) < 2 or all(name.endswith(".wrist") for name in roots):
        return  # two hands without a body are independent
    main = "pelvis" if "pelvis" in roots else next((r for r in roots if r.endswith(".wrist")), roots[0])
    for name in roots:
        if name != main:
            above[name] = main
    notes.append(f"several roots: {', '.join(r for r in roots if r != main)} hang on {main}")


def _parents_first(above: Mapping[str, str | None]) -> list[str]:
    order: list[str] = []
    seen: set[str] = set()

    def place(name: str) -> None:
        if name in seen:
            return
        seen.add(name)
        parent = above[name]
        if parent is not None:
            place(parent)
        order.append(name)

    for name in above:
        place(name)
    return order


def _owner(
    tree: SourceTree,
    joint: int,
    of_source: Mapping[int, str],
    number: Mapping[str, int],
) -> int:
    for j in (joint, *tree.ancestors(joint)):
        if j in of_source:
            return number[of_source[j]]
    below = [number[of_source[j]] for j in tree.subtree(joint) if j in of_source]
    if not below and tree.flat and of_source:  # without a hierarchy: the nearest recognised joint
        known = list(of_source)
        away = np.linalg.norm(tree.positions[known] - tree.positions[joint], axis=1)
        return number[of_source[known[int(away.argmin())]]]
    return min(below) if below else 0
