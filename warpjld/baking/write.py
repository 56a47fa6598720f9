"""Files of a baked rig for game engines: skin and morph targets in glTF or USD, and their drivers in JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.baking.baked import Baked
from warpjld.baking.correctives import PRODUCTS
from warpjld.errors import InputError
from warpjld.files.folders import make_folder
from warpjld.files.whole_file import whole_file
from warpjld.motion.out.baked_skin import BakedSkin
from warpjld.motion.out.source_motion import source_motion
from warpjld.motion.out.write import Timing, WrittenMotion, check_motion_out
from warpjld.skeleton.kinematics import Poses, rest_poses

__all__ = ["BAKED", "check_baked", "drivers_file", "write_baked"]

BAKED = (".glb", ".usd", ".usda", ".usdc")
"""Suffixes of baked rigs."""

_MARGIN = 0.1  # margin of a shape's range of weights at both ends, for poses beyond those fitted


def drivers_file(path: Path) -> Path:
    """Path of the correctives' drivers: ``hand.correctives.json`` beside ``hand.glb``."""
    return path.with_name(f"{path.stem}.correctives.json")


def check_baked(path: Path) -> None:
    """Check the name of a file before ``write_baked``.

    Raises:
        InputError: Unknown suffix.
        MissingExtraError: The format needs an optional dependency.
    """
    if path.suffix.lower() not in BAKED:
        raise InputError(f"unknown kind of baked rig '{path.suffix}'; known: {', '.join(BAKED)}", path=path)
    check_motion_out(path)


def write_baked(path: Path, baked: Baked, clip: Poses | None = None, *, rate: float = 30.0) -> WrittenMotion:
    """Write a baked rig; with a clip also its joints and the shapes' weights over time.

    The drivers of the shapes are written to a JSON file beside it (``drivers_file``): see
    docs/reference/baked-files.md.

    Args:
        path: The file, ``.glb`` or ``.usd``, ``.usda``, ``.usdc``.
        baked: The rig.
        clip: Poses of its animation; without, the rig is at rest.
        rate: Frames per second of the clip.

    Raises:
        InputError: Unknown suffix, poses of another rig, or a file that cannot be written.
        MissingExtraError: The format needs an optional dependency.

    Examples:
        >>> from tempfile import mkdtemp
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> motion = wj.Motion()
        >>> motion.set_key("index.base.flexion", 0, 0.0)
        >>> motion.set_key("index.base.flexion", 10, 1.2)  # rad
        >>> baked = wj.bake(hand, wj.bind(hand), motion.poses(hand.skeleton))
        >>> _ = wj.write_baked(Path(mkdtemp()) / "hand.glb", baked)
    """
    check_baked(path)
    make_folder(path.parent)
    poses = rest_poses(baked.rig.skeleton) if clip is None else clip
    motion = source_motion(baked.rig, poses)
    shown = baked.correctives.weights(baked.bones.turns(poses))
    targets = _targets(baked, shown)
    spare = ((0, 0), (0, -baked.joints.shape[1] % 4))
    weights = np.pad(baked.weights, spare)
    skin = BakedSkin(
        np.where(weights > 0.0, baked.bones.sources[np.pad(baked.joints, spare)], 0),
        weights,
        targets.names,
        targets.shapes,
        targets.offset,
        np.pad(shown * targets.scale, ((0, 0), (0, bool(targets.names)))) + targets.offset,
    )
    timing = Timing(rate, 0, path.stem)
    try:
        if targets.names:
            with whole_file(drivers_file(path)) as part:
                part.write_text(json.dumps(_drivers(baked, targets), indent=1), "utf-8")
        with whole_file(path) as part:
            if path.suffix.lower() != ".glb":
                from warpjld.motion.out.usd import write_usd

                return write_usd(part, baked.rig, poses, timing, skin)
            from warpjld.motion.out.glb import animate
            from warpjld.motion.out.gltf_new import new_document

            notes, warnings = list(motion.notes), list[str]()
            file, nodes = new_document(baked.rig, motion, notes, skin)
            if clip is not None:
                animate(file, nodes, motion, timing, warnings, skin)
            file.write(part)
            return WrittenMotion(tuple(notes), tuple(warnings))
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", path=path) from error


@dataclass(frozen=True, eq=False)
class _Targets:
    """Morph targets for files, with weights from 0 to 1: programs clamp others (Blender 5.0 does on import).

    A shape whose weight goes from a < 0 to b is stored (b − a) times as large and its weight w as (w − a) / (b − a).
    A last target, of constant weight 1, subtracts the shapes at rest. With all weights 0 the surface is the bind pose
    too.

    Attributes:
        names: Their names.
        shapes: Displacements [m], shape (K + 1, V, 3).
        offset: Weight at rest, shape (K + 1,).
        scale: Factor of a driven weight, before ``offset`` is added, shape (K,).
    """

    names: tuple[str, ...]
    shapes: NDArray[np.float64]
    offset: NDArray[np.float64]
    scale: NDArray[np.float64]


def _targets(baked: Baked, shown: NDArray[np.float64]) -> _Targets:
    """The targets of a file; ``shown`` are weights (F, K) of its clip, which may exceed the range fitted to."""
    found = baked.correctives
    count = len(found)
    if not count:
        return _Targets((), found.shapes, np.zeros(0), np.zeros(0))
    low = np.minimum(found.span[:, 0], shown.min(axis=0))
    wide = np.maximum(np.maximum(found.span[:, 1], shown.max(axis=0)) - low, 1e-12)
    low, wide = low - _MARGIN * wide, (1.0 + 2.0 * _MARGIN) * wide
    shapes = np.concatenate([found.shapes * wide[:, None, None], np.tensordot(low, found.shapes, 1)[None]])
    names = (*(f"corrective{k + 1:02}" for k in range(count)), "balance")
    return _Targets(names, shapes, np.append(-low / wide, 1.0), 1.0 / wide)


def _drivers(baked: Baked, targets: _Targets) -> dict[str, Any]:
    """Content of the drivers' file: features, and the coefficients of every shape by joint."""
    bones, found = baked.bones, baked.correctives
    shapes: list[dict[str, Any]] = []
    for k, name in enumerate(targets.names):
        drivers = [] if k == len(found) else found.drivers[k] * targets.scale[k]
        driven = [
            {"joint": bones.names[b], "parent": bones.names[bones.parents[b]], "weights": [float(x) for x in row]}
            for b, row in enumerate(drivers)
            if np.abs(row).max() > 0.0
        ]
        shapes.append({"name": name, "offset": float(targets.offset[k]), "drivers": driven})
    return {
        "version": 1,
        "features": ["".join("xyz"[axis] for axis in chosen) for chosen in PRODUCTS],
        "axes": "world, Y up",
        "shapes": shapes,
    }
