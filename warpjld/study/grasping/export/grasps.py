"""Closed trials of a study with their poses, and OBJ files of the study's objects, for all export formats."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.whole_file import whole_file
from warpjld.study.grasping.choices import HandChoice, ObjectChoice
from warpjld.study.grasping.load import hand_of, thing_of
from warpjld.study.grasping.plan import GraspPlan
from warpjld.study.named_angles import channel_names, free_channels
from warpjld.study.shards import Shards

__all__ = ["ClosedTrial", "closed_trials", "exported_posture", "write_obj", "write_objects"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ClosedTrial:
    """A trial whose hand closed.

    Attributes:
        trial: Its number.
        hand: The hand.
        thing: The object.
        scale: Scale of the object.
        row: Its row of the table.
        angles: Joint angles [rad], shape (J, 4).
        displacement: Displacement of the root joint from rest [m], shape (3,).
        rotation: Rotation of the rig about the root joint, quaternion x, y, z, w, shape (4,).
    """

    trial: int
    hand: HandChoice
    thing: ObjectChoice
    scale: float
    row: dict[str, Any]
    angles: Array
    displacement: Array
    rotation: Array

    @property
    def name(self) -> str:
        """Name of the grasp in files."""
        return f"grasp_{self.trial}"

    @property
    def position(self) -> Array:
        """Position of the rig's root joint in the object's frame [m], shape (3,)."""
        return np.asarray(hand_of(self.hand).rig.skeleton.rest[0] + self.displacement)

    @property
    def quaternion(self) -> list[float]:
        """The rotation as w, x, y, z."""
        return [float(self.rotation[k]) for k in (3, 0, 1, 2)]


def closed_trials(plan: GraspPlan, shards: Shards, wanted: Sequence[int] | None = None) -> list[ClosedTrial]:
    """Trials that have a pose, in order.

    Args:
        plan: The study's plan.
        shards: Its trials.
        wanted: Numbers of trials; None for all that closed.

    Raises:
        InputError: A trial that is wanted is not there, or did not close.
    """
    found = []
    for trial in range(plan.trials) if wanted is None else wanted:
        shard = shards.read(trial)
        hand, thing, scale, _ = plan.combination(trial)
        pose = {} if shard is None else shard.arrays
        if f"{hand.name}/angles" not in pose:
            if wanted is None:
                continue
            why = "is not in this study" if shard is None else f"ended with '{shard.row['status']}': it has no pose"
            raise InputError(f"trial {trial} {why}")
        assert shard is not None
        arrays = (pose[f"{hand.name}/{name}"] for name in ("angles", "root_position", "root_rotation"))
        found.append(ClosedTrial(trial, hand, thing, scale, shard.row, *arrays))
    return found


def exported_posture(trial: ClosedTrial, among: Sequence[ClosedTrial]) -> dict[str, float]:
    """Angles [rad] by name, of channels that can move or that differ from rest in any of the trials ``among``."""
    skeleton = hand_of(trial.hand).rig.skeleton
    chosen = free_channels(skeleton, np.stack([other.angles for other in among if other.hand == trial.hand]))
    names = channel_names(skeleton, chosen)
    return dict(zip(names, (float(value) for value in trial.angles[chosen]), strict=True))


def write_objects(trials: Sequence[ClosedTrial], density: float, folder: Path) -> list[Path]:
    """Write the objects' surfaces at scale 1, in the frame of the study, as OBJ files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for thing in dict.fromkeys(trial.thing for trial in trials):
        body = thing_of(thing, 1.0, density).body
        path = folder / f"{thing.name}.obj"
        write_obj(
            path, body.vertices, body.faces, "metres; the study's frame: Y up, the middle of its bounding box at 0"
        )
        files.append(path)
    return files


def write_obj(path: Path, vertices: NDArray[np.floating], faces: NDArray[np.integer], about: str) -> None:
    """Write a surface as OBJ with coordinates to full float64 precision."""
    lines = [f"# {about}"]
    lines += ["v " + " ".join(repr(float(value)) for value in row) for row in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    with whole_file(path) as part:
        part.write_text("\n".join(lines) + "\n", "utf-8")
