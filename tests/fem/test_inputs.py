"""Wrong input, named; free bodies refused or held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import (
    Body,
    FreeBodyError,
    LinearElastic,
    Loads,
    MaterialWarning,
    NeoHooke,
    SolveError,
    SolveStatus,
    box_hexes,
    merge,
    prescribe,
    solve,
)

LAW = LinearElastic(1.0, 0.3)


def test_negative_jacobian() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    elements = mesh.elements.copy()
    elements[5] = elements[5, [4, 5, 6, 7, 0, 1, 2, 3]]
    with pytest.raises(InputError, match="negative Jacobian, the worst is element 5"):
        Body(replace(mesh, elements=elements), LAW)


@pytest.mark.parametrize("young", [0.0, -1.0, np.nan, np.inf])
def test_modulus(young: float) -> None:
    with pytest.raises(InputError, match="young: want a modulus above 0"):
        LinearElastic(young, 0.3)


@pytest.mark.parametrize("poisson", [0.5, 0.6, -1.0])
def test_poisson(poisson: float) -> None:
    with pytest.raises(InputError, match="poisson: want"):
        NeoHooke(1.0, poisson)


def test_poisson_near_a_half_warns() -> None:
    with pytest.warns(MaterialWarning, match="several times the iterations"):
        NeoHooke(1.0, 0.495)


def test_unknown_region_suggests() -> None:
    with pytest.raises(InputError, match="did you mean body"):
        Body(box_hexes(counts=(1, 1, 1)), {"bodi": LAW})


def test_region_without_material() -> None:
    mesh = merge(box_hexes(name="left"), box_hexes(origin=(2, 0, 0), name="right"))
    with pytest.raises(InputError, match="region 'right' has no material"):
        Body(mesh, {"left": LAW})


def test_load_on_missing_face() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    held = prescribe(mesh, "x-", x=0, y=0, z=0)
    with pytest.raises(InputError, match=r"pressure on a missing face set: no face set 'top'"):
        solve(Body(mesh, LAW), held, Loads(pressure={"top": 1.0}))


def test_two_displacements_for_one_node() -> None:
    mesh = box_hexes(counts=(1, 1, 1))
    with pytest.raises(InputError, match="given two displacements along x"):
        prescribe(mesh, "x-", x=0) + prescribe(mesh, "y-", x=0.1)


@pytest.mark.parametrize(
    ("held", "free"),
    [({}, "translation along x"), ({"x": 0.0}, "translation along y"), ({"x": 0.0, "y": 0.0}, "translation along z")],
)
def test_unconstrained_body(held: dict[str, float], free: str) -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    known = prescribe(mesh, "x-", **held) if held else prescribe(mesh, [0], x=0.0)
    with pytest.raises(FreeBodyError, match=free if held else "not constrained"):
        solve(Body(mesh, LAW), known)


def test_one_of_two_bodies_free() -> None:
    mesh = merge(box_hexes(name="left"), box_hexes(origin=(2, 0, 0), name="right"))
    with pytest.raises(FreeBodyError, match=r"\(right\) is not constrained: free are translation along x"):
        solve(Body(mesh, LAW), prescribe(mesh, "left", x=0, y=0, z=0))


def test_hinge_is_free_to_turn() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    edge = np.flatnonzero((mesh.nodes[:, 0] == 0) & (mesh.nodes[:, 1] == 0))
    with pytest.raises(FreeBodyError, match="rotation about"):
        solve(Body(mesh, LAW), prescribe(mesh, edge, x=0, y=0, z=0))


def test_free_body_held_under_balanced_loads_has_no_reactions() -> None:
    mesh = box_hexes(counts=(4, 4, 4))
    loads = Loads(traction={"x-": (-1, 0, 0), "x+": (1, 0, 0)})
    known = prescribe(mesh, "z-", z=0)
    found = solve(Body(mesh, LAW), known, loads, free="hold")
    assert len(found.held) == 3
    assert np.abs(found.reactions).max() < 1e-7
    stretch = np.ptp((mesh.nodes + found.displacement)[:, 0])
    assert stretch == pytest.approx(2.0, rel=1e-6)


@pytest.mark.parametrize("known", [{"x": 0.0}, {"x": 0.0, "y": 0.0}, {"x": 0.0, "y": 0.0, "z": 0.0}])
def test_one_two_or_three_degrees_of_freedom(known: dict[str, float]) -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    held = prescribe(mesh, "x-", **known)
    assert len(held.degrees) == 9 * len(known)
    found = solve(Body(mesh, LAW), held, Loads(traction={"x+": (1, 0, 0)}), free="hold")
    for axis in range(3):
        moved = np.abs(found.displacement[mesh.node_set("x-"), axis]).max()
        assert (moved < 1e-15) == ("xyz"[axis] in known)


def test_infinite_load_is_named() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    with pytest.raises(InputError, match="gravity: want finite numbers"):
        solve(Body(mesh, LAW), prescribe(mesh, "x-", x=0, y=0, z=0), Loads(gravity=(0, np.nan, 0)))


def test_too_few_iterations_are_a_status() -> None:
    from warpjld.fem.solver.linear import LinearSolver

    mesh = box_hexes(counts=(8, 8, 8))
    body = Body(mesh, LAW)
    known = prescribe(mesh, "x-", x=0, y=0, z=0)
    stiffness = body.at().stiffness
    assert stiffness is not None
    solver = LinearSolver(stiffness, known.free(body.degrees), mesh, method="jacobi")
    right = np.ones(body.degrees)
    found = solver.solve(right, iterations=5)
    assert found.status is SolveStatus.MAX_ITERATIONS
    assert found.residual > 1e-8
    right[-1] = np.nan
    assert solver.solve(right).status is SolveStatus.NOT_FINITE


def test_indefinite_matrix_is_named() -> None:
    from warpjld.fem.solver.krylov import conjugate_gradients

    matrix = np.diag(np.linspace(-1.0, 5.0, 40))
    found = conjugate_gradients(lambda x: matrix @ x, lambda r: r, np.ones(40))
    assert found.status is SolveStatus.INDEFINITE


def test_stagnation_is_named() -> None:
    from warpjld.fem.solver.krylov import conjugate_gradients

    matrix = np.diag(np.logspace(0, 14, 60))
    found = conjugate_gradients(
        lambda x: matrix @ x, lambda r: r, np.ones(60), tolerance=1e-30, iterations=100_000, patience=50
    )
    assert found.status is SolveStatus.STAGNATED
    assert found.residual > 0


def test_failure_raises_with_what_was_reached() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    held = prescribe(mesh, "x-", x=0, y=0, z=0)
    with pytest.raises(SolveError, match="no equilibrium") as caught:
        solve(Body(mesh, NeoHooke(1.0, 0.3)), held + prescribe(mesh, "x+", x=-1.5, y=0, z=0))
    assert not caught.value.solution.converged
