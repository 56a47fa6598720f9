"""Objects in bonded pieces, each with its law; volume files with laws by region; bonds that break (R101, R141)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import box_hexes
from warpjld.grasp import shapes
from warpjld.grasp.pieces import cut_object, longest_axis
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.simulate import Simulation

PULLED = """
POINTS {foot} foot LOWER Y 0
POINTS {head} head UPPER Y 0
HOLD {foot} foot
VECTOR {head} head AT 0 0 0 0
VECTOR {head} head AT {last} 0 {way} 0
FRICTION 0
PRESS 0 {last}
"""
SECTION, HALF = 4e-4, 0.03  # of the bar [m², m]


def scene_of(text: str) -> Scene:
    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(text)
    return scene


def pull(found: Simulation) -> float:
    """Force that draws the bar out at the last frame [N]."""
    return float(np.abs(found.solved.frames[-1].reactions[:, 1]).sum()) / 2.0


@pytest.fixture
def bar(tmp_path: Path) -> Path:
    """A bar in two regions, as another program would have meshed it."""
    meshio = pytest.importorskip("meshio")
    mesh = box_hexes((0.02, 2 * HALF, 0.02), (2, 6, 2), origin=(-0.01, 0.0, -0.01))
    regions = (mesh.nodes[mesh.elements].mean(axis=1)[:, 1] > HALF).astype(int) + 1
    path = tmp_path / "bar.vtu"
    meshio.write(path, meshio.Mesh(mesh.nodes, [("hexahedron", mesh.elements)], cell_data={"region": [regions]}))
    return path


@pytest.mark.parametrize(
    ("thing", "kinds"),
    [
        (shapes.box(0.02, 0.06, 0.02), {"box"}),
        (shapes.cylinder(0.02, 0.06), {"cylinder"}),
        (shapes.ball(0.05), {""}),
    ],
)
def test_slices_fill_the_whole(thing, kinds) -> None:  # type: ignore[no-untyped-def]
    axis = longest_axis(thing)
    cut = cut_object(thing, 3, axis)
    assert {piece.origin for piece in cut} == kinds
    assert all(piece.report.watertight for piece in cut)
    assert sum(piece.volume for piece in cut) == pytest.approx(thing.volume, rel=1e-9)
    low, high = thing.vertices[:, axis].min(), thing.vertices[:, axis].max()
    ends = np.linspace(low, high, 4)
    for piece, a, b in zip(cut, ends[:-1], ends[1:], strict=True):
        np.testing.assert_allclose([piece.vertices[:, axis].min(), piece.vertices[:, axis].max()], [a, b], atol=1e-9)


def test_pieces_part_at_their_bond_and_the_frame_is_told(tmp_path: Path) -> None:
    """Three slices, the middle one stiffer; with ν = 0 the tension is the same everywhere, known, and breaks both bonds
    between the frames that it says."""
    law = "LAW LINEAR YOUNG {young} POISSON 0 ELEMENT 0.01\n"
    text = "OBJECT bar BOX 0.02 0.06 0.02\nPHYSICAL bar " + law.format(young="1e5") + "PIECES bar 3 BOND 3e3\n"
    text += "PHYSICAL bar_2 " + law.format(young="4e5")
    found = run_contact(scene_of(text + PULLED.format(foot="bar_1", head="bar_3", last=4, way=0.004)), tmp_path)
    assert found.verdict.status == "CONVERGED"
    assert sorted(found.notes) == [
        f"BAR_{one} and BAR_2 part between frames 1 and 2 wholly" for one in (1, 3)
    ]  # each frame adds 0.001 m over 0.04 / 1e5 + 0.02 / 4e5 m/Pa: 2222 Pa; the second is too much
    bonded = np.array([frame.bonded for frame in found.solved.frames])
    across = [owner.other("BAR_2") is not None for owner in found.model.owners]
    assert (bonded[0][across] == 1.0).all()
    assert (bonded[-1][across] == 0.0).all()
    assert pull(found) < 1e-6


def test_a_law_per_region_of_a_volume_file(bar: Path, tmp_path: Path) -> None:
    """A bar of two moduli: F = A u / (L₁/E₁ + L₂/E₂), in one body and in bonded pieces."""
    soft, stiff = (f"LAW LINEAR YOUNG {young} POISSON 0" for young in ("1e5", "2e5"))
    whole = f'OBJECT bar "{bar}"\nPHYSICAL bar {soft}\nPHYSICAL bar REGION region2 {stiff}\n'
    parts = f'OBJECT bar "{bar}"\nPIECES bar REGIONS\nPHYSICAL bar_region1 {soft}\nPHYSICAL bar_region2 {stiff}\n'
    wanted = SECTION * 6e-4 / (HALF / 1e5 + HALF / 2e5)
    for text, foot, head in ((whole, "bar", "bar"), (parts, "bar_region1", "bar_region2")):
        found = run_contact(scene_of(text + PULLED.format(foot=foot, head=head, last=1, way=6e-4)), tmp_path)
        assert found.verdict.status == "CONVERGED"
        assert pull(found) == pytest.approx(wanted, rel=1e-4)


def test_what_cannot_be_cut(bar: Path) -> None:
    box = "OBJECT bar BOX 0.02 0.06 0.02\n"
    for text, what in (
        (box + "PIECES bar 1", "number of pieces must be 2 or more"),
        (box + "PIECES rod 3", "there is no object rod"),
        (box + "MOVE bar 0 0 1 0\nPIECES bar 3", "cut it first, then move its pieces"),
        (box + "PHYSICAL bar OF RUBBER HOLLOW 0.002\nPIECES bar 2", "BAR is HOLLOW, and a wall across the cut"),
        (box + "PIECES bar REGIONS", "bar has no regions"),
        (box + "PHYSICAL bar REGION core YOUNG 1e5", "it is from no volume file"),
        (f'OBJECT bar "{bar}"\nPHYSICAL bar REGION region3 YOUNG 1e5', "has no region region3"),
        (f'OBJECT bar "{bar}"\nPHYSICAL bar REGION region2 HOLLOW 0.001', "for an object as a whole"),
        (f'OBJECT bar "{bar}"\nPIECES bar REGIONS ALONG X', "regions are as the file has them"),
        (box + "OBJECT bar_2 BALL\nPIECES bar 3", "there is an object or actor BAR_2 already"),
    ):
        with pytest.raises(InputError, match=what):
            scene_of(text)


def test_pieces_keep_the_friction_of_the_whole() -> None:
    """It fell back to the default."""
    floor = "OBJECT floor BOX 1 0.02 1 AT 0 -0.01 0\nOBJECT bar BOX 0.02 0.06 0.02 AT 0 0.03 0\nPHYSICAL bar\n"
    contact = scene_of(f"{floor}FRICTION bar floor 0.1\nFRICTION bar bar 0.2\nPIECES bar 2\n").contact
    assert [contact.coefficient(name, "FLOOR") for name in ("BAR_1", "BAR_2")] == [0.1, 0.1]
    assert contact.coefficient("BAR_1", "BAR_2") == 0.2
    assert not [pair for pair in contact.friction if "BAR" in pair]


def test_pieces_that_do_not_deform_say_what_to_do() -> None:
    text = "OBJECT bar BOX 0.02 0.06 0.02\nOBJECT b BOX 0.02 0.02 0.02 AT 1 0 0\nPHYSICAL b\nPIECES bar 2\nPRESS 0 1\n"
    with pytest.raises(InputError, match="BAR_1 does not deform here: PHYSICAL BAR_1 makes it so"):
        run_contact(scene_of(text), Path())


def test_a_region_without_a_name_is_called_by_its_number(bar: Path) -> None:
    text = f"OBJECT bar '{bar}'\nPHYSICAL bar OF RUBBER\nPHYSICAL bar REGION 2 YOUNG 4000\n"
    ((name, matter),) = scene_of(text).contact.physical["BAR"].regions
    assert (name, matter.young) == ("region2", 4000.0)
    with pytest.raises(InputError, match="BAR has no region region7; did you mean region2"):
        scene_of(text.replace("REGION 2", "REGION 7"))
