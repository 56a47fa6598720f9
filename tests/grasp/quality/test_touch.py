"""Patches of contact on skins whose areas and normals are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.grasp.quality import contact_patches, vertex_areas

_RADIUS, _TOLERANCE = 0.01, 0.001


def _ball_above_a_plane() -> dict[str, np.ndarray]:
    """A fingertip (ball) that just touches the plane z = 0, its object below."""
    ball = trimesh.creation.icosphere(subdivisions=5, radius=_RADIUS)
    vertices = np.array(ball.vertices) + np.array([0.0, 0.0, _RADIUS])
    return {
        "vertices": vertices,
        "faces": np.array(ball.faces),
        "parts": np.zeros(len(vertices), int),
        "distances": vertices[:, 2],
        "nearest": vertices * [1.0, 1.0, 0.0],
        "outward": np.tile([0.0, 0.0, 1.0], (len(vertices), 1)),
    }


def test_cap_of_a_ball_on_a_plane() -> None:
    """A cap of height h has area 2πRh, lies below the ball's centre, and looks straight down."""
    patches = contact_patches(**_ball_above_a_plane(), names=["index.knuckle3"], tolerance=_TOLERANCE)  # type: ignore[arg-type]
    assert patches.names == ("index.knuckle3",)
    assert patches.digits == ("index",)
    assert patches.areas[0] == pytest.approx(2.0 * np.pi * _RADIUS * _TOLERANCE, rel=0.05)
    assert patches.points[0] == pytest.approx([0.0, 0.0, 0.0], abs=1e-5)
    assert patches.normals[0] == pytest.approx([0.0, 0.0, -1.0])
    assert patches.skin_normals[0] == pytest.approx([0.0, 0.0, -1.0], abs=1e-3)
    contacts = patches.contacts(0.6)
    assert contacts.spin[0] == pytest.approx(2.0 / 3.0 * 0.6 * np.sqrt(patches.areas[0] / np.pi))


def test_parts_are_patches_of_their_own_and_none_is_no_patch() -> None:
    skin = _ball_above_a_plane()
    skin["parts"] = np.where(skin["vertices"][:, 0] > 0.0, 2, np.where(skin["vertices"][:, 1] > 0.0, 0, -1))
    patches = contact_patches(**skin, names=["palm", "ring.base", "thumb.tip"], tolerance=_TOLERANCE)  # type: ignore[arg-type]
    assert patches.names == ("palm", "thumb.tip")
    assert patches.areas[1] > 1.5 * patches.areas[0]
    assert patches.points[1][0] > 0.0 > patches.points[0][0]
    skin["distances"] = skin["distances"] + 1.0
    none = contact_patches(**skin, names=["palm", "ring.base", "thumb.tip"], tolerance=_TOLERANCE)  # type: ignore[arg-type]
    assert len(none) == 0
    assert len(none.contacts(0.5)) == 0


def test_vertex_areas_add_up() -> None:
    skin = _ball_above_a_plane()
    total = vertex_areas(skin["vertices"], skin["faces"]).sum()
    assert total == pytest.approx(4.0 * np.pi * _RADIUS**2, rel=0.002)


def test_wrong_shapes_are_named() -> None:
    skin = _ball_above_a_plane()
    with pytest.raises(InputError, match="distances"):
        contact_patches(**(skin | {"distances": np.zeros(3)}), names=["palm"], tolerance=0.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="tolerance"):
        contact_patches(**skin, names=["palm"], tolerance=-1.0)  # type: ignore[arg-type]
