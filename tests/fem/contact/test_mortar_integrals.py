"""Mortar integrals' derivatives against differences; pairs of facets do not depend on what was asked before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem import HexMesh, box_hexes, merge
from warpjld.fem.contact import Pair
from warpjld.fem.contact.interface.mortar import Mortar
from warpjld.fem.contact.interface.surface import surface_of


def _blocks(counts: int) -> tuple[HexMesh, Mortar]:
    """Two blocks with uneven faces, one a little inside the other."""
    rng = np.random.default_rng(7)
    one = box_hexes((1.0, 0.3, 1.0), (counts, 1, counts))
    two = box_hexes((1.0, 0.3, 1.0), (counts + 1, 1, counts + 2), origin=(0.03, 0.27, -0.04))
    uneven = [replace(m, nodes=m.nodes + 0.02 * rng.normal(size=m.nodes.shape)) for m in (one, two)]
    sides = [replace(m, faces={name: m.faces[face]}) for m, name, face in zip(uneven, "ab", ("y+", "y-"), strict=True)]
    mesh = merge(*sides)
    slave, master = (surface_of(mesh, name, name) for name in "ab")
    return mesh, Mortar(slave, master, Pair("a", "b"), len(mesh.nodes), 1)


def test_derivatives_are_those_of_the_integrals() -> None:
    mesh, mortar = _blocks(3)
    x, reach, step = mesh.nodes, 0.6, 1e-6
    pairs = mortar.points(x, reach, mortar.slave.normals(x)).facets
    assert pairs is not None
    assert len(pairs) > 20
    found = mortar.derivatives(pairs, x, reach)
    quads = np.concatenate([mortar.slave.quads[pairs[:, 0]], mortar.master.quads[pairs[:, 1]]], axis=1)
    for pair, corners in enumerate(quads):
        for k in range(24):
            ends = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[corners[k // 3], k % 3] += sign * step
                sides = (pairs[pair : pair + 1], mortar.slave.quads, mortar.master.quads)
                ends.append(mortar.integrals(*sides, moved, reach)[0])
            difference = (ends[0] - ends[1]) / (2.0 * step)
            np.testing.assert_allclose(found[pair, k], difference, atol=2e-8)


def test_no_pair_that_counts_is_sorted_out() -> None:
    mesh, mortar = _blocks(5)
    counts = len(mortar.slave.quads), len(mortar.master.quads)
    every = np.stack(np.meshgrid(*(np.arange(n, dtype=np.int32) for n in counts), indexing="ij"), axis=2).reshape(-1, 2)
    rng = np.random.default_rng(5)
    for reach in (0.05, 0.3, 0.6):
        x = mesh.nodes + 0.03 * rng.normal(size=mesh.nodes.shape)
        found = mortar.integrals(every, mortar.slave.quads, mortar.master.quads, x, reach)
        counted = found[:, 32] > 0.0
        assert 0 < counted.sum() < 0.7 * len(every)
        facing = mortar._facing(x, reach)
        assert facing.pairs.tobytes() == every[counted].tobytes()
        assert facing.integrals.tobytes() == found[counted].tobytes()


def test_points_do_not_depend_on_what_was_asked_before() -> None:
    mesh, mortar = _blocks(6)
    rng, reach = np.random.default_rng(3), 0.3
    way = np.zeros_like(mesh.nodes)
    for _ in range(12):  # some steps further than candidates are kept for, some back where it was
        way += rng.uniform(0.0, 0.05) * np.array([1.0, -0.3, 0.4]) * (np.arange(len(way)) > len(way) // 2)[:, None]
        for x in (mesh.nodes + way, mesh.nodes):
            normals = mortar.slave.normals(x)
            found = mortar.points(x, reach, normals)
            fresh = Mortar(mortar.slave, mortar.master, Pair("a", "b"), len(x), 1).points(x, reach, normals)
            assert found.facets is not None
            assert fresh.facets is not None
            assert found.facets.tobytes() == fresh.facets.tobytes()
            assert found.gap.tobytes() == fresh.gap.tobytes()
            assert (found.weights != fresh.weights).nnz == 0


def test_what_is_known_at_the_same_positions_is_not_computed_again() -> None:
    mesh, mortar = _blocks(4)
    x, reach, made = mesh.nodes, 0.6, []
    integrals = mortar.integrals
    mortar.integrals = lambda *given: made.append(len(given[0])) or integrals(*given)  # type: ignore[method-assign]
    normals = mortar.slave.normals(x)
    first = mortar.points(x, reach, normals, facing=True)
    assert mortar.points(x.copy(), reach, normals.copy(), facing=True) is first
    assert first.facets is not None
    some = first.facets[::3]
    known = mortar.integrals_of(some, x, reach)
    assert len(made) == 1
    assert known.tobytes() == integrals(some, mortar.slave.quads, mortar.master.quads, x, reach).tobytes()
    tilted = normals + 0.2 * normals[::-1]
    tilted /= np.linalg.norm(tilted, axis=1)[:, None]
    for by, facing, there in [(tilted, False, x), (normals, False, x), (normals, True, 1.01 * x)]:
        assert not np.allclose(mortar.points(there, reach, by, facing=facing).gap, first.gap, rtol=1e-4)
    elsewhere = 1.02 * x
    again = mortar.integrals_of(some, elsewhere, reach)
    assert again.tobytes() == integrals(some, mortar.slave.quads, mortar.master.quads, elsewhere, reach).tobytes()
