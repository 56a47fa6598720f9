from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.render import Camera, ColorScale, Quality, SceneRenderer, Solid, Style, shaded, wireframe

SIZE = (120, 90)


@pytest.fixture(scope="module")
def camera(finger) -> Camera:  # type: ignore[no-untyped-def]
    return Camera.view("three-quarter", finger.frames, size=SIZE)


def _background(style: Style | None = None) -> np.ndarray:
    """The picture of next to nothing."""
    far = Camera((0, 0, 1), (0, 0, 0))
    tiny = np.array([[9, 9, -900], [9.1, 9, -900], [9, 9.1, -900]])
    return shaded(tiny, [[0, 1, 2]], far, size=SIZE, style=style)


def _drawn(picture: np.ndarray) -> np.ndarray:
    return np.abs(picture.astype(int) - _background()).max(axis=2) > 12


@pytest.mark.parametrize("quality", [Quality(), Quality.film(), Quality.draft()])
def test_surface_covers_what_it_should(finger, camera: Camera, quality: Quality) -> None:  # type: ignore[no-untyped-def]
    picture = shaded(finger.frames[0], finger.faces, camera, size=SIZE, quality=quality)
    assert picture.shape == (90, 120, 3)
    assert picture.dtype == np.uint8
    back = np.subtract(camera.position, camera.target)
    back /= np.linalg.norm(back)
    right = np.cross(camera.up, back)
    local = (finger.frames[0] - camera.position) @ np.stack([right, camera.up, back]).T
    pixels = local[:, :2] / -local[:, 2:] / np.tan(camera.angle / 2) * 45 * [1, -1] + [60, 45]
    # the outline's area, from the projected vertices alone
    from scipy.spatial import ConvexHull

    assert _drawn(picture).sum() == pytest.approx(ConvexHull(pixels).volume, rel=0.06)


def test_shading_is_smooth_and_lit(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    picture = shaded(finger.frames[0], finger.faces, camera, size=SIZE)
    levels = picture[_drawn(picture)].mean(axis=1)
    assert len(np.unique(levels.round())) > 30
    assert levels.max() - levels.min() > 40


def test_wireframe_shows_bones_through_the_skin(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    plain = wireframe(finger.frames[0], finger.faces, camera, size=SIZE)
    boned = wireframe(
        finger.frames[0], finger.faces, camera, joints=finger.joints[0], segments=finger.segments, size=SIZE
    )
    changed = np.abs(boned.astype(int) - plain).max(axis=2) > 20
    assert 20 < changed.sum() < _drawn(plain).sum()
    blue = boned[changed].astype(int)
    assert (blue[:, 2] > blue[:, 0]).mean() > 0.4


def test_frames_are_the_same_in_any_order(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    """A film's frame is the picture of that frame: nothing stays behind, and the framing does not move."""
    for look in ("shaded", "wireframe"):
        with SceneRenderer(finger.faces, camera, look=look, size=SIZE, segments=finger.segments) as scene:
            forth = [scene.draw(finger.frames[f], joints=finger.joints[f]) for f in range(6)]
            back = [scene.draw(finger.frames[f], joints=finger.joints[f]) for f in reversed(range(6))][::-1]
        for one, other in zip(forth, back, strict=True):
            np.testing.assert_array_equal(one, other)
        assert not np.array_equal(forth[0], forth[5])


def test_values_become_colours(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    values = finger.frames[0][:, 1]
    picture = shaded(finger.frames[0], finger.faces, camera, size=SIZE, values=values)
    skin = shaded(finger.frames[0], finger.faces, camera, size=SIZE)
    rows = np.flatnonzero(_drawn(skin).any(axis=1))
    columns = np.flatnonzero(_drawn(skin)[rows[5]])
    top = picture[rows[5], int(columns.mean())].astype(int)
    columns = np.flatnonzero(_drawn(skin)[rows[-5]])
    bottom = picture[rows[-5], int(columns.mean())].astype(int)
    assert top[0] > 120 > 60 > bottom[1]  # yellow above, violet below
    assert top[2] < bottom[2] + 40


def test_solids_are_drawn_and_move(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    ball = trimesh.creation.icosphere(radius=0.015)
    at = np.array(ball.vertices) + np.array([0.03, 0.04, 0.01])
    solid = Solid(at, ball.faces, "#00a000")
    with SceneRenderer(finger.faces, camera, size=SIZE, solids=[solid]) as scene:
        before = scene.draw(finger.frames[0])
        moved = scene.draw(finger.frames[0], solids=[at + np.array([0, 0.015, 0])])
        kept = scene.draw(finger.frames[0], solids=[None])
    green = [(p[..., 1] > p[..., 0].astype(int) + 40) for p in (before, moved)]
    assert min(mask.sum() for mask in green) > 60
    heights = [np.flatnonzero(mask.any(axis=1)).mean() for mask in green]
    assert heights[1] < heights[0] - 5
    np.testing.assert_array_equal(kept, moved)


def test_sharp_edges_stay_sharp() -> None:
    box = trimesh.creation.box()
    camera = Camera.view("three-quarter", box.vertices, size=SIZE)
    picture = shaded(box.vertices, box.faces, camera, size=SIZE, quality=Quality.film())
    tones = np.unique((picture[_drawn(picture)].mean(axis=1) / 6).round(), return_counts=True)[1]
    assert np.sort(tones)[-3:].sum() > 0.6 * tones.sum()  # three flat sides


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": np.zeros((4, 3))}, "vertices: want at least"),
        ({"vertices": np.zeros((4, 2))}, r"vertices: want shape \(n, 3\), got \(4, 2\)"),
        ({"joints": None}, "joints: want positions"),
        ({"joints": np.zeros((2, 3))}, "segments: joints are 0…1, got 0…2"),
        ({"values": np.zeros(3)}, "values: want them with each frame if a scale"),
    ],
)
def test_refuses(finger, camera: Camera, change: dict, message: str) -> None:  # type: ignore[no-untyped-def]
    given = {"vertices": finger.frames[0], "joints": finger.joints[0], **change}
    with SceneRenderer(finger.faces, camera, segments=finger.segments, size=SIZE) as scene:
        with pytest.raises(InputError, match=message):
            scene.draw(given.pop("vertices"), **given)
        with pytest.raises(InputError, match="not finite"):
            scene.draw(np.full_like(finger.frames[0], np.nan), joints=finger.joints[0])


def test_refuses_scenes(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match="look"):
        SceneRenderer(finger.faces, camera, look="toon")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="size"):
        SceneRenderer(finger.faces, camera, size=(5, 5))
    with pytest.raises(InputError, match="faces"):
        SceneRenderer(np.zeros((0, 3), int), camera)
    with pytest.raises(InputError, match="supersampling"):
        Quality(supersampling=0)
    with (
        pytest.raises(InputError, match="values"),
        SceneRenderer(finger.faces, camera, scale=ColorScale(0, 1)) as scene,
    ):
        scene.draw(finger.frames[0])


def test_needs_no_display_and_stays_quiet(tmp_path: Path) -> None:
    """In a process of its own: VTK warns about X servers on the process's standard error."""
    script = """
import numpy as np, os, pyvista
from warpjld.render import Camera, wireframe
theme = pyvista.global_theme.window_size
points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
picture = wireframe(points, [[0, 1, 2]], Camera.view("palmar", points, size=(64, 64)), size=(64, 64))
assert picture.std() > 3
assert pyvista.global_theme.window_size == theme and not pyvista.OFF_SCREEN
assert "VTK_DEFAULT_OPENGL_WINDOW" not in os.environ
"""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_dense_lines_do_not_hide_the_bones(finger, camera: Camera) -> None:  # type: ignore[no-untyped-def]
    vertices, faces = finger.frames[0], finger.faces
    shares = []
    for _ in range(3):
        given = {"joints": finger.joints[0], "segments": finger.segments, "size": SIZE}
        boned, plain = wireframe(vertices, faces, camera, **given), wireframe(vertices, faces, camera, size=SIZE)
        shares.append((np.abs(boned.astype(int) - plain).max(axis=2) > 20).sum())
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    assert shares[2] > 0.6 * shares[0]
