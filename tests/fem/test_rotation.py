"""Bodies of a linear law that turn are warned of; those of a law for large strain need no warning."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from warpjld.fem import Body, LinearElastic, Material, MaterialWarning, NeoHooke, box_hexes, prescribe, solve


def tilted(law: Material, degrees: float) -> float:
    """A block whose bottom is turned by an angle about y: its volume afterwards."""
    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    bottom = mesh.node_set("z-")
    held = prescribe(mesh, bottom, displacement=mesh.nodes[bottom] @ (turn - np.eye(3)).T)
    moved = mesh.moved(solve(Body(mesh, law), held).displacement)
    from warpjld.fem.load.loads import volumes

    return float(volumes(moved).sum())


def test_a_block_of_a_linear_law_tilted_by_30_degrees_is_warned_of() -> None:
    with pytest.warns(MaterialWarning, match="'body' rotates by about (2[5-9]|30)°"):
        assert tilted(LinearElastic(1e6, 0.3), 30.0) != pytest.approx(1.0, rel=0.05)


def test_nothing_is_said_of_small_rotations_nor_of_large_strain_laws() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tilted(LinearElastic(1e6, 0.3), 5.0) == pytest.approx(1.0, rel=0.02)
        assert tilted(NeoHooke(1e6, 0.3), 30.0) == pytest.approx(1.0, rel=1e-4)
