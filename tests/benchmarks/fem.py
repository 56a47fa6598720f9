"""The finite-element solver beside pypardiso, pyamg and SciPy, on the same matrix, in one run.

    PYTHONPATH=.:kernels python tests/benchmarks/fem.py [cube45 cube148 cube547 finger57 finger157] [--repeat 3]

Peers get K11 as a SciPy matrix; assembly is not counted for anyone. Every solver goes to a true relative residual of
1e-8 (checked). Times are wall seconds, the least of the repetitions, setup and solve apart. Memory is the peak of the
process after our own solve, mesh and assembly included, before any peer has run.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from warpjld.fem import Body, HexMesh, LinearElastic, box_hexes, finger_hexes, prescribe
from warpjld.fem.load.prescribed import rigid_modes
from warpjld.fem.solver.linear import LinearSolver
from warpjld.runtime.quiet import silence_warp

CASES: dict[str, tuple[Callable[[], HexMesh], float, str]] = {
    "cube45": (lambda: box_hexes(counts=(24, 24, 24)), 0.3, "x-"),
    "cube148": (lambda: box_hexes(counts=(36, 36, 36)), 0.3, "x-"),
    "cube547": (lambda: box_hexes(counts=(56, 56, 56)), 0.3, "x-"),
    "finger57": (lambda: finger_hexes(n=16, layers=7, along=30), 0.49, "bone"),
    "finger157": (lambda: finger_hexes(n=20, layers=12, along=40), 0.49, "bone"),
}
TOO_LARGE_FOR_PARDISO = 300_000


def main() -> None:
    """Print the table."""
    silence_warp()
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", default=["cube45", "finger57"], help=", ".join(CASES))
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    if len(arguments.cases) > 1:  # each in a process of its own, for the memory's sake
        for name in arguments.cases:
            subprocess.run([sys.executable, __file__, name, "--repeat", str(arguments.repeat)], check=True)
        return
    heads = ("setup", "solve", "total")
    print(
        f"{'case':10} {'DOF':>7} {'solver':22}",
        *(f"{h:>7}" for h in heads),
        f"{'its':>5} {'residual':>9} {'/ ours':>8}",
    )
    for name in arguments.cases:
        make, poisson, fixed = CASES[name]
        mesh = make()
        started = time.perf_counter()
        body = Body(mesh, LinearElastic(1.0, poisson))
        pattern = time.perf_counter() - started
        started = time.perf_counter()
        stiffness = body.at().stiffness
        assembly = time.perf_counter() - started
        assert stiffness is not None
        held = prescribe(mesh, fixed, x=0.0, y=0.0, z=0.0)
        free = held.free(body.degrees)
        right = np.zeros(mesh.nodes.shape)
        right[:, 1] = -1.0 / len(mesh.nodes)
        right = right.ravel() * free

        def ours() -> tuple[float, float, np.ndarray, int]:
            first = time.perf_counter()
            solver = LinearSolver(stiffness, free, mesh, method="multigrid", poisson=poisson)  # noqa: B023
            second = time.perf_counter()
            found = solver.solve(right)  # noqa: B023
            return second - first, time.perf_counter() - second, found.x[free], found.iterations  # noqa: B023

        ours()  # compiles
        results = {"warpjld multigrid": best(ours, arguments.repeat)}
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        matrix = stiffness.to_scipy().tocsr()[free][:, free].tocsr()
        b = right[free]
        modes = rigid_modes(mesh.nodes)[free]
        if int(free.sum()) < TOO_LARGE_FOR_PARDISO:
            results["pypardiso"] = best(lambda: pardiso(matrix, b), 1)  # noqa: B023
        results["pyamg SA, rigid modes"] = best(lambda: pyamg_sa(matrix, b, modes), 1)  # noqa: B023
        results["SciPy CG, Jacobi"] = best(lambda: scipy_cg(matrix, b), 1)  # noqa: B023
        mine = sum(results["warpjld multigrid"][:2])
        for solver, (setup, solve, x, iterations) in results.items():
            residual = float(np.linalg.norm(matrix @ x - b) / np.linalg.norm(b))
            total = setup + solve
            print(
                f"{name:10} {int(free.sum()):7} {solver:22} {setup:7.3f} {solve:7.3f} {total:7.3f} {iterations:5} "
                f"{residual:9.1e} {total / mine:7.1f}x",
                flush=True,
            )
        print(f"{'':10} pattern {pattern:.3f} s, assembly {assembly:.3f} s, peak {peak:.0f} MiB", flush=True)


def best(run: Callable[[], tuple[float, float, Any, int]], times: int) -> tuple[float, float, Any, int]:
    """The repetition that took the least."""
    return min((run() for _ in range(times)), key=lambda r: r[0] + r[1])


def pardiso(matrix: Any, b: np.ndarray) -> tuple[float, float, np.ndarray, int]:
    """Sparse Cholesky of MKL (upper triangle, symmetric positive definite)."""
    from pypardiso import PyPardisoSolver
    from scipy.sparse import csr_matrix, triu

    upper = csr_matrix(triu(matrix, format="csr"))
    solver = PyPardisoSolver(mtype=2)
    started = time.perf_counter()
    solver.factorize(upper)
    middle = time.perf_counter()
    x = solver.solve(upper, b)
    end = time.perf_counter()
    solver.free_memory(everything=True)
    return middle - started, end - middle, x, 0


def pyamg_sa(matrix: Any, b: np.ndarray, modes: np.ndarray) -> tuple[float, float, np.ndarray, int]:
    """Smoothed aggregation with rigid-body modes, accelerated by CG."""
    import pyamg
    from scipy.sparse import bsr_matrix

    blocks = bsr_matrix(matrix, blocksize=(3, 3))
    started = time.perf_counter()
    levels = pyamg.smoothed_aggregation_solver(blocks, B=modes, max_coarse=500)
    middle = time.perf_counter()
    residuals: list[float] = []
    x = levels.solve(b, tol=1e-8, accel="cg", residuals=residuals, maxiter=500)
    return middle - started, time.perf_counter() - middle, x, len(residuals) - 1


def scipy_cg(matrix: Any, b: np.ndarray) -> tuple[float, float, np.ndarray, int]:
    """Conjugate gradients with a diagonal preconditioner."""
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import cg

    inverse = diags_array(1.0 / matrix.diagonal())
    count = [0]
    started = time.perf_counter()
    x, _ = cg(
        matrix, b, rtol=1e-8, atol=0.0, M=inverse, maxiter=20_000, callback=lambda _: count.__setitem__(0, count[0] + 1)
    )
    return 0.0, time.perf_counter() - started, x, count[0]


if __name__ == "__main__":
    main()
