"""The same moving body as BVH text in the names, rests, axes and units of the common conventions."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

# canonical joint → parent, place in a T-pose [cm], Y up, facing +z; {s} is a side
_T_POSE: dict[str, tuple[str | None, tuple[float, float, float]]] = {
    "pelvis": (None, (0, 96, 0)),
    "spine1": ("pelvis", (0, 106, 0)),
    "spine2": ("spine1", (0, 120, 0)),
    "spine3": ("spine2", (0, 134, 0)),
    "neck1": ("spine3", (0, 150, 0)),
    "head": ("neck1", (0, 160, 0)),
}
_SIDE: dict[str, tuple[str, tuple[float, float, float]]] = {
    "clavicle": ("spine3", (2, 144, 0)),
    "shoulder": ("clavicle", (17, 144, 0)),
    "elbow": ("shoulder", (45, 144, 0)),
    "wrist": ("elbow", (69, 144, 0)),
    **{
        f"{digit}.{joint}": (f"{digit}.{above}" if above != "wrist" else above, (x, 144, z))
        for digit, z in (("index", 2.5), ("middle", 0.5), ("ring", -1.5), ("pinky", -3.5))
        for joint, above, x in (
            ("carpometacarpal", "wrist", 71.5),
            ("base", "carpometacarpal", 78),
            ("knuckle2", "base", 82),
            ("knuckle3", "knuckle2", 85),
        )
    },
    "thumb.base": ("wrist", (71, 144, 3)),
    "thumb.knuckle2": ("thumb.base", (74, 144, 6)),
    "thumb.knuckle3": ("thumb.knuckle2", (76.5, 144, 8)),
    "hip": ("pelvis", (9, 92, 0)),
    "knee": ("hip", (9, 50, 0)),
    "ankle": ("knee", (9, 8, 0)),
    "ball": ("ankle", (9, 2, 13)),
}
JOINTS: dict[str, tuple[str | None, np.ndarray]] = {n: (p, np.array(at, float)) for n, (p, at) in _T_POSE.items()} | {
    f"{side}.{name}": (f"{side}.{parent}" if parent in _SIDE else parent, np.array([sign * at[0], *at[1:]]))
    for side, sign in (("left", 1.0), ("right", -1.0))
    for name, (parent, at) in _SIDE.items()
}
"""Canonical joint → parent and place [cm] in a T-pose."""

_OWN_AXES = {"X": (1, 0, 0), "-X": (-1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "mirrored X": (1, 0, 0)}
"""Along which of its own axes every bone lies; ``mirrored``: against it on the right side."""

# rotation vectors [degrees] of joints to their parents, frame after frame; {s}: mirrored for the right side
FRAMES: tuple[dict[str, tuple[float, float, float]], ...] = (
    {},
    {
        "left.shoulder": (0, -90, 0),
        "right.shoulder": (0, 90, 0),
        "left.hip": (-50, 0, 0),
        "right.hip": (-30, 0, 10),
        "left.knee": (80, 0, 0),
        "right.knee": (40, 0, 0),
        "left.ankle": (-20, 0, 0),
    },
    {
        "pelvis": (0, 50, 0),
        "spine1": (8, 0, 0),
        "spine2": (8, 5, 0),
        "spine3": (8, 5, 3),
        "neck1": (0, 15, 0),
        "head": (10, 15, 0),
        "left.clavicle": (0, 0, 10),
        "left.shoulder": (0, -60, 40),
        "left.elbow": (30, -70, 0),
        "left.wrist": (10, 0, -35),
        "right.shoulder": (0, 30, 60),
        "right.elbow": (0, 90, 0),
        "left.hip": (-60, 20, 0),
        "left.knee": (30, 0, 0),
    }
    | {f"left.{d}.{j}": (0, 0, -30) for d in ("index", "middle") for j in ("base", "knuckle2", "knuckle3")},
)


@dataclass(frozen=True)
class Convention:
    """Names of joints, ``{Left}``, ``{left}``, ``{L}``, ``{l}`` or ``{左}`` standing for the side.

    Attributes:
        names: Canonical joint (without side) → the file's names: of the joint and of the parts that divide its
            segment. Joints not listed are not in the file.
    """

    names: Mapping[str, str | tuple[str, ...]]

    def of(self, joint: str) -> tuple[str, ...]:
        """The file's names of a canonical joint; empty where the file has none."""
        side, _, part = joint.partition(".") if joint.startswith(("left.", "right.")) else ("left", "", joint)
        found = self.names.get(part, ())
        words = {
            "Left": side.capitalize(),
            "left": side,
            "L": side[0].upper(),
            "l": side[0],
            "左": "左" if side == "left" else "右",
        }
        return tuple(n.format(**words) for n in ((found,) if isinstance(found, str) else found))


@dataclass(frozen=True)
class Recording:
    """BVH text, and what it shows.

    Attributes:
        text: The file.
        files: Canonical joint → the file's first name of it.
        places: Canonical joint → positions in Y-up axes [cm], shape (F, 3).
        turns: Canonical joint → rotations from the T-pose in Y-up axes.
    """

    text: str
    files: dict[str, str]
    places: dict[str, np.ndarray]
    turns: dict[str, Rotation]


def record(
    convention: Convention,
    *,
    rest: str = "T",
    offsets: str = "usual",
    up: str = "y",
    scale: float = 1.0,
    frames: tuple[dict[str, tuple[float, float, float]], ...] = FRAMES,
) -> Recording:
    """Write the moving body.

    Args:
        convention: Names.
        rest: ``T``, ``A`` (arms hang by 50°), or one of ``_OWN_AXES`` (every bone along its own X, …).
        offsets: ``usual``, ``zero`` (positions for all joints, no OFFSETs), ``both`` (positions that repeat OFFSETs)
            or ``added`` (positions that add nothing to OFFSETs).
        up: ``y``, ``z`` (rest and frames) or ``root`` (the root turns a Y-up rest into Z-up frames).
        scale: Units a centimetre.
        frames: Rotation vectors to parents [degrees].
    """
    nodes = _nodes(convention)
    count = len(frames)
    turn = {"y": Rotation.identity(), "z": Rotation.from_euler("x", 90, degrees=True)}
    world, own = turn["y" if up == "y" else "z"], turn["z" if up == "z" else "y"]
    true: dict[str, list[Rotation]] = {}
    places: dict[str, np.ndarray] = {}
    axes: dict[str, Rotation] = {}
    canonical: dict[str, Rotation] = {}
    for node in nodes:
        local = [Rotation.from_rotvec(frame.get(node.joint, (0, 0, 0)), degrees=True) for frame in frames]
        above = canonical[node.outer] if node.outer else Rotation.identity(count)
        if node.first:
            canonical[node.joint] = above * Rotation.concatenate(local)
        share = [Rotation.from_rotvec(one.as_rotvec() * node.share) for one in local]
        true[node.name] = list(above * Rotation.concatenate(share))
        if node.parent is None:
            places[node.name] = np.array([node.at + np.array([0, 0, 10.0 * f]) for f in range(count)])
        else:
            bone = node.at - node.above
            places[node.name] = places[node.parent] + [r.apply(bone) for r in true[node.parent]]
        axes[node.name] = own * _rest_axes(node, nodes, rest) * own.inv()
    lines, order = ["HIERARCHY"], []
    root = next(node for node in nodes if node.parent is None)
    stack: list[tuple[_Node, int]] = [(root, 0)]

    def offset(node: _Node) -> np.ndarray:
        if node.parent is None:
            return scale * own.apply(node.at)
        return scale * axes[node.parent].inv().apply(own.apply(node.at - node.above))

    def write(node: _Node, depth: int) -> None:
        pad = "\t" * depth
        at = np.zeros(3) if offsets == "zero" else offset(node)
        six = offsets != "usual" or node.parent is None
        order.append(node)
        lines.append(f"{pad}{'JOINT' if node.parent else 'ROOT'} {node.name}")
        lines.append(f"{pad}{{\n{pad}\tOFFSET {at[0]:.9f} {at[1]:.9f} {at[2]:.9f}")
        positions = "Xposition Yposition Zposition " if six else ""
        lines.append(f"{pad}\tCHANNELS {6 if six else 3} {positions}Zrotation Xrotation Yrotation")
        below = [n for n in nodes if n.parent == node.name]
        for child in below:
            write(child, depth + 1)
        if not below:
            end = np.zeros(3) if offsets == "zero" else scale * axes[node.name].inv().apply(own.apply(node.end))
            lines.append(
                f"{pad}\tEnd Site\n{pad}\t{{\n{pad}\t\tOFFSET {end[0]:.9f} {end[1]:.9f} {end[2]:.9f}\n{pad}\t}}"
            )
        lines.append(f"{pad}}}")

    write(stack[0][0], 0)
    lines += ["MOTION", f"Frames: {count}", "Frame Time: 0.0333333"]
    for f in range(count):
        row: list[float] = []
        for node in order:
            mine = world * true[node.name][f] * own.inv() * axes[node.name]
            if node.parent is None:
                row += list(scale * world.apply(places[node.name][f]))
            else:
                mine = (world * true[node.parent][f] * own.inv() * axes[node.parent]).inv() * mine
                if offsets in ("zero", "both"):
                    row += list(offset(node))
                elif offsets == "added":
                    row += [0.0, 0.0, 0.0]
            with warnings.catch_warnings():  # where two axes fall together any pair of angles will do
                warnings.filterwarnings("ignore", message="Gimbal lock")
                row += list(mine.as_euler("ZXY", degrees=True))
        lines.append(" ".join(f"{value:.9f}" for value in row))
    first = {node.joint: node.name for node in reversed(nodes)}
    return Recording(
        "\n".join(lines) + "\n",
        first,
        {joint: places[name] for joint, name in first.items()},
        {joint: canonical[joint] for joint in first},
    )


@dataclass(frozen=True)
class _Node:
    name: str
    joint: str
    parent: str | None
    outer: str | None
    at: np.ndarray
    above: np.ndarray
    end: np.ndarray
    share: float
    first: bool


def _nodes(convention: Convention) -> list[_Node]:
    """Joints of the file, parents first: the parts of a segment one after the other, each with more of its turn."""
    out: list[_Node] = []
    last: dict[str, _Node] = {}
    for joint, (above, at) in JOINTS.items():
        names = convention.of(joint)
        parent = above
        while parent is not None and parent not in last:
            parent = JOINTS[parent][0]
        ends = [place for other, (p, place) in JOINTS.items() if p == joint and convention.of(other)]
        end = ends[0] - at if ends else _tip(joint)
        node = last[parent] if parent else None
        for k, name in enumerate(names):
            start = at + end * k / len(names)
            node = _Node(
                name,
                joint,
                node.name if node else None,
                parent,
                start,
                node.at if node else start,
                end / len(names),
                (k + 1) / len(names),
                k == 0,
            )
            out.append(node)
        if names and node is not None:
            last[joint] = node
    return out


def _tip(joint: str) -> np.ndarray:
    if joint == "head":
        return np.array([0.0, 18.0, 0.0])
    if joint.endswith(".ball"):
        return np.array([0.0, 0.0, 6.0])
    sign = 1.0 if joint.startswith("left") else -1.0
    return np.array([sign * 2.0, 0.0, 2.0 if "thumb" in joint else 0.0])


def _rest_axes(node: _Node, nodes: list[_Node], rest: str) -> Rotation:
    """What turns a joint's own axes, at the T-pose, into the world's."""
    if rest == "A" and node.joint.startswith(("left.", "right.")):
        side, _, part = node.joint.partition(".")
        if part not in ("clavicle", "hip", "knee", "ankle", "ball"):
            return Rotation.from_euler("z", 50 if side == "left" else -50, degrees=True)
    if rest in _OWN_AXES:
        ends = [n.at - node.at for n in nodes if n.parent == node.name]
        bone = ends[-1] if ends else node.end
        bone = np.array([0.0, 1.0, 0.0]) if node.joint in ("pelvis", "spine3") else bone
        along = np.array(_OWN_AXES[rest])
        if rest == "mirrored X" and node.joint.startswith("right."):
            along = -along
        across = np.array([0.0, 0.0, 1.0] if abs(bone[2]) < 0.9 * np.linalg.norm(bone) else [0.0, 1.0, 0.0])
        turned, _ = Rotation.align_vectors([bone, across], [along, np.roll(along, 1)], weights=[1e6, 1.0])
        return turned
    return Rotation.identity()
