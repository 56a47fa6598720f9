"""Pictures of one grasp of a study."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.skeleton import poses_from_angles
from warpjld.study.experiment import Outcome
from warpjld.study.grasping.plan import GraspPlan

__all__ = ["draw_grasp"]

_VIEWS = ("three-quarter", "three-quarter-back", "tips")
_SIZE = (560, 520)


def draw_grasp(plan: GraspPlan, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
    """Draw the closed hand of an outcome from three sides, the object once solid and once translucent.

    Args:
        plan: Of the study.
        trial: Its number.
        outcome: With a pose; there is nothing to draw where the hand was not closed.
        folder: Where to.

    Returns:
        The files written: none, or ``grasp.png``.
    """
    poses_of = {name.partition("/")[2]: array[None] for name, array in outcome.arrays.items()}
    if "angles" not in poses_of:
        return []
    from warpjld.render import Camera, Scene, Solid, grid, save_picture
    from warpjld.study.grasping.load import hand_of, thing_of

    planned = outcome.values
    choice, wanted, scale, friction = plan.combination(trial)
    hand, body = hand_of(choice), thing_of(wanted, scale, plan.measuring.density).body
    rotation, position = poses_of["root_rotation"], poses_of["root_position"]
    poses = poses_from_angles(hand.rig.skeleton, poses_of["angles"], root_position=position, root_rotation=rotation)
    vertices, faces = hand.covering.deform(poses)[0], hand.rig.surface.faces
    turn = Rotation.from_quat(rotation[0])
    axes = {"forward": turn.apply(hand.palm.normal), "up": turn.apply(hand.palm.fingers)}
    side: Literal["left", "right"] = "left" if hand.rig.skeleton.names[0].startswith("left") else "right"
    cloud = np.concatenate([vertices, body.vertices])
    rows = []
    for opacity in (1.0, 0.3):
        row = []
        for view in _VIEWS:
            camera = Camera.view(view, cloud, **axes, side=side, size=_SIZE)
            solid = Solid(body.vertices, body.faces, opacity=opacity)
            with Scene(faces, camera, size=_SIZE, solids=[solid]) as scene:
                row.append(scene.draw(vertices))
        rows.append(row)
    closed = "force closure" if planned.get("closed") else "no force closure"
    title = (
        f"Trial {trial}: {choice.name}, {wanted.name} × {scale:g}, friction {friction:g}; {closed}, "
        f"epsilon {planned.get('epsilon', 0.0):.3f}, penetration {1000 * planned.get('penetration', 0.0):.2f} mm"
    )
    return [save_picture(folder / "grasp.png", grid(rows, captions=_VIEWS, title=title))]
