"""Skin that passes through itself after contact is drawn back (R104, R126, R138)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.simulation.display.smooth import SurfaceSmoother
from warpjld.simulation.display.uncross import SkinCrossings, uncrossed
from warpjld.simulation.frames_run import soft_crease
from warpjld.simulation.specification import ContactSpecification, FleshMaterial

EDGE = 0.15
MOST = 0.075
SIDES = (([0, 3, 4, 7], [1, 2, 5, 6]), ([0, 1, 4, 5], [3, 2, 7, 6]), ([0, 1, 2, 3], [4, 5, 6, 7]))
"""Corners of opposite sides of a hexahedron, along its three edges."""


def hose() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """A closed tube of radius 0.2 and length 2.4 along z, of 40 rings of 20 vertices."""
    turn, height = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False), np.linspace(-1.2, 1.2, 40))
    ring = np.stack([0.2 * np.cos(turn), 0.2 * np.sin(turn), height], axis=-1).reshape(-1, 3)
    first, after = np.arange(20), (np.arange(20) + 1) % 20
    sides = [
        np.concatenate(
            [
                np.stack([k + first, k + after, k + 20 + after], 1),
                np.stack([k + first, k + 20 + after, k + 20 + first], 1),
            ]
        )
        for k in range(0, 780, 20)
    ]
    caps = [np.stack([after, first, np.full(20, 800)], 1), np.stack([780 + first, 780 + after, np.full(20, 801)], 1)]
    vertices = np.concatenate([ring, [[0.0, 0.0, -1.2], [0.0, 0.0, 1.2]]])
    return vertices, np.concatenate([*sides, *caps]).astype(np.int32)


def bent(vertices: NDArray[np.float64], gap: float) -> NDArray[np.float64]:
    """The hose bent into a U whose legs are ``gap`` apart."""
    radius = 0.2 + 0.5 * gap
    z = vertices[:, 2] - vertices[:, 2].mean()
    half = 0.5 * np.pi * radius
    turn = np.clip(z, -half, half) / radius
    beyond = z - np.clip(z, -half, half)
    out = np.empty_like(vertices)
    out[:, 0] = (radius + vertices[:, 0]) * np.cos(turn) - beyond * np.sin(turn)
    out[:, 2] = (radius + vertices[:, 0]) * np.sin(turn) + beyond * np.cos(turn)
    out[:, 1] = vertices[:, 1]
    return out


def crossings(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> SkinCrossings:
    everywhere = np.ones(len(vertices), dtype=bool)
    return SkinCrossings(faces, vertices, EDGE, everywhere, SurfaceSmoother(vertices, faces, EDGE))


def test_legs_of_one_hose_part_by_what_they_overlap() -> None:
    rest, faces = hose()
    skin, shown, apart = crossings(rest, faces), bent(rest, -0.03), bent(rest, 0.03)
    assert len(skin.pairs(shown)) > 20
    found = uncrossed(skin, shown, (apart,), MOST)
    assert len(skin.pairs(found)) == 0
    away = np.linalg.norm(found - shown, axis=1)
    assert 0.015 <= away.max() < 0.03  # each side retreats by half of it, in steps
    outer = np.abs(shown[:, 2]) > 0.33  # sides of the legs that face away from each other, but for the flat ends
    assert (away[outer & (np.abs(rest[:, 2]) < 1.2 - EDGE)] == 0.0).all()


def test_no_farther_than_allowed() -> None:
    rest, faces = hose()
    skin, shown = crossings(rest, faces), bent(rest, -0.2)
    found = uncrossed(skin, shown, (shown,), MOST)
    assert len(skin.pairs(found)) > 0
    assert np.linalg.norm(found - shown, axis=1).max() <= MOST * (1.0 + 1e-9)


def test_a_fold_returns_to_what_has_none() -> None:
    rest, faces = hose()
    skin, shown = crossings(rest, faces), rest.copy()
    one, other = slice(380, 400), slice(400, 420)  # two rings change places, and bulge
    shown[one], shown[other] = rest[other] * [1.05, 1.05, 1.0], rest[one] * [1.05, 1.05, 1.0]
    assert len(skin.pairs(shown)) > 0
    found = uncrossed(skin, shown, (shown, rest), MOST)
    assert len(skin.pairs(found)) == 0
    far = np.abs(rest[:, 2]) > 2.0 * EDGE
    np.testing.assert_array_equal(found[far], shown[far])


def test_what_crosses_at_rest_or_has_no_flesh_stays() -> None:
    rest, faces = hose()
    overlapped = bent(rest, -0.03)
    always = SkinCrossings(faces, overlapped, EDGE, np.ones(len(rest), dtype=bool), SurfaceSmoother(rest, faces, EDGE))
    assert len(always.pairs(overlapped)) == 0
    bare = SkinCrossings(faces, rest, EDGE, np.zeros(len(rest), dtype=bool), SurfaceSmoother(rest, faces, EDGE))
    assert uncrossed(bare, overlapped, (rest,), MOST) is overlapped


@pytest.mark.slow
@pytest.mark.parametrize(
    ("joint", "degrees", "segments", "element"),
    [("left.elbow", 120, "left.upper_arm left.forearm", 0.014), ("left.knee", 80, "left.thigh left.shin", 0.02)],
)
def test_a_crease_has_no_overlap(joint: str, degrees: float, segments: str, element: float, tmp_path: Path) -> None:
    """Flesh that bends by its bones alone: the skin of both sides of the crease crosses nowhere (R138)."""
    from warpjld.script import Interpreter, Scene
    from warpjld.script.contact import run_contact

    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(
        f"BODY BUILTIN\nFRAMES 0 12\nJOINT {joint} FLEXION AT 0 0\nJOINT {joint} FLEXION AT 12 {degrees}\n"
        f"FLESH BODY {segments} ELEMENT {element} STIFFENING 1 FLEXION\nPRESS 0 12\n"
    )
    found = run_contact(scene, tmp_path)
    assert found.verdict.status == "CONVERGED"
    shown = found.surfaces.carried(12.0)["BODY"]
    assert shown.crossings is not None
    parted = found.surfaces.separated(12.0)
    assert len(shown.crossings.pairs(parted.vertices["BODY"])) == 0
    assert parted.moved["BODY"] <= found.surfaces.most("BODY")


@pytest.mark.slow
def test_a_knee_bends_to_120_degrees_where_its_flesh_stiffens(tmp_path: Path) -> None:
    from warpjld.script import Interpreter, Scene
    from warpjld.script.contact import run_contact

    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(
        "BODY BUILTIN\nFRAMES 0 12\nJOINT left.knee FLEXION AT 0 0\nJOINT left.knee FLEXION AT 12 120\n"
        "FLESH BODY left.thigh left.shin ELEMENT 0.02 FLEXION\nPRESS 0 12\n"
    )
    found = run_contact(scene, tmp_path)
    assert found.verdict.status == "CONVERGED"
    assert found.frames[-1] == 12.0
    mesh = found.model.body.mesh
    for moved in found.displacement:  # no element turns inside out at its middle
        shape = (mesh.nodes + moved)[mesh.elements]
        edges = [shape[:, high].mean(axis=1) - shape[:, low].mean(axis=1) for low, high in SIDES]
        assert (np.einsum("ei,ei->e", edges[0], np.cross(edges[1], edges[2])) > 0.0).all()


def test_flesh_that_bends_and_hardly_stiffens_is_named() -> None:
    bends, presses = (FleshMaterial(flexion=bends, stiffening=1.0) for bends in (True, False))
    assert "flesh of BODY has STIFFENING 1" in soft_crease(ContactSpecification(flesh={"BODY": bends}))
    assert soft_crease(ContactSpecification(flesh={"BODY": presses})) == ""
    assert soft_crease(ContactSpecification(flesh={"BODY": FleshMaterial(flexion=True)})) == ""
