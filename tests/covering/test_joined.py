"""Surfaces of several meshes: borders that coincide at rest stay together in every pose, by both methods (R18)."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from warpjld.covering import Covering, bind
from warpjld.covering.pose_sets import curled
from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.surface import Part, Surface, weld_surface
from warpjld.io import load_rig
from warpjld.rig import Rig
from warpjld.skeleton import poses_from_angles

METHODS = ("smooth", "paper")
Piece = tuple[NDArray[np.float64], NDArray[np.int64]]


def piece(points: NDArray[np.float64], faces: NDArray[np.integer]) -> Piece:
    """The vertices that some faces use, and the faces over these."""
    used, corners = np.unique(faces, return_inverse=True)
    return points[used], corners.reshape(-1, 3)


def together(*pieces: Piece, joins: NDArray[np.bool_] | None = None) -> Surface:
    """One surface of several meshes, as a file with one mesh after another gives it."""
    vertices = np.cumsum([0, *(len(points) for points, _ in pieces)])
    faces = np.cumsum([0, *(len(some) for _, some in pieces)])
    parts = tuple(
        Part(f"mesh{k}", slice(int(vertices[k]), int(vertices[k + 1])), slice(int(faces[k]), int(faces[k + 1])))
        for k in range(len(pieces))
    )
    corners = np.concatenate([some + first for (_, some), first in zip(pieces, vertices, strict=False)])
    return weld_surface(np.concatenate([points for points, _ in pieces]), corners, parts=parts, joins=joins)


def parted(covering: Covering, frames: tuple[float, ...] = (0.3, 0.9)) -> tuple[float, int]:
    """How far source vertices that are one place at rest part in a fist and a bent wrist [m], and how many pairs."""
    surface, skeleton = covering.surface, covering.skeleton
    pairs = cKDTree(surface.to_source(surface.vertices)).query_pairs(1e-7, output_type="ndarray")
    bent = np.zeros((1, len(skeleton), 4))
    bent[0, skeleton.index("wrist"), 0] = 1.0
    out = [covering.deform(curled(skeleton, frames)), covering.deform(poses_from_angles(skeleton, bent))]
    moved = surface.to_source(np.concatenate(out))
    return float(np.linalg.norm(moved[:, pairs[:, 0]] - moved[:, pairs[:, 1]], axis=-1).max()), len(pairs)


def border_of(faces: NDArray[np.integer]) -> NDArray[np.integer]:
    edges, times = np.unique(
        np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True
    )
    return np.unique(edges[times == 1])


def cut(rig: Rig, beyond: NDArray[np.bool_]) -> Surface:
    """A rig's surface as two meshes."""
    points, faces = rig.surface.vertices, rig.surface.faces
    over = beyond[faces].all(axis=1)
    return together(piece(points, faces[~over]), piece(points, faces[over]))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("where", [-0.105, -0.02], ids=["fingers", "hand"])
def test_pieces_of_a_hand_move_as_the_whole_does(hands: dict[str, Rig], method: str, where: float) -> None:
    rig = hands["left"]
    joined = cut(rig, rig.surface.vertices[:, 2] < where)
    assert len(joined.weld) > len(joined.vertices) == len(rig.surface.vertices)
    covering = bind(rig.skeleton, joined, method=method)
    gap, pairs = parted(covering)
    assert pairs > 20
    assert gap == 0.0
    poses = curled(rig.skeleton, (0.9,))
    whole = bind(rig.skeleton, rig.surface, method=method).deform(poses)
    same = cKDTree(rig.surface.vertices).query(joined.vertices)[1]
    np.testing.assert_allclose(covering.deform(poses), whole[:, same], atol=1e-6)


def test_a_hand_on_a_body_is_one_surface_with_it(figure: Rig) -> None:
    wrist = figure.skeleton.rest[figure.skeleton.index("left.wrist")]
    joined = cut(figure, figure.surface.vertices[:, 0] > wrist[0])
    assert len(joined.parts) == 2
    assert len(joined.weld) > len(joined.vertices) == len(figure.surface.vertices)
    assert len(joined.faces) == len(figure.surface.faces)


def sleeve(rig: Rig, chosen: NDArray[np.bool_], thick: float = 0.002) -> Piece:
    """Cloth over some vertices of the skin, its border on the skin."""
    points, faces = rig.surface.vertices, rig.surface.faces
    some = faces[chosen[faces].all(axis=1)]
    cloth = points + thick * vertex_normals(points, faces)
    sewn = border_of(some)
    cloth[sewn] = points[sewn]
    return piece(cloth, some)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("place", ["finger", "palm", "nail"])
def test_borders_of_clothes_stay_on_the_skin(hands: dict[str, Rig], method: str, place: str) -> None:
    """Inside it, not on its border: the cloth is a shell of its own, small ones such as the nail too."""
    rig = hands["left"]
    points, skeleton = rig.surface.vertices, rig.skeleton
    tip = skeleton.rest[skeleton.index("index.knuckle3")]
    chosen = {
        "finger": (points[:, 2] < -0.10) & (points[:, 2] > -0.135) & (points[:, 0] > 0.01),
        "palm": (points[:, 2] < -0.03) & (points[:, 2] > -0.08),
        "nail": (np.linalg.norm(points - tip, axis=1) < 0.010) & (points[:, 1] > tip[1]),
    }[place]
    surface = together((points, rig.surface.faces), sleeve(rig, chosen))
    gap, pairs = parted(bind(skeleton, surface, method=method))
    assert pairs > 5
    assert gap < 1e-6


def test_what_is_rigid_is_not_joined_to_flesh(hands: dict[str, Rig]) -> None:
    rig = hands["left"]
    points, faces = rig.surface.vertices, rig.surface.faces
    over = (points[:, 2] < -0.105)[faces].all(axis=1)
    skin, hard = piece(points, faces[~over]), piece(points, faces[over])
    joins = np.arange(len(skin[0]) + len(hard[0])) < len(skin[0])
    apart = together(skin, hard, joins=joins)
    assert len(apart.vertices) == len(skin[0]) + len(hard[0])


def test_closed_pieces_that_touch_are_not_joined() -> None:
    """Only borders are: an eye that touches a lid, or two boxes side by side, stay two."""
    box = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    ahead = np.array([1.0, 0.0, 0.0])
    both = together((box, faces), (box + ahead, faces))
    assert len(both.vertices) == 16
    lid = together((box, faces[2:]), (box - ahead, np.delete(faces, [2, 3], axis=0)))
    assert len(lid.vertices) == 12  # open towards one another: four corners are shared


def test_meshes_of_a_file(tmp_path: Path, hands: dict[str, Rig]) -> None:
    """Two objects of an OBJ file; borders a tenth of a millimetre apart are none that coincide."""
    rig = hands["left"]
    points, faces = rig.surface.vertices, rig.surface.faces
    over = (points[:, 2] < -0.105)[faces].all(axis=1)
    joints = [
        {"name": n, "parent": None if p < 0 else rig.skeleton.names[p], "position": x.tolist()}
        for n, p, x in zip(rig.skeleton.names, rig.skeleton.parents, rig.skeleton.rest, strict=True)
    ]
    (tmp_path / "joints.json").write_text(json.dumps({"joints": joints}))

    def written(shift: float) -> Rig:
        lines, count = [], 0
        for name, some, off in (("palm", ~over, 0.0), ("fingers", over, shift)):
            own, corners = piece(points, faces[some])
            lines += [f"o {name}", *(f"v {x:.8f} {y:.8f} {z + off:.8f}" for x, y, z in own)]
            lines += [f"f {a} {b} {c}" for a, b, c in corners + count + 1]
            count += len(own)
        path = tmp_path / f"hand{shift}.obj"
        path.write_text("\n".join(lines))
        return load_rig(path, skeleton=tmp_path / "joints.json", unit="m")

    one, two = written(0.0), written(-1e-4)
    note = "meshes joined where their borders coincide, at 45 vertices"
    assert note in one.notes
    assert not any("meshes joined" in line for line in two.notes)
    assert len(two.surface.vertices) == len(one.surface.vertices) + 45
