"""Conversion of a file's joint tree and surface to a canonical skeleton."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton.hand import FINGER_JOINTS, PALM_SEGMENTS
from warpjld.skeleton.limits import default_limits
from warpjld.skeleton.recognise.axes import body_axes, hand_axes, perpendicular
from warpjld.skeleton.recognise.bones import bone_axis, bone_directions
from warpjld.skeleton.recognise.complete_body import find_extremities, merge_pelvis
from warpjld.skeleton.recognise.complete_hand import complete_hand
from warpjld.skeleton.recognise.flesh import JointFlesh, without_flesh
from warpjld.skeleton.recognise.hand_frame import chirality
from warpjld.skeleton.recognise.layout import Layout, lay_out
from warpjld.skeleton.recognise.leaf_ends import add_leaf_ends
from warpjld.skeleton.recognise.painted import Painted, prefer_skinned_joints
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.roles import HandRoles, Roles
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.skeleton.tree import ALONG, CHANNELS, Skeleton

__all__ = ["Canonical", "canonical_skeleton"]

_STRAIGHT = np.sin(np.radians(10.0))
_OTHER = {"left": "right", "right": "left"}
_CLEAR = 0.15  # smallest absolute chirality that decides between left and right


@dataclass(frozen=True, eq=False)
class Canonical:
    """A canonical skeleton and how the file's joints map to it.

    Attributes:
        skeleton: The skeleton.
        sources: Joint of the file for each joint of the skeleton, -1 for added ones.
        owner: Joint of the skeleton that each joint of the file belongs to, shape (N,).
        notes: What was recognised, added, merged or moved.
        suspicious: Probable errors, each with a remedy.
    """

    skeleton: Skeleton
    sources: tuple[int, ...]
    owner: NDArray[np.int64]
    notes: tuple[str, ...]
    suspicious: tuple[str, ...] = ()


def canonical_skeleton(
    tree: SourceTree,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    *,
    roles: Roles | None = None,
    shares: NDArray[np.float64] | None = None,
    side: str | None = None,
    axes: Mapping[int, NDArray[np.float64]] | None = None,
    limits: Mapping[int, Mapping[str, tuple[float, float]]] | None = None,
    painted: Painted | None = None,
    placed: bool = False,
) -> Canonical:
    """Build the canonical skeleton of a tree and its surface.

    Args:
        tree: The file's joints [m].
        vertices: Surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        roles: Recognised joints, as from :func:`.recognise`, which is called if None.
        shares: Share of the surface that each joint of the file moves, shape (N,); None without painted weights.
        side: Side of a single hand, overriding names and shape.
        axes: Flexion axes stated in the file, by the file's joint indices.
        limits: Channel limits [rad] stated in the file, likewise.
        painted: Painted weights, by the file's joint indices, if the file has any.
        placed: Whether the joints were placed by hand: none is merged, moved or added.

    Raises:
        InputError: A hand's side cannot be determined, or a stated flexion axis lies along its bone.
    """
    if roles is None:
        roles = recognise(tree, shares)
    notes: list[str] = []
    doubts = list(roles.suspicious)
    hand_points: dict[str, dict[str, NDArray[np.float64]]] = {}
    _release_partial_hands(roles, side)
    _swap_mirrored_sides(tree, roles)
    for hand in roles.hands:
        found = {name: tree.positions[j] for name, j in hand.joints.items()}
        hand.side = _side(hand, found, side if len(roles.hands) == 1 else None, doubts)
        if hand.side in hand_points:
            doubts.append(
                f"several {hand.side} hands, as of two actors: one is recognised; give each a file of its own"
            )
        points: dict[str, NDArray[np.float64]] = dict(found)
        added: list[str] = []
        if not placed:
            points, added = complete_hand(found, _last_bones(tree, hand), vertices, faces, f"{hand.side} hand")
        hand_points[hand.side] = points
        notes.append(f"{hand.side} hand: recognised by {roles.how}, {len(hand.joints)} of 25 joints in the file")
        notes.extend(added)
    place = None if placed else merge_pelvis(tree, roles)
    notes = [*roles.notes, *notes]
    flesh = JointFlesh(tree, shares)
    layout = lay_out(tree, roles, hand_points, flesh)
    doubts.extend(without_flesh(tree, layout.names, layout.sources, layout.owner, flesh))
    if place is not None:
        layout.positions[layout.names.index("pelvis")] = place
    if painted is not None:
        prefer_skinned_joints(layout, tree, painted)
    if roles.body and not placed:
        _extremities(layout, vertices, faces)
    if not placed:
        add_leaf_ends(layout, vertices, faces, painted, branches=not (roles.body or roles.hands))
    skeleton = _skeleton(layout, hand_points, axes or {}, limits or {})
    return Canonical(skeleton, tuple(layout.sources), layout.owner, (*notes, *layout.notes), tuple(doubts))


def _release_partial_hands(roles: Roles, side: str | None) -> None:
    """Hands without index and pinky define no palm: their joints become plain joints with canonical names."""
    for hand in [h for h in roles.hands if not {"index.base", "pinky.base", "index.knuckle2"} <= set(h.joints)]:
        roles.hands.remove(hand)
        prefix = f"{side or hand.side}." if side or hand.side else ""
        roles.body |= {prefix + name: joint for name, joint in hand.joints.items()}
        digits = sorted({name.partition(".")[0] for name in hand.joints} - {"wrist"})
        roles.notes.append(f"{', '.join(digits)}: part of a hand only, nothing was added")


def _swap_mirrored_sides(tree: SourceTree, roles: Roles) -> None:
    """Exchange left and right where nodes with a negative determinant mirror all hands."""
    sided = [hand for hand in roles.hands if hand.side is not None]
    mirrored = [
        hand
        for hand in sided
        if np.linalg.det(tree.frames[hand.joints.get("wrist", hand.joints["index.base"]), :3, :3]) < 0.0
        and _side_by_shape({name: tree.positions[j] for name, j in hand.joints.items()}) == _OTHER[hand.side or "left"]
    ]
    if not sided or len(mirrored) < len(sided):
        return
    for hand in sided:
        hand.side = _OTHER[hand.side or "left"]
    swapped = {}
    for name, joint in roles.body.items():
        side, dot, rest = name.partition(".")
        swapped[f"{_OTHER[side]}{dot}{rest}" if dot and side in _OTHER else name] = joint
    roles.body = swapped
    roles.notes.append("mirrored by its nodes: left and right of its names are exchanged")


def _side_by_shape(points: Mapping[str, NDArray[np.float64]]) -> str | None:
    """Side of a hand by its chirality; None where that is not clear."""
    turn = chirality(points) if {"wrist", "index.base", "pinky.base"} <= set(points) else 0.0
    return None if abs(turn) < _CLEAR else ("right" if turn > 0 else "left")


def _side(hand: HandRoles, points: Mapping[str, NDArray[np.float64]], given: str | None, doubts: list[str]) -> str:
    seen = _side_by_shape(points)
    chosen = given or hand.side or seen
    if chosen is None:
        raise InputError("cannot tell by names or shape whether this is a left or a right hand: give its side")
    if seen not in (None, chosen):
        doubts.append(
            f"named a {chosen} hand, but thumb and fingers look like a {seen} one, or bend backwards at rest: "
            + (f"--side {seen}" if given else "state the side with --side, or wrong joints with --map")
        )
    return chosen


def _extremities(layout: Layout, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
    parents = {
        name: None if parent < 0 else layout.names[parent]
        for name, parent in zip(layout.names, layout.parents, strict=True)
    }
    places = dict(zip(layout.names, layout.positions, strict=True))
    found = find_extremities(places, parents, vertices, faces)
    for name, (parent, point) in found.items():
        layout.add(name, parent, point)
    if found:
        layout.notes.append(f"extremities added in the surface: {', '.join(found)}")


def _last_bones(tree: SourceTree, hand: HandRoles) -> dict[str, NDArray[np.float64]]:
    """Directions of the bones beyond the last joints of digits without tips, where joint frames give them."""
    pairs: list[tuple[int, int]] = []
    last: list[str] = []
    for digit in ("pinky", "ring", "middle", "index", "thumb"):
        chain = [f"{digit}.{j}" for j in FINGER_JOINTS if f"{digit}.{j}" in hand.joints]
        pairs.extend((hand.joints[a], hand.joints[b]) for a, b in pairwise(chain))
        last.extend(chain[-1:])
    axis = bone_axis(tree, pairs)
    if axis is None:
        return {}
    directions = bone_directions(tree, axis)
    return {name: directions[hand.joints[name]] for name in last}


def _skeleton(
    layout: Layout,
    hand_points: Mapping[str, Mapping[str, NDArray[np.float64]]],
    given_axes: Mapping[int, NDArray[np.float64]],
    given_limits: Mapping[int, Mapping[str, tuple[float, float]]],
) -> Skeleton:
    count = len(layout.names)
    number = {name: i for i, name in enumerate(layout.names)}
    limits = default_limits(layout.names)
    blank = Skeleton(
        names=tuple(layout.names),
        parents=np.array(layout.parents, dtype=np.int32),
        rest=layout.positions,
        axes=np.tile([1.0, 0.0, 0.0], (count, 1)),
        limits=limits,
    )
    found = body_axes(
        dict(zip(layout.names, layout.positions, strict=True)),
        dict(zip(layout.names, blank.directions, strict=True)),
        *_facing(layout, number),
    )
    for side, points in hand_points.items():
        found |= {f"{side}.{name}": axis for name, axis in hand_axes(points, side).items()}
    axes = np.empty((count, 3))
    for j, name in enumerate(layout.names):
        source = layout.sources[j]
        if source in given_axes:
            axes[j] = unit(given_axes[source])
            if blank.children[j] and np.linalg.norm(np.cross(axes[j], blank.directions[j])) < ALONG:
                raise InputError(f"joint '{name}': its flexion axis lies along its own segment")
        else:
            axes[j] = perpendicular(found.get(name, _bend(blank, j)), blank.directions[j])
        for channel, pair in given_limits.get(source, {}).items():
            limits[j, CHANNELS.index(channel)] = pair
    palms = tuple(
        tuple(
            (number[f"{side}.{a}"], number[f"{side}.{b}"])
            for a, b in PALM_SEGMENTS
            if f"{side}.{a}" in number and f"{side}.{b}" in number
        )
        for side in hand_points
    )
    return Skeleton(blank.names, blank.parents, blank.rest, axes, limits, palms)


def _bend(skeleton: Skeleton, joint: int) -> NDArray[np.float64]:
    """Axis about which a chain bends at rest; x where it is straight."""
    parent = int(skeleton.parents[joint])
    turn = np.cross(skeleton.directions[parent], skeleton.directions[joint]) if parent >= 0 else np.zeros(3)
    return turn if np.linalg.norm(turn) > _STRAIGHT else np.array([1.0, 0.0, 0.0])


def _facing(layout: Layout, number: Mapping[str, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Up and forward directions of a body; Y and Z where its joints do not determine them."""
    up, forward = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    if "head" in number and "pelvis" in number:
        up = unit(layout.positions[number["head"]] - layout.positions[number["pelvis"]])
    for part in ("hip", "shoulder"):
        if f"left.{part}" in number and f"right.{part}" in number:
            left = layout.positions[number[f"left.{part}"]] - layout.positions[number[f"right.{part}"]]
            forward = perpendicular(np.cross(left, up), up)
            break
    return up, forward
