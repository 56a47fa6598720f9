"""Finite elements: hexahedral meshes, materials, loads, and solvers with an explicit status (B §3, R91–R107).

Examples:
    >>> mesh = wj.fem.box_hexes((0.1, 0.02, 0.02), (10, 2, 2))  # m, elements
    >>> body = wj.fem.Body(mesh, wj.fem.LinearElastic(young=1e6, poisson=0.3, density=1000.0))
    >>> held = wj.fem.prescribe(mesh, "x-", x=0.0, y=0.0, z=0.0)
    >>> found = wj.fem.solve(body, held, wj.fem.Loads(gravity=(0.0, -9.81, 0.0)))
    >>> found.converged, bool(found.displacement[:, 1].min() < -1e-3)  # m
    (True, True)
"""

from warpjld.fem.body import Body
from warpjld.fem.load.inertia import Dynamics
from warpjld.fem.load.loads import Centrifugal, Loads
from warpjld.fem.load.prescribed import FreeBodyError, Prescribed, prescribe
from warpjld.fem.material.materials import Fung, LinearElastic, Material, MaterialWarning, MooneyRivlin, NeoHooke
from warpjld.fem.mesh.generated import ball_hexes, box_hexes, cylinder_hexes, finger_hexes
from warpjld.fem.mesh.hexmesh import HexMesh, merge
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.fem.solver.solution import Instant, Solution, SolveError
from warpjld.fem.solver.static import solve

__all__ = [
    "Body",
    "Centrifugal",
    "Dynamics",
    "FreeBodyError",
    "Fung",
    "HexMesh",
    "Instant",
    "LinearElastic",
    "Loads",
    "Material",
    "MaterialWarning",
    "MooneyRivlin",
    "NeoHooke",
    "Prescribed",
    "Solution",
    "SolveError",
    "SolveStatus",
    "ball_hexes",
    "box_hexes",
    "cylinder_hexes",
    "finger_hexes",
    "merge",
    "prescribe",
    "solve",
]
