"""What elements of a hand are made of, and whether they are small enough."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.fem import box_hexes
from warpjld.fem.hand import FleshHand, hand_laws
from warpjld.fem.hand.cushion import coarse_note, cushions
from warpjld.fem.hand.regions import shares_of_skin
from warpjld.fem.load.loads import volumes
from warpjld.fem.mesh.envelope import Envelope


@pytest.mark.parametrize("count", [6, 8, 12])
def test_skin_is_as_deep_whatever_the_size_of_elements(count: int) -> None:
    block = trimesh.creation.box((0.012, 0.012, 0.012))
    mesh = box_hexes((0.012, 0.012, 0.012), (count,) * 3, origin=(-0.006,) * 3)
    share = shares_of_skin(mesh, Envelope(block.vertices, block.faces), 1.5e-3)
    assert share.min() == 0.0
    assert share @ volumes(mesh).sum(axis=1) == pytest.approx(0.012**3 - 0.009**3, rel=0.1)


def test_elements_that_skin_fills_in_part_are_partly_as_stiff() -> None:
    laws = hand_laws(("hand.flesh", "hand.skin:3/8", "hand.skin"), flesh=34e3, skin=80e3, poisson=0.45)
    assert laws["hand.flesh"].young == pytest.approx(34e3)
    assert laws["hand.skin:3/8"].young == pytest.approx(34e3 + 46e3 * 3 / 8)
    assert laws["hand.skin:3/8"].poisson == pytest.approx(0.45)
    assert laws["hand.skin:3/8"].stiffening == laws["hand.skin"].stiffening


def test_a_hand_has_skin_over_its_bones(hand: FleshHand) -> None:
    mesh = hand.mesh
    assert {"hand.flesh", "hand.skin", "hand.joint", "hand.bone"} <= set(mesh.region_names)
    bone = mesh.region("hand.bone")
    assert not bone[hand.skin_faces[:, 0]].any()
    assert mesh.scaled_jacobian().min() >= 0.19
    assert hand.flesh.fit.least == mesh.scaled_jacobian().min()
    outer = mesh.regions[hand.skin_faces[:, 0]]
    assert {mesh.region_names[k].partition(":")[0] for k in np.unique(outer)} == {"hand.skin", "hand.joint"}


def test_bones_of_fingers_are_where_they_are_said_to_be(hand: FleshHand) -> None:
    """Nodes between bone and flesh lie within a fifth of an element of the bone's surface, but for a few."""
    away = []
    for segment, nodes, shaft in zip(hand.segments, hand.bone_nodes, hand.flesh.shafts, strict=True):
        if segment.endswith(("proximal", "middle", "distal")):
            bony = np.isin(hand.mesh.elements, nodes).any(axis=1) & ~hand.mesh.region("hand.bone")
            hull = np.intersect1d(nodes, hand.mesh.elements[bony])
            share, off, radius = shaft.around(hand.mesh.nodes[hull])
            side = np.abs(np.linalg.norm(off, axis=1) - radius)
            ends = np.minimum(np.abs(share - shaft.near), np.abs(share - shaft.far)) * shaft.length
            away.append(np.minimum(side, ends) / 0.003)
    assert np.percentile(np.concatenate(away), 80) < 0.3


def test_elements_too_large_for_the_flesh_are_told(hand: FleshHand, coarse: FleshHand) -> None:
    assert coarse_note(cushions(hand), 0.003) is None
    found = {one.segment: one for one in cushions(hand)}
    assert len(found) == 14
    assert found["left.index.distal"].elements == 2
    assert 5e-3 < found["left.index.distal"].depth < 8e-3
    note = coarse_note(cushions(coarse), 0.005)
    assert note is not None
    assert note.startswith("elements of 5 mm are too large for the flesh over the bones")
    assert "index (at most 3." in note
    only = coarse_note(cushions(coarse), 0.005, ["index"])
    assert only is not None
    assert "pinky" in note
    assert "pinky" not in only
    thin = [one for one in cushions(coarse) if not one.enough]
    assert all(one.size < 0.005 for one in thin)
