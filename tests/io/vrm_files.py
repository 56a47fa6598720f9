"""A person in T-pose whose joints are called J_007, and VRM's tables about it, 0.x and 1.0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib as gl
from scipy.spatial.transform import Rotation

from tests.glb_files import Glb

_HALF = {  # the left half: bone → its parent and where it is [m]
    "Shoulder": ("upperChest", (0.05, 1.45, 0.0)),
    "UpperArm": ("Shoulder", (0.18, 1.45, 0.0)),
    "LowerArm": ("UpperArm", (0.45, 1.45, 0.0)),
    "Hand": ("LowerArm", (0.70, 1.45, 0.0)),
    "UpperLeg": ("hips", (0.10, 0.95, 0.0)),
    "LowerLeg": ("UpperLeg", (0.10, 0.50, 0.01)),
    "Foot": ("LowerLeg", (0.10, 0.10, 0.0)),
    "Toes": ("Foot", (0.10, 0.03, 0.12)),
    "ThumbMetacarpal": ("Hand", (0.73, 1.44, 0.03)),
    "ThumbProximal": ("ThumbMetacarpal", (0.76, 1.435, 0.05)),
    "ThumbDistal": ("ThumbProximal", (0.79, 1.43, 0.06)),
} | {
    f"{digit}{part}": ("Hand" if before is None else f"{digit}{before}", (x + more, 1.45, z))
    for digit, x, z in (("Index", 0.79, 0.03), ("Middle", 0.80, 0.01), ("Ring", 0.79, -0.01), ("Little", 0.78, -0.03))
    for part, before, more in (
        ("Proximal", None, 0.0),
        ("Intermediate", "Proximal", 0.035),
        ("Distal", "Intermediate", 0.06),
    )
}
BONES: dict[str, tuple[str | None, tuple[float, float, float]]] = {
    "hips": (None, (0.0, 1.0, 0.0)),
    "spine": ("hips", (0.0, 1.1, 0.0)),
    "chest": ("spine", (0.0, 1.25, 0.0)),
    "upperChest": ("chest", (0.0, 1.38, 0.0)),
    "neck": ("upperChest", (0.0, 1.5, 0.0)),
    "head": ("neck", (0.0, 1.6, 0.0)),
}
for _side, _sign in (("left", 1.0), ("right", -1.0)):
    for _bone, (_parent, _at) in _HALF.items():
        _above = _parent if _parent in BONES else _side + _parent
        BONES[_side + _bone] = (_above, (_sign * _at[0], _at[1], _at[2]))
"""Bones in VRM 1.0's words, parents first; they face +Z."""
HAIR = tuple((0.0, 1.75 - 0.1 * n, -0.12) for n in range(5))
_OLD = {"ThumbMetacarpal": "ThumbProximal", "ThumbProximal": "ThumbIntermediate"}

CANONICAL = {"hips": "pelvis", "spine": "spine1", "chest": "spine2", "upperChest": "spine3", "neck": "neck1"}
CANONICAL |= {"head": "head"}
for _side in ("left", "right"):
    CANONICAL |= {
        f"{_side}{theirs}": f"{_side}.{own}"
        for theirs, own in (
            ("Shoulder", "clavicle"),
            ("UpperArm", "shoulder"),
            ("LowerArm", "elbow"),
            ("Hand", "wrist"),
            ("UpperLeg", "hip"),
            ("LowerLeg", "knee"),
            ("Foot", "ankle"),
            ("Toes", "ball"),
            ("ThumbMetacarpal", "thumb.base"),
            ("ThumbProximal", "thumb.knuckle2"),
            ("ThumbDistal", "thumb.knuckle3"),
            *(
                (f"{digit}{part}", f"{name}.{joint}")
                for digit, name in (("Index", "index"), ("Middle", "middle"), ("Ring", "ring"), ("Little", "pinky"))
                for part, joint in (("Proximal", "base"), ("Intermediate", "knuckle2"), ("Distal", "knuckle3"))
            ),
        )
    }
"""What this project calls them."""


def avatar(turn: np.ndarray) -> Glb:
    """The person with a braid, a box of flesh on every joint; axes of joints lie anyhow."""
    names = [*BONES, *(f"hair{n}" for n in range(len(HAIR)))]
    parents = [-1 if parent is None else names.index(parent) for parent, _ in BONES.values()]
    parents += [names.index("head"), *range(len(BONES), len(names) - 1)]
    places = np.array([at for _, at in BONES.values()] + list(HAIR)) @ turn.T
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, :3] = Rotation.random(len(names), rng=8).as_matrix()
    frames[:, :3, 3] = places
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    box = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    box = np.concatenate([box[:, [0, 1, 2]], box[:, [0, 2, 3]]])
    vertices, faces, joints = [], [], []
    for j, place in enumerate(places):
        size = 0.012 if any(d in names[j] for d in ("Thumb", "Index", "Middle", "Ring", "Little")) else 0.05
        below = [k for k, parent in enumerate(parents) if parent == j]
        end = places[below].mean(axis=0) if below else place + 2.0 * size * (place - places[parents[j]])
        middle, half = 0.5 * (place + end), 0.5 * np.abs(end - place) + size
        faces.append(box + 8 * j)
        vertices.append(middle + half * corners)
        joints += [j] * 8
    return Glb(
        names=[f"J_{(17 * j) % 101:03d}" for j in range(len(names))],
        parents=parents,
        frames=frames,
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces),
        joints=np.array(joints)[:, None],
        weights=np.ones((len(joints), 1)),
    )


def with_humanoid(path: Path, version: str, nodes: dict[str, int]) -> Path:
    """Add a humanoid table to a file."""
    gltf = gl.GLTF2().load_binary(str(path))
    if version == "0":
        bones = [{"bone": _old(bone), "node": node, "useDefaultValues": True} for bone, node in nodes.items()]
        gltf.extensions = {"VRM": {"exporterVersion": "test", "humanoid": {"humanBones": bones}}}
    else:
        table = {"specVersion": "1.0", "humanoid": {"humanBones": {b: {"node": n} for b, n in nodes.items()}}}
        gltf.extensions = {"VRMC_vrm_animation" if version == "animation" else "VRMC_vrm": table}
    gltf.extensionsUsed = list(gltf.extensions)
    gltf.save_binary(str(path))
    return path


def _old(bone: str) -> str:
    for new, old in _OLD.items():
        if bone.endswith(new):
            return bone.replace(new, old)
    return bone


def animation(path: Path, turns: dict[str, np.ndarray], travel: np.ndarray, rate: float = 30.0) -> Path:
    """A .vrma of bones a tenth longer, nodes turned anyhow.

    Args:
        path: The file.
        turns: World rotations from rest of bones, as rotation vectors, shape (F, 3); others go with their parents.
        travel: Where the hips go, shape (F, 3).
        rate: Frames a second.
    """
    names = list(BONES)
    frames = len(travel)
    rest = np.tile(np.eye(4), (len(names), 1, 1))
    rest[:, :3, :3] = Rotation.random(len(names), rng=2).as_matrix()
    rest[:, :3, 3] = 1.1 * np.array([at for _, at in BONES.values()])
    gltf = gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[0])], asset=gl.Asset(version="2.0"), buffers=[gl.Buffer()])
    gltf.animations = [gl.Animation()]
    blob = b""

    def accessor(values: np.ndarray) -> int:
        nonlocal blob
        values = np.asarray(values, dtype="<f4")
        gltf.bufferViews.append(gl.BufferView(buffer=0, byteOffset=len(blob), byteLength=values.nbytes))
        blob += values.tobytes()
        kind = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        record = gl.Accessor(bufferView=len(gltf.bufferViews) - 1, componentType=5126, count=len(values), type=kind)
        gltf.accessors.append(record)
        return len(gltf.accessors) - 1

    def animate(node: int, path: str, values: np.ndarray) -> None:
        sampler = gl.AnimationSampler(input=times, output=accessor(values), interpolation="LINEAR")
        gltf.animations[0].samplers.append(sampler)
        target = gl.AnimationChannelTarget(node=node, path=path)
        gltf.animations[0].channels.append(
            gl.AnimationChannel(sampler=len(gltf.animations[0].samplers) - 1, target=target)
        )

    times = accessor(np.arange(frames) / rate)
    world: list[Rotation] = []
    for j, (name, (parent, _)) in enumerate(BONES.items()):
        above = -1 if parent is None else names.index(parent)
        local = rest[j] if above < 0 else np.linalg.inv(rest[above]) @ rest[j]
        children = [k for k, (p, _) in enumerate(BONES.values()) if p == name]
        quaternion = Rotation.from_matrix(local[:3, :3]).as_quat()
        gltf.nodes.append(
            gl.Node(name=f"n{j}", translation=local[:3, 3].tolist(), rotation=quaternion.tolist(), children=children)
        )
        moved = world[above] if above >= 0 else Rotation.identity(frames)
        if name in turns:
            moved = Rotation.from_rotvec(turns[name])
        world.append(moved)
        before = Rotation.identity(frames) if above < 0 else world[above] * Rotation.from_matrix(rest[above, :3, :3])
        animate(j, "rotation", (before.inv() * moved * Rotation.from_matrix(rest[j, :3, :3])).as_quat())
        if above < 0:
            animate(j, "translation", rest[j, :3, 3] + travel)
    gltf.buffers[0].byteLength = len(blob)
    gltf.set_binary_blob(blob)
    gltf.save_binary(str(path))
    return with_humanoid(path, "animation", {name: j for j, name in enumerate(names)})
