"""Export as ``isaac_grasp`` YAML 1.0: one file for each hand, object and scale.

Written line by line, with numbers to full precision; fields outside the format are below the key ``warpjld``.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from warpjld.files.whole_file import whole_file
from warpjld.skeleton import Skeleton
from warpjld.study.grasping.export.grasps import ClosedTrial, exported_posture
from warpjld.study.grasping.load import hand_of

__all__ = ["write_isaac"]


def write_isaac(trials: Sequence[ClosedTrial], folder: Path) -> list[Path]:
    """Write the files, named after hand, object and scale."""
    folder.mkdir(parents=True, exist_ok=True)
    groups: dict[Path, list[ClosedTrial]] = {}
    for trial in trials:
        name = f"{trial.hand.name} {trial.thing.name} {trial.scale:g}.yaml"
        groups.setdefault(folder / name, []).append(trial)
    for path, group in groups.items():
        lines = _head(group)
        for trial in group:
            lines += _grasp(trial, group)
        with whole_file(path) as part:
            part.write_text("\n".join(lines) + "\n", "utf-8")
    return list(groups)


def _head(group: Sequence[ClosedTrial]) -> list[str]:
    first = group[0]
    skeleton: Skeleton = hand_of(first.hand).rig.skeleton
    return [
        "format: isaac_grasp",
        "format_version: 1.0",
        "",
        "# metres and radians; position and orientation are those of the gripper frame in the object's frame",
        f"# gripper frame: origin in joint {skeleton.names[0]}, axes of the hand's rig at rest",
        "# object frame: that of objects/, Y up, the middle of the bounding box at 0; the object is scaled about it",
        "# joints: JOINT.CHANNEL, channels flexion, pivot, twisting, abduction; what is not named is as at rest",
        f"object_frame_link: {_text('/' + first.thing.name)}",
        f"gripper_frame_link: {_text(skeleton.names[0])}",
        "",
        "warpjld:",
        f"  hand: {_text(first.hand.name)}",
        f"  object: {_text(first.thing.name)}",
        f"  scale: {_number(first.scale)}",
        f"  mass: {_number(first.row['mass'])}",
        f"  joints: [{', '.join(_text(name) for name in exported_posture(first, group))}]",
        "  friction:",
        *(f"    {trial.name}: {_number(trial.row['friction'])}" for trial in group),
        "",
        "grasps:",
    ]


def _grasp(trial: ClosedTrial, group: Sequence[ClosedTrial]) -> list[str]:
    w, x, y, z = map(_number, trial.quaternion)
    confidence = 1.0 if trial.row.get("success") else 0.0
    return [
        f"  {trial.name}:",
        f"    confidence: {_number(confidence)}",
        f"    position: [{', '.join(map(_number, trial.position.tolist()))}]",
        f"    orientation: {{w: {w}, xyz: [{x}, {y}, {z}]}}",
        "    cspace_position:",
        *(f"      {_text(name)}: {_number(value)}" for name, value in exported_posture(trial, group).items()),
    ]


def _number(value: float) -> str:
    """Number to full precision; YAML 1.1 reads 1e-05 as text, 1.0e-05 as a number."""
    mantissa, e, exponent = repr(float(value)).partition("e")
    return mantissa + ("" if "." in mantissa or not e else ".0") + e + exponent


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False)
