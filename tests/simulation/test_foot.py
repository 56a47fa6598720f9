"""Points that support an object until it is lifted."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem import box_hexes
from warpjld.fem.load.prescribed import rigid_modes
from warpjld.simulation.bodies.object_body import _foot


def lattice(about: str, degrees: float) -> NDArray[np.float64]:
    """Nodes of a block of 60 × 40 × 30 mm, turned."""
    nodes = box_hexes((0.06, 0.04, 0.03), (6, 4, 3)).nodes
    return np.asarray(Rotation.from_euler(about, degrees, degrees=True).apply(nodes))


@pytest.mark.parametrize(("about", "degrees"), [("x", 0.0), ("x", 45.0), ("xy", [40.0, 30.0])])
def test_the_foot_of_an_object_holds_it(about: str, degrees: float) -> None:
    """A block on a side, on an edge and on a corner: its lowest points alone let it turn about the latter two."""
    nodes = lattice(about, degrees)
    chosen = _foot(nodes, 2, "lower").choose(nodes, nodes)
    held = rigid_modes(nodes).reshape(-1, 3, 6)[chosen].reshape(-1, 6)
    assert np.linalg.matrix_rank(held, tol=0.05) == 6
    assert nodes[chosen, 2].max() - nodes[:, 2].min() < 0.5 * np.ptp(nodes[:, 2])


def test_a_side_is_a_foot_by_itself() -> None:
    nodes = lattice("x", 0.0)
    assert len(_foot(nodes, 2, "lower").choose(nodes, nodes)) == 7 * 5
