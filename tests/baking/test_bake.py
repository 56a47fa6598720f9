"""Weights and corrective shapes fitted to a covering, and the files they go to."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from warpjld.baking import Baked, accuracy, bake, training_poses, unseen_poses, write_baked
from warpjld.baking.weights import fit_weights
from warpjld.cli.bake import bake_command
from warpjld.covering import Covering
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses, rest_poses


def turns(poses: Poses) -> NDArray[np.float64]:
    return Rotation.from_quat(poses.rotations.reshape(-1, 4)).as_matrix().reshape(len(poses), -1, 9)


def test_unseen_poses_are_not_trained_on(baked: Baked) -> None:
    skeleton = baked.rig.skeleton
    seen, unseen = turns(training_poses(skeleton)), turns(unseen_poses(skeleton).poses)
    apart = np.abs(unseen[:, None] - seen[None]).max(axis=(2, 3)).min(axis=1)
    assert apart.min() > 0.02


def test_weights_are_a_skin(baked: Baked) -> None:
    assert baked.joints.shape[1] == 4
    assert baked.weights.min() >= 0.0
    np.testing.assert_allclose(baked.weights.sum(axis=1), 1.0, atol=1e-6)


def test_correctives_help_on_unseen_poses(baked: Baked, covering: Covering) -> None:
    together = accuracy(baked, covering, unseen_poses(baked.rig.skeleton))[0]
    assert together.corrected_rms is not None
    assert together.corrected_rms < 0.35 * together.weights_rms
    assert together.painted_rms is None  # this hand has no painted weights


def test_rest_is_kept(baked: Baked) -> None:
    at_rest = baked.deform(rest_poses(baked.rig.skeleton))[0]
    np.testing.assert_allclose(at_rest, baked.rig.surface.vertices, atol=1e-8)


def test_weights_of_a_blend_come_back() -> None:
    """Vertices moved by known weights, of at most as many bones, are fitted by them; and noise as a library does."""
    random = np.random.default_rng(3)
    moves = np.zeros((30, 5, 3, 4))
    moves[..., :3] = Rotation.random(150, random_state=4).as_matrix().reshape(30, 5, 3, 3)
    moves[..., 3] = random.normal(size=(30, 5, 3))
    rest = random.normal(size=(6, 3))
    wanted = np.zeros((6, 5))
    for row in wanted:
        row[random.choice(5, 3, replace=False)] = random.dirichlet((2.0, 2.0, 2.0))
    at = np.einsum("fbij,vj->fvbi", moves[..., :3], rest) + moves[:, None, :, :, 3]
    targets = np.einsum("fvbi,vb->fvi", at, wanted)
    joints, weights = fit_weights(rest, targets.astype(np.float32), moves, np.array([-1, 0, 0, 0, 0]), 4)
    dense = np.zeros_like(wanted)
    np.add.at(dense, (np.arange(6)[:, None], joints), weights)
    np.testing.assert_allclose(dense, wanted, atol=1e-4)
    noisy = (targets + random.normal(scale=0.7, size=targets.shape)).astype(np.float32)
    joints, weights = fit_weights(rest, noisy, moves, np.array([-1, 0, 0, 0, 0]), 8)
    for v in range(len(rest)):
        own = np.zeros(5)
        np.add.at(own, joints[v], weights[v])

        def error(w: NDArray[np.float64], v: int = v) -> float:
            return float(((np.einsum("fbi,b->fi", at[:, v], w) - noisy[:, v]) ** 2).sum())

        best = minimize(
            error, np.full(5, 0.2), bounds=[(0, 1)] * 5, constraints={"type": "eq", "fun": lambda w: w.sum() - 1.0}
        )
        assert error(own) <= best.fun * (1.0 + 1e-4)


def test_usd_skins_as_the_model_does(baked: Baked, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdSkel

    poses = unseen_poses(baked.rig.skeleton).poses[:6]
    path = tmp_path / "hand.usda"
    write_baked(path, baked, poses)
    stage = Usd.Stage.Open(str(path))
    root = UsdSkel.Root(stage.GetDefaultPrim())
    from pxr import Gf

    assert UsdSkel.BakeSkinning(root, Gf.Interval(0, 5))
    (mesh,) = [UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    wanted = baked.deform(poses)[:, baked.rig.surface.weld]
    got = np.array([np.array(mesh.GetPointsAttr().Get(f)) for f in range(6)])
    np.testing.assert_allclose(got, wanted, atol=2e-6)


def test_drivers_in_json_give_the_weights_in_the_clip(baked: Baked, tmp_path: Path) -> None:
    """Read as docs/reference/baked-files.md says, from joint rotations alone, beside the weights in the GLB."""
    import pygltflib

    poses = unseen_poses(baked.rig.skeleton).poses
    path = tmp_path / "hand.glb"
    write_baked(path, baked, poses)
    told = json.loads((tmp_path / "hand.correctives.json").read_text("utf-8"))
    names = baked.rig.skeleton.names
    expected = []
    for shape in told["shapes"]:
        weight = np.full(len(poses), shape["offset"])
        for driver in shape["drivers"]:
            assert driver["parent"] in _above(baked, driver["joint"])  # roots drive nothing
            above, own = (Rotation.from_quat(poses.rotations[:, names.index(driver[k])]) for k in ("parent", "joint"))
            turn = dict(zip("xyz", (above.inv() * own).as_quat(canonical=True).T, strict=False))
            features = [np.prod([turn[axis] for axis in name], axis=0) for name in told["features"]]
            weight += np.array(driver["weights"]) @ np.array(features)
        expected.append(weight)
    file = pygltflib.GLTF2().load(str(path))
    animation = file.animations[0]
    (channel,) = [c for c in animation.channels if c.target.path == "weights"]
    view = file.bufferViews[file.accessors[animation.samplers[channel.sampler].output].bufferView]
    raw = file.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    got = np.frombuffer(raw, "<f4").reshape(len(poses), -1).T
    np.testing.assert_allclose(got, np.array(expected), atol=1e-6)
    assert got.min() >= 0.0
    assert got.max() <= 1.0


def _above(baked: Baked, joint: str) -> set[str]:
    """Names of the joints between a joint and the root, which is one of them."""
    skeleton, out = baked.rig.skeleton, set[str]()
    at = int(skeleton.parents[skeleton.names.index(joint)])
    while at >= 0:
        out.add(skeleton.names[at])
        at = int(skeleton.parents[at])
    return out


def test_bad_arguments(baked: Baked, covering: Covering) -> None:
    poses = rest_poses(covering.skeleton, 2)
    with pytest.raises(InputError, match="influences: want 4 or 8"):
        bake(baked.rig, covering, poses, influences=5)
    with pytest.raises(InputError, match="correctives: want 0 … 128"):
        bake(baked.rig, covering, poses, correctives=129)
    with pytest.raises(InputError, match="want at least 3 to fit on"):
        bake(baked.rig, covering, poses, correctives=3)
    fewer = Poses(poses.positions[:, 1:], poses.rotations[:, 1:], poses.flexion[:, 1:])
    with pytest.raises(InputError, match="poses: want"):
        bake(baked.rig, covering, fewer)


def test_what_is_rigid_follows_its_joint(baked: Baked, covering: Covering) -> None:
    rig = baked.rig
    joint = int(baked.bones.joints[3])
    rigid = np.full(len(rig.surface.vertices), -1, dtype=np.int32)
    rigid[:7] = joint
    again = bake(replace(rig, rigid=rigid), covering, training_poses(rig.skeleton, random=4))
    np.testing.assert_array_equal(again.joints[:7, 0], 3)
    np.testing.assert_array_equal(again.weights[:7], [[1.0, 0.0, 0.0, 0.0]] * 7)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["builtin:left", "-o", "hand.fbx"], "unknown kind of baked rig"),
        (["builtin:left", "-o", "hand.glb", "--report", "r.txt"], "unknown kind of report"),
        (["missing.glb", "-o", "hand.glb"], "no such file"),
    ],
)
def test_bad_input(arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        CliRunner().invoke(bake_command, arguments, catch_exceptions=False)
    assert not list(tmp_path.iterdir())
