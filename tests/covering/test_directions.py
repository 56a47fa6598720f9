"""How far the smooth formula's y axis is from the paper's blend of normals, in pure flexion."""

from __future__ import annotations

import numpy as np
import pytest

from tests.covering import oracle_paper, oracle_smooth
from warpjld.covering import Parameters, default_parameters
from warpjld.skeleton import Poses, Skeleton, poses_from_angles

RATIOS = np.linspace(0.0, 1.0, 51)
UP = np.array([0.0, 1.0, 0.0])
KNUCKLE2, KNUCKLE3 = np.radians([100.0, 80.0])  # the largest angles at the ends of a finger's middle segment


def finger() -> Skeleton:
    """Three straight segments along -z; the one in the middle lies between joints 1 and 2."""
    joints = np.array([[0, 0, 0], [0, 0, -0.045], [0, 0, -0.07], [0, 0, -0.09]], dtype=float)
    limits = np.zeros((4, 4, 2))
    limits[:, 0] = [0.0, np.pi]
    names = ("index.base", "index.knuckle2", "index.knuckle3", "index.tip")
    parents = np.array([-1, 0, 1, 2], dtype=np.int32)
    return Skeleton(names, parents, joints, np.tile([-1.0, 0.0, 0.0], (4, 1)), limits)


def bent(skeleton: Skeleton, proximal: float, distal: float) -> Poses:
    angles = np.zeros((1, 4, 4))
    angles[0, 1:3, 0] = proximal, distal
    return poses_from_angles(skeleton, angles)


def angle_between(proximal: float, distal: float, *, external: bool) -> float:
    """Largest angle [degrees] along the segment between the two directions."""
    skeleton = finger()
    parameters = default_parameters(skeleton)
    poses = bent(skeleton, proximal, distal)
    pose = oracle_paper.Pose.of(skeleton, poses, 0)
    largest = 0.0
    for t in RATIOS:
        if external:
            paper = oracle_paper.external_normal(pose, (1, 2), t, parameters)
        else:
            paper = oracle_paper.internal_normal(pose, (1, 2), t)
        sine = np.linalg.norm(np.cross(smooth_normal(skeleton, poses, t, parameters, external), paper))
        largest = max(largest, np.degrees(np.arcsin(min(sine, 1.0))))
    return largest


def smooth_normal(skeleton: Skeleton, poses: Poses, t: float, parameters: Parameters, external: bool) -> np.ndarray:
    """Where the formula takes the rest normal at ratio t of the middle segment."""
    operator = oracle_smooth.Operator(1, 2, False, 1.0, t, float(external))
    frame = oracle_smooth.pose_frame(skeleton, poses, 0)
    foot = (1 - t) * skeleton.rest[1] + t * skeleton.rest[2]
    flat = Parameters(
        np.zeros(4), parameters.proximity, np.zeros(4), parameters.peak, parameters.exponents, np.zeros(4)
    )
    places = [oracle_smooth.Place(point, [operator], []) for point in (foot, foot + UP)]
    rows = [oracle_smooth.row_of(place, flat, [(1, 2)], 0) for place in places]
    start, end = (oracle_smooth.evaluate(r, frame, flat, np.zeros(4), np.ones(0), skeleton, [(1, 2)], []) for r in rows)
    return end - start


@pytest.mark.parametrize("proximal", np.linspace(0.1, 1.0, 4) * KNUCKLE2)
@pytest.mark.parametrize("distal", np.linspace(0.0, 1.0, 4) * KNUCKLE3)
def test_external_directions_agree(proximal: float, distal: float) -> None:
    assert angle_between(proximal, distal, external=True) < 0.5


@pytest.mark.parametrize("flexion", np.linspace(0.1, 1.0, 6) * KNUCKLE2)
def test_internal_directions_agree_when_one_joint_bends(flexion: float) -> None:
    assert angle_between(flexion, 0.0, external=False) < 0.5
    assert angle_between(0.0, min(flexion, KNUCKLE3), external=False) < 0.5


@pytest.mark.parametrize(("proximal", "distal"), [(60, 40), (50, 50), (20, 80)])
def test_internal_directions_agree_when_both_joints_bend_to_100_degrees_together(
    proximal: float, distal: float
) -> None:
    assert angle_between(*np.radians([proximal, distal]), external=False) < 0.5


def test_internal_directions_at_both_limits() -> None:
    """Fig. 10 averages two normals 90° apart there: they turn unevenly along the segment, quaternions hardly."""
    assert 3.1 < angle_between(KNUCKLE2, KNUCKLE3, external=False) < 3.2
    skeleton = finger()
    poses = bent(skeleton, KNUCKLE2, KNUCKLE3)
    pose = oracle_paper.Pose.of(skeleton, poses, 0)
    ends = [oracle_paper.internal_normal(pose, (1, 2), t) for t in (0.0, 1.0)]
    total = np.degrees(np.arccos(ends[0] @ ends[1]))
    unevenness = []
    for direction in (
        lambda t: oracle_paper.internal_normal(pose, (1, 2), t),
        lambda t: smooth_normal(skeleton, poses, t, default_parameters(skeleton), False),
    ):
        turned = np.degrees([np.arccos(np.clip(ends[0] @ direction(t), -1.0, 1.0)) for t in RATIOS])
        unevenness.append(np.abs(turned - total * RATIOS).max())
    assert unevenness[0] == pytest.approx(4.07, abs=0.01)
    assert unevenness[1] < 1.0
