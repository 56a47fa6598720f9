"""Pictures of one grasp of a study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.grasp import GraspObject
from warpjld.skeleton import poses_from_angles
from warpjld.study.experiment import Outcome
from warpjld.study.grasping.load import Hand

__all__ = ["draw_grasp", "grasp_views"]

_VIEWS = ("three-quarter", "three-quarter-back", "tips")
_SIZE = (560, 520)


def grasp_views(
    hand: Hand,
    body: GraspObject,
    outcome: Outcome,
    views: Sequence[str],
    *,
    opacity: float = 1.0,
    size: tuple[int, int] = _SIZE,
) -> list[NDArray[np.uint8]]:
    """Pictures of the closed hand of an outcome, one per view.

    Args:
        hand: The trial's hand.
        body: The object.
        outcome: The trial's outcome.
        views: Names of views as for `warpjld.render.Camera.view`; the palm is the front.
        opacity: Opacity of the object, 0 to 1.
        size: Width and height [pixels].

    Returns:
        Arrays (height, width, 3); none where the hand was not closed.
    """
    pose = {name.partition("/")[2]: array[None] for name, array in outcome.arrays.items()}
    if "angles" not in pose:
        return []
    from warpjld.render import Camera, SceneRenderer, Solid

    skeleton, faces = hand.rig.skeleton, hand.rig.surface.faces
    poses = poses_from_angles(
        skeleton, pose["angles"], root_position=pose["root_position"], root_rotation=pose["root_rotation"]
    )
    vertices = hand.covering.deform(poses)[0]
    turn = Rotation.from_quat(pose["root_rotation"][0])
    axes = {"forward": turn.apply(hand.palm.normal), "up": turn.apply(hand.palm.fingers)}
    cloud = np.concatenate([vertices, body.vertices])
    solid = Solid(body.vertices, body.faces, opacity=opacity)
    pictures = []
    for view in views:
        camera = Camera.view(view, cloud, **axes, side=hand.side, size=size)
        with SceneRenderer(faces, camera, size=size, solids=[solid]) as scene:
            pictures.append(scene.draw(vertices))
    return pictures


def draw_grasp(hand: Hand, body: GraspObject, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
    """Draw the closed hand of an outcome from three sides, with the object opaque and translucent.

    Args:
        hand: The trial's hand.
        body: The object.
        trial: The trial's number.
        outcome: Its outcome; nothing is drawn if the hand was not closed.
        folder: Output folder.

    Returns:
        The files written: none, or ``grasp.png``.
    """
    rows = [grasp_views(hand, body, outcome, _VIEWS, opacity=opacity) for opacity in (1.0, 0.3)]
    if not rows[0]:
        return []
    from warpjld.render import grid, save_picture

    found = outcome.values
    title = (
        f"Trial {trial}, {body.name}: {'' if found['closed'] else 'no '}force closure, {found['digits']} digits, "
        f"epsilon {found['epsilon']:.3f}, penetration {1000.0 * found['penetration']:.2f} mm"
    )
    return [save_picture(folder / "grasp.png", grid(rows, captions=_VIEWS, title=title))]
