"""Flesh and bones of a real hand."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import Body, LinearElastic, Loads, solve
from warpjld.fem.flesh import flesh_of
from warpjld.io import load_rig
from warpjld.skeleton import poses_from_angles


@pytest.mark.slow
def test_hand_sags_when_gravity_turns(data: Path) -> None:
    rig = load_rig(data / "hand_webxr_generic" / "left.glb")
    flesh = flesh_of(rig, 0.003)
    assert flesh.fit.least > 0.1
    assert len(flesh.bones) >= 20
    nodes = np.concatenate([flesh.mesh.node_sets[name] for name in flesh.names])
    assert len(nodes) == len(np.unique(nodes))
    laws = {"flesh": LinearElastic(60e3, 0.48, 1050.0), "bone": LinearElastic(17e9, 0.3, 1900.0)}
    body = Body(flesh.mesh, laws)
    found = solve(body, flesh.held(), Loads(gravity=(0.0, 0.0, -9.81)))
    assert found.last.iterations <= 50
    sag = flesh.skin.carry(found.displacement)
    assert 1e-5 < np.abs(sag).max() < 2e-3
    weight = (body.density * _volume(flesh.mesh)).sum() * 9.81
    np.testing.assert_allclose(found.reactions.sum(axis=0), [0, 0, weight], atol=1e-4 * weight)

    angles = np.zeros((1, len(rig.skeleton.names), 4))
    angles[0, rig.skeleton.index("index.knuckle2"), 0] = 0.4
    poses = poses_from_angles(rig.skeleton, angles)
    held = flesh.held(poses)
    for name, parent, joint in zip(flesh.names, flesh.parents, flesh.bones, strict=True):
        chosen = np.isin(held.degrees // 3, flesh.mesh.node_sets[name])
        moved = held.values[chosen].reshape(-1, 3).mean(axis=0)
        ends = poses.positions[0, [parent, joint]] - rig.skeleton.rest[[parent, joint]]
        assert np.linalg.norm(moved - ends.mean(axis=0)) < 0.5 * np.linalg.norm(ends, axis=1).max() + 1e-9


@pytest.mark.slow
def test_example(tmp_path: Path) -> None:
    example = Path(__file__).resolve().parents[2] / "examples" / "hand_gravity.py"
    sag = runpy.run_path(str(example))["main"]("builtin:left", tmp_path, 0.003)
    assert 1e-5 < sag < 1e-3
    assert {p.name for p in tmp_path.iterdir()} == {"skin.npy", "hand.vtu", "hand.png"}


@pytest.mark.slow
@pytest.mark.parametrize("spacing", [0.006, 0.004, 0.003])
def test_a_hand_whose_wrist_ends_in_a_thin_lip_is_meshed(data: Path, spacing: float) -> None:
    """Its rim stays off the mesh by up to 2.3 elements; it was refused as a digit that is too thin would be."""
    rig = load_rig(data / "hand_godot_low" / "Hand_low_L.gltf")
    flesh = flesh_of(rig, spacing, gap=0.2, head=0.03)
    assert len(flesh.bones) >= 20
    tips = [rig.skeleton.index(f"left.{digit}.tip") for digit in ("thumb", "index", "middle", "ring", "pinky")]
    near = np.linalg.norm(rig.surface.vertices[:, None] - rig.skeleton.rest[tips], axis=2).min(axis=1) < 0.01
    assert flesh.skin.outside[near].max() < 1.0


@pytest.mark.slow
def test_spacing_too_coarse_for_the_fingers() -> None:
    from warpjld.hand import build_hand

    with pytest.raises(InputError, match="too coarse, thin parts are not meshed"):
        flesh_of(build_hand("left"), 0.009)


@pytest.mark.parametrize("spacing", [0.005, pytest.param(0.004, marks=pytest.mark.slow)])
def test_coarse_elements_fill_every_finger(spacing: float) -> None:
    from warpjld.hand.kept import kept_hand

    flesh = flesh_of(kept_hand("left", resolution=4000), spacing)
    assert flesh.fit.least >= 0.1
    assert flesh.fit.volume > 0.94
    assert flesh.fit.gap < 0.6 * spacing
    assert len(flesh.names) == len({*flesh.names})
    assert {"thumb", "index", "middle", "ring", "pinky"} <= {part for name in flesh.names for part in name.split(".")}
    assert (flesh.skin.outside < 1.5).all()  # fingertips too


def _volume(mesh):  # type: ignore[no-untyped-def]
    from warpjld.fem.load.loads import volumes

    return volumes(mesh).sum(axis=1)
