"""SHOW DISTANCE, SHOW INTERSECTION and PICTURE … NUMBERS (R73, R75, R132, R133)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.io.test_numbers import CUBE
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.render import Camera, Numbered, Quality, SceneRenderer, with_numbers
from warpjld.script.binding import cover
from warpjld.script.runner import run_scene
from warpjld.script.staging import stage

NUMBER = r"(-?[\d.]+) mm"


def test_distance_in_the_basis_of_a_facet(run, scene, tmp_path: Path) -> None:
    """Facet 2 of the cube, a pentagon on top of it: x along its first edge, y its normal, z = x × y."""
    (tmp_path / "cube.obj").write_text(CUBE)
    run(f"FINGER1 LEFT INDEX FLEXION AT 5 30\nOBJECT c '{tmp_path / 'cube.obj'}' UNIT M SCALE 0.1 AT 0.01 -0.2 -0.3")
    run("SHOW DISTANCE 5 412 c 2")
    said = scene.said[-1]
    x, y, z = (float(found) for found in re.findall(NUMBER, said)[:3])
    skin = cover(scene.actor()).deform(stage(scene.actor(), np.array([5.0]), scene.rate))[0]
    corner = np.array([0.01, -0.2, -0.3]) + 0.1 * np.array([0, 0, 1])
    away = 1e3 * (skin[412] - corner)
    np.testing.assert_allclose([x, y, z], [away[0], away[2], -away[1]], atol=2e-3)
    assert ("behind its plane" if y < 0 else "before its plane") in said
    over = 0 <= away[0] <= 100 and 0 <= away[1] <= 100
    assert ("over the facet" if over else "beside the facet") in said
    assert said.startswith("LEFT vertex 412 in the basis of C facet 2 at frame 5:")


def test_over_a_polygon_counts_all_its_triangles(run, scene, tmp_path: Path) -> None:
    (tmp_path / "cube.obj").write_text(CUBE)
    vertex = 412
    x, y, z = scene.actor().rig.surface.vertices[vertex]
    for dx, dy in ((0.02, 0.05), (0.05, 0.08), (0.08, 0.05), (0.05, 0.02)):
        name = f"c{round(1e3 * dx)}_{round(1e3 * dy)}"
        run(f"OBJECT {name} '{tmp_path / 'cube.obj'}' UNIT M SCALE 0.1 AT {x - dx} {y - dy} {z - 0.15}")
        run(f"SHOW DISTANCE 0 {vertex} {name} 2")
        assert "over the facet" in scene.said[-1]


def test_intersection_lists_vertices_and_depths(run, scene) -> None:
    run("OBJECT block BOX 0.2 0.02 0.2 AT 0 -0.02 -0.15")
    run("SHOW INTERSECTION 0 index block")
    head, *lines = scene.said[-1].splitlines()
    found = {int(n): float(d) for n, d in (re.match(r"\s+vertex\s+(\d+)\s+" + NUMBER, line).groups() for line in lines)}
    assert head.startswith(f"LEFT index in BLOCK at frame 0: {len(found)} vertices inside")
    points = scene.actor().rig.surface.vertices
    depth = 1e3 * np.minimum(-0.01 - points[:, 1], points[:, 1] + 0.03)  # of a slab
    for number, deep in found.items():
        assert deep == pytest.approx(depth[number], abs=2e-3)
    assert list(found.values()) == sorted(found.values(), reverse=True)
    assert found


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("SHOW DISTANCE", "expected the frame"),
        ("SHOW DISTANCE 0 99999 a 1", "the hand vertex .* must be .* or less, got 99999"),
        ("SHOW DISTANCE 0 1 b 1", "there is no object b"),
        ("SHOW DISTANCE 0 1 a 99999", "object a has facets 0 to 5119, got 99999"),
        ("SHOW INTERSECTION 0 index", "expected an object's name"),
        ("SHOW INTERSECTION 0 indx a", "no part 'indx' in this surface; did you mean index"),
        ("PICTURE 0 'a.png' NUMBERS apple", "there is no actor or object APPLE"),
        ("PICTURE 0 'a.png' NUMBRES", "did you mean NUMBERS"),
        ("FILM 'a.mp4' NUMBERS", "expected the style"),
    ],
)
def test_wrong_input(run, line: str, says: str) -> None:
    run("OBJECT a BALL")
    with pytest.raises(InputError, match=says):
        run(line)


def test_a_segment_of_the_other_hand_is_that_hands(run, scene) -> None:
    """The right hand came last, and is the current actor."""
    run("HAND RIGHT BUILTIN RESOLUTION 1500\nOBJECT block BOX 0.2 0.02 0.2 AT 0 -0.02 -0.15")
    run("SHOW INTERSECTION 0 left.index block\nSHOW INTERSECTION 0 right.index block\nSHOW INTERSECTION 0 index block")
    left, right, current = (said.split()[0] for said in scene.said[-3:])
    assert (left, right, current) == ("LEFT", "RIGHT", "RIGHT")


def test_a_picture_with_numbers(run, tmp_path: Path) -> None:
    scene = run("CAMERA DORSAL\nPICTURE 0 'plain.png'\nPICTURE 0 'numbers.png' NUMBERS LEFT\nSIZE 400 300")
    run_scene(scene, tmp_path)
    plain, numbered = (np.asarray(Image.open(tmp_path / name)) for name in ("plain.png", "numbers.png"))
    assert plain.shape == numbered.shape
    assert (plain != numbered).any(axis=2).mean() > 0.05


def test_only_what_is_seen_has_a_number() -> None:
    """Of a cube seen along z the far corners are hidden, and a quad's diagonal is no edge."""
    corners = np.array([[x, y, z] for z in (0.0, 1.0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))])
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    facets = np.repeat(np.arange(6), 2)
    camera = Camera((0.5, 0.5, 8.0), (0.5, 0.5, 0.0))
    with SceneRenderer(faces, camera, size=(300, 300), quality=Quality(occlusion=False)) as stage_:
        picture = stage_.draw(corners)
        places, seen = stage_.seen(corners)
        shown = Numbered(corners, faces, np.arange(8) + 100, facets)
        assert seen.tolist() == [False] * 4 + [True] * 4
        assert len(shown.edges()) == 12
        np.testing.assert_allclose(shown.middles()[0][1], [0.5, 0.5, 1.0], atol=1e-12)
        assert places[6, 0] > places[4, 0]
        assert places[6, 1] < places[4, 1]
        marked = with_numbers(picture, stage_, [shown])
    changed = (marked != picture).any(axis=2)
    for place in places[4:]:
        column, row = np.round(place).astype(int)
        assert changed[row - 5 : row + 5, column - 8 : column + 8].mean() > 0.3
    column, row = np.round(places[[4, 6]].mean(axis=0)).astype(int)  # the near facet's number
    assert changed[row - 3 : row + 3, column - 3 : column + 3].any()


def test_numbers_of_welded_vertices_are_the_files(run, scene, data: Path) -> None:
    """A vertex behind the first seam of the WebXR hand: messages and commands mean the file's."""
    rig = load_rig(data / "hand_webxr_generic" / "left.glb")
    scene.add("webxr", rig)
    vertex = len(rig.surface.vertices) - 1
    number = int(rig.surface.numbers[vertex])
    assert number > vertex
    run(f"OBJECT a BALL\nSHOW DISTANCE 0 {number} a 3")
    assert f"WEBXR vertex {number} in the basis" in scene.said[-1]


def test_searches_take_and_tell_the_files_facets(run, scene, tmp_path: Path) -> None:
    """A plate of quads: facet 1 looks up, and wherever the finger comes down on it, it is on the facet."""
    corners = [(x, y, z) for y in (-1, 0) for x, z in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = [(1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)]
    lines = [*("v {} {} {}".format(*c) for c in corners), *("f {} {} {} {}".format(*q) for q in quads)]
    (tmp_path / "plate.obj").write_text("\n".join(lines))
    for x, z in ((-0.05, -0.35), (-0.35, -0.15)):
        name = f"p{round(-100 * x)}"
        run(f"OBJECT {name} '{tmp_path / 'plate.obj'}' UNIT M SCALE 0.4 AT {x} -0.06 {z}")
        run(f"AUTO_F_1 3 LEFT INDEX PAD {name} 1")
        found = scene.attempts[-1]
        assert found.status == "CONVERGED"
        assert found.values["facet"] == 1
        assert "beside the facet" not in found.message
    run("AUTO_F_1 3 LEFT INDEX PAD p5 NEAREST")
    assert scene.attempts[-1].values["facet"] == 1
