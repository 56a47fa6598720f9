"""What is rigid moves with its bone exactly, whichever way it is computed, and leaves the flesh as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from tests.covering.oracle_smooth import Diffused, frames
from tests.covering.poses import random_poses
from warpjld.covering import Covering, bind
from warpjld.covering.calibrate import calibrate
from warpjld.covering.gradient import Differentiable
from warpjld.covering.pose_losses import PoseLosses
from warpjld.covering.pose_sets import calibration_poses
from warpjld.covering.quality import unique_edges
from warpjld.errors import InputError
from warpjld.geometry.surface import Surface, weld_surface
from warpjld.rig import Rig
from warpjld.skeleton import Poses


def with_balls(rig: Rig, joints: list[int]) -> tuple[Surface, np.ndarray]:
    """The surface with a small ball beside each of these joints, and what each vertex is rigid to."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.002)
    count, corners = len(rig.surface.vertices), len(ball.vertices)
    places = [ball.vertices + rig.skeleton.rest[j] + [0.001, 0.002, -0.001] for j in joints]
    numbers = [ball.faces + count + n * corners for n in range(len(joints))]
    surface = weld_surface(
        np.concatenate([rig.surface.vertices, *places]), np.concatenate([rig.surface.faces, *numbers]), tolerance=0.0
    )
    assert len(surface.vertices) == count + corners * len(joints)
    return surface, np.repeat([-1, *joints], [count, *[corners] * len(joints)]).astype(np.int32)


def carried(covering: Covering, poses: Poses) -> np.ndarray:
    """p_j(t) + R_j(t) (x − p_j) in float64, for what is rigid."""
    hard = np.flatnonzero(covering.anchors.rigid >= 0)
    joints = covering.anchors.rigid[hard]
    offset = covering.surface.vertices[hard] - covering.skeleton.rest[joints]
    turns = [Rotation.from_quat(q[joints]).apply(offset) for q in poses.rotations]
    return poses.positions[:, joints] + np.array(turns)


@pytest.fixture(scope="module")
def joints(built: Rig) -> list[int]:
    """A root, joints in the middle of fingers and palm, and a fingertip."""
    names = built.skeleton.names
    tip = next(j for j in range(len(names)) if not built.skeleton.children[j])
    return [0, names.index("left.index.knuckle2"), names.index("left.middle.base"), tip]


@pytest.fixture(scope="module", params=["smooth", "paper"])
def covering(request: pytest.FixtureRequest, built: Rig, joints: list[int]) -> Covering:
    surface, rigid = with_balls(built, joints)
    return bind(built.skeleton, surface, rigid=rigid, method=request.param)


def test_every_way_of_deforming(covering: Covering) -> None:
    poses = random_poses(covering.skeleton, 6, 11, twist=0.4)
    hard = np.flatnonzero(covering.anchors.rigid >= 0)
    wanted = carried(covering, poses)
    tolerance = 1e-6 * covering.surface.size + 3e-7 * np.abs(wanted).max()
    moved = covering.deform(poses)
    assert np.abs(moved[:, hard] - wanted).max() < tolerance
    assert np.abs(covering.points(poses, hard) - wanted).max() < tolerance
    runs = covering.deform(poses, order="runs")
    if type(covering) is Covering:
        assert np.array_equal(runs, moved[:, covering.runs.order[: moved.shape[1]]])
        assert np.abs(Differentiable(covering, poses, hard).forward() - wanted).max() < tolerance


def test_edges_keep_their_lengths(covering: Covering) -> None:
    edges = unique_edges(covering.surface.faces)
    edges = edges[(covering.anchors.rigid[edges] >= 0).all(axis=1)]
    moved = covering.deform(random_poses(covering.skeleton, 6, 12))
    ends = covering.surface.vertices[edges]
    before = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    after = np.linalg.norm(moved[:, edges[:, 1]] - moved[:, edges[:, 0]], axis=2)
    assert np.abs(after / before - 1.0).max() < 1e-3  # float32 at a distance of half a metre


def test_flesh_is_what_it_was(built: Rig, covering: Covering) -> None:
    method = "smooth" if type(covering) is Covering else "paper"
    alone = bind(built.skeleton, built.surface, method=method)  # type: ignore[arg-type]
    count = len(built.surface.vertices)
    poses = random_poses(built.skeleton, 4, 13)
    assert np.array_equal(covering.domains[:count], alone.domains)
    assert np.abs(covering.deform(poses)[:, :count] - alone.deform(poses)).max() < 1e-6 * built.surface.size


def test_parameters_do_not_move_it(built: Rig, joints: list[int]) -> None:
    surface, rigid = with_balls(built, joints)
    covering = bind(built.skeleton, surface, rigid=rigid)
    p = covering.parameters
    other = covering.with_parameters(
        replace(p, inflation=2.0 * p.inflation, muscle=2.0 * p.muscle, proximity=0.5 * p.proximity)
    )
    poses = random_poses(built.skeleton, 3, 14)
    hard = np.flatnonzero(rigid >= 0)
    assert np.array_equal(covering.deform(poses)[:, hard], other.deform(poses)[:, hard])
    deformation = Differentiable(covering, poses, hard)
    gradients = deformation.backward(np.ones_like(deformation.forward()))
    assert not any(np.any(value) for value in vars(gradients.parameters).values())
    # d(Σ x)/d(p_j) is the number of vertices that hang on j
    counts = np.bincount(rigid[hard], minlength=len(built.skeleton))
    assert np.allclose(gradients.pose.positions, counts[None, :, None], rtol=1e-5)


def test_the_oracle_agrees_on_flesh_beside_it(built: Rig, joints: list[int]) -> None:
    surface, rigid = with_balls(built, joints)
    covering = bind(built.skeleton, surface, rigid=rigid)
    poses = random_poses(built.skeleton, 3, 15)
    some = np.random.default_rng(3).choice(len(built.surface.vertices), 8, replace=False)
    # what is rigid takes no part: the flesh alone is covered alike
    flesh = bind(built.skeleton, built.surface, domains=covering.domains[: len(built.surface.vertices)])
    wanted = Diffused(flesh).points(some.tolist(), frames(flesh, poses), flesh.parameters)
    assert np.abs(covering.points(poses, some) - wanted).max() < 1e-6 * surface.size


def test_calibration_does_not_see_it(built: Rig, joints: list[int]) -> None:
    surface, rigid = with_balls(built, joints)
    poses = calibration_poses(built.skeleton, 4)
    alone, beside = bind(built.skeleton, built.surface), bind(built.skeleton, surface, rigid=rigid)
    for flesh, all_of_it in zip(PoseLosses(alone, poses, 4).fitted, PoseLosses(beside, poses, 4).fitted, strict=True):
        for term in ("volume", "stretch", "roughness"):
            wanted = getattr(flesh.before, term)
            assert getattr(all_of_it.before, term) == pytest.approx(wanted, rel=1e-3, abs=1e-6)


def test_all_of_it_may_be_rigid(built: Rig) -> None:
    everything = np.full(len(built.surface.vertices), 3, dtype=np.int32)
    covering = bind(built.skeleton, built.surface, rigid=everything)
    poses = random_poses(built.skeleton, 2, 16)
    assert np.abs(covering.deform(poses) - carried(covering, poses)).max() < 1e-6
    with pytest.raises(InputError, match="all of this surface is rigid"):
        calibrate(covering, poses)


@pytest.mark.parametrize(
    ("rigid", "says"), [(np.zeros(3, np.int32), "shape"), (None, "must lie in")], ids=["length", "joint"]
)
def test_wrong_rigid_parts_are_refused(built: Rig, rigid: np.ndarray | None, says: str) -> None:
    wrong = np.full(len(built.surface.vertices), 999, np.int32) if rigid is None else rigid
    with pytest.raises(InputError, match=says):
        bind(built.skeleton, built.surface, rigid=wrong)
