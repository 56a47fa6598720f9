"""Views in a notebook: what the notebook gets, who may hold it, and that its frames are those asked for."""

from __future__ import annotations

import http.client
import re
from collections.abc import Iterator

import numpy as np
import pytest

from warpjld.covering import Covering, bind_rig
from warpjld.errors import InputError
from warpjld.hand.kept import kept_hand
from warpjld.page.guard import RequestGuard
from warpjld.page.view import SurfaceView, ViewedSurface
from warpjld.skeleton import poses_from_angles

pytest.importorskip("viser", reason="viser is not installed")


@pytest.fixture(scope="module")
def covering() -> Covering:
    return bind_rig(kept_hand("left", resolution=1500))


@pytest.fixture
def view(covering: Covering) -> Iterator[SurfaceView]:
    angles = np.repeat(covering.skeleton.initial[None], 3, axis=0)
    angles[2, covering.skeleton.index("left.index.base"), 0] = 1.0
    made = covering.show(poses_from_angles(covering.skeleton, angles))
    yield made
    made.close()


def test_a_covering_in_poses_is_a_frame_of_a_page_that_answers(view: SurfaceView, covering: Covering) -> None:
    (address,) = re.findall(r'<iframe src="(http://127\.0\.0\.1:\d+/)"', view._repr_html_())
    assert address == view.address
    connection = http.client.HTTPConnection("127.0.0.1", int(address.rstrip("/").rpartition(":")[2]), timeout=10)
    connection.request("GET", "/")
    answer = connection.getresponse()
    assert answer.status == 200
    assert answer.headers["Content-Security-Policy"] == ("frame-ancestors 'self' http://localhost:* http://127.0.0.1:*")
    mesh = view._meshes["surface"]
    rest = np.array(mesh.vertices)
    assert np.allclose(rest, covering.surface.vertices, atol=1e-6)
    view.draw(2)
    assert np.linalg.norm(np.array(mesh.vertices) - rest, axis=1).max() > 0.02


def test_the_studio_is_shown_inside_no_other_page() -> None:
    assert RequestGuard("127.0.0.1").ancestors == "frame-ancestors 'self'"


def test_a_view_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="at least one frame"):
        SurfaceView([])


def test_coloured_surfaces_come_and_go_with_their_frames() -> None:
    tetrahedron = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]], np.int32)
    red = np.full((4, 3), (200, 0, 0), np.uint8)
    plain, colored = ViewedSurface("a", tetrahedron, faces), ViewedSurface("b", tetrahedron, faces, colors=red)
    made = SurfaceView([[plain, colored], [plain]], numbers=[4.0, 8.0])
    try:
        assert {*made._meshes} == {"a", "b"}
        made.draw(1)
        assert {*made._meshes} == {"a"}
    finally:
        made.close()
