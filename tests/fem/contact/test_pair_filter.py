"""Two parts of one surface that lie side by side, or one in the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem import HexMesh, box_hexes, merge
from warpjld.fem.contact import Exclusion, Pair
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints

SIDE, THICK = 0.02, 0.006


def blocks(shift: tuple[float, float, float]) -> tuple[HexMesh, NDArray[np.int32], Exclusion]:
    """Two plates, the second one shifted, as one body whose skin meets itself; plates 6 mm thick, edges of 4 mm."""
    plate = box_hexes((SIDE, SIDE, THICK), (5, 5, 2))
    other = replace(plate, nodes=plate.nodes + np.array(shift), region_names=("other",), faces={}, node_sets={})
    mesh = merge(replace(plate, faces={}, node_sets={}), other)
    faces = mesh.boundary()
    label = (faces[:, 0] >= len(plate.elements)).astype(np.int32)
    return mesh, faces, Exclusion(label, label, np.eye(2, dtype=bool))


def points(shift: tuple[float, float, float]) -> ContactPoints:
    mesh, faces, exclusion = blocks(shift)
    interface = Interface(mesh, Pair(faces, faces, exclusion=exclusion), 1)
    assert interface.reach > THICK
    return interface.points(mesh.nodes, 0.0, 0.0)


def test_plates_side_by_side_do_not_overlap_by_their_thickness() -> None:
    """Their sides overlap by 0.1 mm; there the top of one is before the bottom of the other, 6 mm below."""
    found = points((SIDE - 1e-4, 0.001, 0.0))
    assert found.gap.min() == pytest.approx(-1e-4, abs=2e-5)
    touching = found.gap < 0.0
    np.testing.assert_allclose(found.normal[touching, 0], 1.0, atol=0.5)


@pytest.mark.parametrize("deep", [0.0005, 0.0015, 0.0025])
def test_plates_in_one_another_do(deep: float) -> None:
    found = points((0.003, 0.002, THICK - deep))
    middle = found.area > 0.9 * (SIDE / 5) ** 2
    assert middle.sum() >= 9
    np.testing.assert_allclose(found.gap[middle], -deep, rtol=0.02)
