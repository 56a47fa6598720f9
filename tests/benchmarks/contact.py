"""A linear ball between two plates: our contact beside CalculiX's noted time and a script on scikit-fem and SciPy.

    PYTHONPATH=.:kernels python tests/benchmarks/contact.py [--elements 8] [--increments 10] [--repeat 3] [--no-peer]

An octant of a ball of radius 1, E = 1, ν = 0.3, no friction, 2048 elements at the default; the plates approach by 0.2
each in ten increments. CalculiX 2.20 took 9.6 s for the same (C3D8, face-to-face penalty, whole job, two cores). The
peer assembles K once with scikit-fem (full integration, as CalculiX) and finds the active set by a penalty of 1e4
times the nodes' stiffness and one sparse direct solve (SuperLU) a change. Times are wall seconds, the least of the
repetitions, from mesh to result; memory is the peak of the process after our own runs, before the peer.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import Body, HexMesh, LinearElastic, Prescribed, ball_hexes, prescribe
from warpjld.fem.contact import Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.runtime.quiet import silence_warp

TRAVEL, POISSON = 0.2, 0.3
CALCULIX, REFERENCE = 9.6, (0.0544, 0.1706)


def main() -> None:
    """Print the table."""
    silence_warp()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", type=int, default=8, help="along an edge of each patch")
    parser.add_argument("--increments", type=int, default=10)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--no-peer", action="store_true")
    arguments = parser.parse_args()
    times = (np.arange(arguments.increments) + 1) / arguments.increments
    mesh = ball_hexes(1.0, n=arguments.elements, octant=True)
    print(f"{len(mesh.elements)} elements, {3 * len(mesh.nodes)} degrees of freedom, {len(times)} increments")
    print(f"{'':26}{'seconds':>8}{'solves':>8}{'iterations':>12}{'force at half':>15}{'at the end':>12}")
    ours(mesh, times)  # compiles
    line("warpjld", *best(lambda: ours(ball_hexes(1.0, n=arguments.elements, octant=True), times), arguments.repeat))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    if not arguments.no_peer:
        line("scikit-fem + SciPy, penalty", *best(lambda: peer(mesh, times), 1))
    if arguments.elements == 8 and arguments.increments == 10:
        print(f"{'CalculiX 2.20 (noted)':26}{CALCULIX:8.2f}{'':20}{REFERENCE[0]:15.4f}{REFERENCE[1]:12.4f}")
    print(f"peak {peak:.0f} MiB")


def best(
    run: Callable[[], tuple[NDArray[np.float64], int, int]], times: int
) -> tuple[float, NDArray[np.float64], int, int]:
    """The repetition that took the least."""
    found = []
    for _ in range(times):
        started = time.perf_counter()
        result = run()
        found.append((time.perf_counter() - started, *result))
    return min(found, key=lambda row: row[0])


def line(name: str, seconds: float, forces: NDArray[np.float64], solves: int, iterations: int) -> None:
    """One row of the table."""
    half = forces[len(forces) // 2 - 1]
    print(f"{name:26}{seconds:8.2f}{solves:8}{iterations:12}{half:15.4f}{forces[-1]:12.4f}", flush=True)


def symmetric(mesh: HexMesh) -> Prescribed:
    """The octant's planes of symmetry."""
    return prescribe(mesh, "x0", x=0.0) + prescribe(mesh, "y0", y=0.0) + prescribe(mesh, "z0", z=0.0)


def ours(mesh: HexMesh, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], int, int]:
    """Whole force at each increment, coupled solves, and their iterations."""
    plate = Plane((0, 0, 1), (0, 0, -1), motion=lambda t: ((0.0, 0.0, -TRAVEL * t), (0.0, 0.0, 0.0, 1.0)))
    body = Body(mesh, LinearElastic(1.0, POISSON))
    found = press(body, symmetric(mesh), [Pair("outer", plate)], times=times.tolist())
    forces = np.array([4.0 * instant.touches[0].normal_force for instant in found.instants])
    return forces, sum(i.solves for i in found.instants), sum(i.iterations for i in found.instants)


def peer(mesh: HexMesh, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], int, int]:
    """The same by scikit-fem's stiffness and SciPy's direct solver."""
    import skfem
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import splu
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    bits = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    corners = np.round(skfem.MeshHex().p.T)
    order = [int(np.flatnonzero((bits == corner).all(axis=1))[0]) for corner in corners]
    theirs = skfem.MeshHex(*(np.ascontiguousarray(a.T) for a in (mesh.nodes, mesh.elements[:, order])))
    basis = skfem.Basis(theirs, skfem.ElementVector(skfem.ElementHex1()))
    numbers = basis.nodal_dofs.T.ravel()
    stiffness = linear_elasticity(*lame_parameters(1.0, POISSON)).assemble(basis).tocsr()[numbers][:, numbers]
    free = symmetric(mesh).free(3 * len(mesh.nodes))
    down = np.zeros(len(free), dtype=bool)
    down[3 * mesh.node_set("outer") + 2] = True
    down &= free
    height = mesh.nodes[:, 2].repeat(3)
    penalty = 1e4 * stiffness.diagonal()
    forces, solves = [], 0
    active = np.zeros(len(free), dtype=bool)
    u = np.zeros(len(free))
    for t in times:
        gap = 1.0 - TRAVEL * t - height
        active |= down & (gap - u < 0.0)
        for _ in range(30):
            matrix = stiffness + diags_array(np.where(active, penalty, 0.0))
            right = np.where(active, penalty * gap, 0.0)
            u = np.zeros(len(free))
            factor = splu(matrix.tocsr()[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0)
            u[free] = factor.solve(right[free])
            solves += 1
            press_on = penalty * (u - gap)
            now = down & (u > gap)
            if np.array_equal(now, active):
                break
            active = now
        forces.append(4.0 * float(press_on[active].sum()))
    return np.array(forces), solves, 0


if __name__ == "__main__":
    main()
