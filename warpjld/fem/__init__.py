"""Finite elements: hexahedral meshes, materials, loads, and solvers that say how they ended (B §3, R91–R107)."""

from warpjld.fem.ball import ball, cylinder, finger
from warpjld.fem.body import Body
from warpjld.fem.box import box
from warpjld.fem.conjugate import Status
from warpjld.fem.hexmesh import HexMesh, merge
from warpjld.fem.loads import Centrifugal, Loads
from warpjld.fem.materials import Fung, LinearElastic, Material, MaterialWarning, MooneyRivlin, NeoHooke
from warpjld.fem.prescribed import FreeBodyError, Prescribed, prescribe
from warpjld.fem.solution import Instant, Solution, SolveError
from warpjld.fem.static import solve

__all__ = [
    "Body",
    "Centrifugal",
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
    "Status",
    "ball",
    "box",
    "cylinder",
    "finger",
    "merge",
    "prescribe",
    "solve",
]
