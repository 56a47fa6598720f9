"""Points proposed from surfaces alone (R12, R13): on bodies and hands made in code, and on those of others."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from warpjld.cli.place import place_command
from warpjld.covering.surface_binding import bind_rig
from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.io import load_rig
from warpjld.skeleton.actor import actor_skeleton
from warpjld.skeleton.actor_points import ACTOR_POINTS
from warpjld.skeleton.channels import CHANNELS
from warpjld.skeleton.hand import hand_joint_names
from warpjld.skeleton.kinematics import poses_from_angles
from warpjld.skeleton.place.place import propose_points
from warpjld.skeleton.place.solid import solid_of
from warpjld.skeleton.place.stance import find_stance


@pytest.fixture(scope="module")
def placed(figure):
    return propose_points(figure.surface.vertices, figure.surface.faces)


def test_a_body_gets_all_87_points_inside_and_near_their_joints(figure, placed):
    assert list(placed) == list(ACTOR_POINTS)
    mesh = trimesh.Trimesh(figure.surface.vertices, figure.surface.faces, process=False)
    assert mesh.contains(np.array(list(placed.values()))).all()
    truth = actor_skeleton(figure.skeleton, figure.surface.vertices, figure.surface.faces).points
    off = {name: np.linalg.norm(placed[name] - truth[name]) for name in placed}
    assert np.mean(list(off.values())) < 0.02
    assert max(off, key=off.get) not in hand_joint_names("left")
    assert max(off.values()) < 0.06


@pytest.mark.slow
def test_points_turn_and_scale_with_the_surface(figure, placed):
    """Lying along z, in centimetres, facing another way."""
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # up becomes z
    moved = propose_points(100.0 * figure.surface.vertices @ turn.T + 30.0, figure.surface.faces)
    for name, place in placed.items():
        np.testing.assert_allclose(moved[name], 100.0 * turn @ place + 30.0, atol=3.0, err_msg=name)


@pytest.mark.slow
def test_a_belly_does_not_move_the_spine(figure, placed):
    """Lumps of 5 cm on the belly, and all of it 12 cm further out: joints stay where they are."""
    vertices = figure.surface.vertices
    normals = trimesh.Trimesh(vertices, figure.surface.faces, process=False).vertex_normals
    belly = np.array([0.0, placed["vertebra2"][1], vertices[:, 2].max()])
    front = vertices[:, 2] > placed["vertebra2"][2]
    middle = vertices[front][np.linalg.norm(vertices[front] - belly, axis=1).argmin()]
    lumps = np.zeros(len(vertices))
    for x, y in ((-0.08, 0.06), (0.07, 0.08), (0.02, -0.02), (-0.06, -0.05), (0.09, -0.04), (0.0, 0.1)):
        lumps += 0.05 * np.exp(-((np.linalg.norm(vertices - middle - np.array([x, y, 0.0]), axis=1) / 0.04) ** 2))
    whole = np.exp(-((np.linalg.norm(vertices - middle, axis=1) / 0.18) ** 2)) * front
    for surface in (vertices + lumps[:, None] * normals, vertices + 0.12 * whole[:, None] * [0.0, 0.0, 1.0]):
        points = propose_points(surface, figure.surface.faces)
        for name, place in placed.items():
            assert np.linalg.norm(points[name] - place) < 0.03, name


def posed(rig, turns):
    """A rig's surface and joints with some angles [degrees] by joint and channel."""
    angles = np.zeros((1, len(rig.skeleton), 4))
    for (joint, channel), degrees in turns.items():
        angles[0, rig.skeleton.index(joint), CHANNELS.index(channel)] = np.radians(degrees)
    poses = poses_from_angles(rig.skeleton, angles)
    return bind_rig(rig).deform(poses)[0].astype(np.float64), dict(
        zip(rig.skeleton.names, poses.positions[0], strict=True)
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "turns",
    [
        {("left.shoulder", "abduction"): 100.0, ("right.shoulder", "abduction"): 100.0},  # hands above the head
        {("left.hip", "flexion"): 25.0, ("right.hip", "flexion"): -15.0},  # a stride
    ],
    ids=["raised", "stride"],
)
def test_poses_of_a_body(figure, turns):
    """Raised arms ended in a traceback, a stride turned the body's left."""
    surface, truth = posed(figure, turns)
    points = propose_points(surface, figure.surface.faces)
    off = {name: np.linalg.norm(place - truth[name]) for name, place in points.items() if name in truth}
    assert len(off) > 60
    assert np.mean(list(off.values())) < 0.02
    assert max(off.values()) < 0.06
    raised = truth["left.middle.tip"][1] > truth["head.top"][1]
    assert raised == (("left.shoulder", "abduction") in turns)


@pytest.mark.parametrize("turn", [(-90.0, 0.0, 0.0), (90.0, 0.0, 0.0)], ids=["head first", "z up"])
def test_a_coarse_body_is_not_upright_along_its_depth(data, turn):
    """Arms and trunk were taken for legs; it ended in a traceback, or in no hands."""
    surface = load_rig(data / "body_anny/body_lowpoly_163joints.glb").surface
    turned = Rotation.from_euler("xyz", turn, degrees=True)
    vertices = turned.apply(surface.vertices)
    size = float(np.ptp(vertices, axis=0).max()) / 170
    stance = find_stance(solid_of(vertices, surface.faces, size).main_piece(), "it")
    np.testing.assert_allclose(stance.frame[1], turned.apply((0.0, 1.0, 0.0)), atol=1e-9)
    np.testing.assert_allclose(stance.frame[2], turned.apply((0.0, 0.0, 1.0)), atol=0.02)  # it faces ahead
    assert stance.height == pytest.approx(np.ptp(surface.vertices[:, 1]), rel=0.03)


@pytest.fixture(scope="module")
def whole(hands):
    """Points of both hands, in metres."""
    return {side: propose_points(rig.surface.vertices, rig.surface.faces) for side, rig in hands.items()}


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_hand_gets_its_25_points_and_its_side(hands, whole, side):
    rig, points = hands[side], whole[side]
    assert tuple(points) == hand_joint_names(side)
    off = [np.linalg.norm(p - rig.skeleton.rest[rig.skeleton.names.index(name)]) for name, p in points.items()]
    assert np.mean(off) < 0.008
    assert max(off) < 0.02


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("hand_webxr_generic/left.glb", marks=pytest.mark.slow),
        pytest.param("hand_webxr_generic/right.glb", marks=pytest.mark.slow),
        "hand_anny/left.glb",
        pytest.param("hand_godot_low/Hand_low_R.gltf", marks=pytest.mark.slow),
    ],
)
def test_hands_of_others(data, name):
    rig = load_rig(data / name)
    points = propose_points(rig.surface.vertices, rig.surface.faces)
    rest = dict(zip(rig.skeleton.names, rig.skeleton.rest, strict=True))
    assert set(points) <= set(rest)
    off = [np.linalg.norm(place - rest[joint]) for joint, place in points.items()]
    assert np.mean(off) < 0.012


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "body_anny/body_104joints.glb",
        "body_anny/body_lowpoly_163joints.glb",
        "body_mesh2motion_mannequin/human-male.glb",
    ],
)
def test_bodies_of_others(data, name):
    rig = load_rig(data / name)
    points = propose_points(rig.surface.vertices, rig.surface.faces)
    truth = actor_skeleton(rig.skeleton, rig.surface.vertices, rig.surface.faces).points
    off = [np.linalg.norm(points[joint] - truth[joint]) for joint in truth]
    assert np.mean(off) < 0.025


def test_what_is_placed_is_written_and_loads_as_it_is(hands, tmp_path):
    surface, file = tmp_path / "hand.obj", tmp_path / "points.json"
    hand = hands["right"].surface
    trimesh.Trimesh(hand.vertices, hand.faces, process=False).export(surface)
    result = CliRunner().invoke(place_command, [str(surface), "-o", str(file), "--side", "right"])
    assert result.exit_code == 0, result.output
    rig = load_rig(surface, points=file)
    wanted = json.loads(file.read_text())["points"]
    assert sorted(rig.skeleton.names) == sorted(wanted)
    for name, place in zip(rig.skeleton.names, rig.skeleton.rest, strict=True):
        np.testing.assert_allclose(place, wanted[name], atol=1e-6)


@pytest.mark.slow
def test_what_is_neither_body_nor_hand_is_refused(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3)
    ball.apply_scale([0.1, 1.0, 0.1])
    with pytest.raises(InputError, match=r"no upright body .*; and no hand"):
        propose_points(ball.vertices, ball.faces)
    flat = np.array([[0.0, 0, 0], [0, 0, 0], [0, 0, 0]])
    with pytest.raises(InputError, match="has no triangles, or no extent"):
        propose_points(flat, np.array([[0, 1, 2]]))
    mitten = trimesh.creation.capsule(height=0.1, radius=0.006)
    with pytest.raises(InputError, match="spread the fingers"):
        propose_points(mitten.vertices, mitten.faces, side="left")


def test_units_of_length_mean_nothing(hands, whole):
    rig = hands["left"]
    small = propose_points(rig.surface.vertices * 1e-3, rig.surface.faces, side="left")
    for name in whole["left"]:
        np.testing.assert_allclose(1e3 * small[name], whole["left"][name], atol=3e-3)
    forward = unit(whole["left"]["left.middle.tip"] - whole["left"]["left.wrist"])
    assert forward @ (0, 0, -1) > 0.9
