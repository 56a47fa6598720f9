"""A discretised body: mesh and materials, assembled to stiffness and internal forces at a displacement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Array
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.assembly.pattern import Pattern, batches_of, pattern_of
from warpjld.fem.launch import grouped, on_rows, threads_of
from warpjld.fem.material.materials import NEO_HOOKE, Material, laws_of
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["Body", "Tangent"]


@dataclass(frozen=True, eq=False)
class Tangent:
    """Tangent stiffness and internal forces at a displacement.

    Attributes:
        stiffness: Tangent stiffness K, or None if only forces were requested.
        forces: Internal forces, including initial stresses [N], shape (3N,).
        lowest: Smallest Jacobian determinant of each element [m³/8], shape (E,); ≤ 0 for inverted elements.
        pressures: κ (θ − 1) of each element [Pa], shape (E,); extrapolated to first order to the end of an increment
            if one was given.
    """

    stiffness: BlockMatrix | None
    forces: Array
    lowest: Array
    pressures: Array


class Body:
    """One or several meshed bodies with their material laws; the sparsity pattern is reused (B eqs. 2–5, R101–R103).

    Args:
        mesh: The mesh, without inverted elements.
        materials: One law, or one per region name.
        initial_stress: Stress at rest [Pa], xx yy zz xy yz zx, shape (6,) or (E, 6) (R98). Second Piola–Kirchhoff for
            large-strain laws.
        threads: Threads for assembly and products; all by default.

    Raises:
        InputError: Inverted elements, a region without a law, or wrong shapes.
    """

    def __init__(
        self,
        mesh: HexMesh,
        materials: Material | Mapping[str, Material],
        *,
        initial_stress: ArrayLike | None = None,
        threads: int | None = None,
    ) -> None:
        self.mesh = mesh
        self.kinds, self.constants, self.density = laws_of(mesh, materials)
        self.threads = threads_of(threads)
        stress = np.zeros(6) if initial_stress is None else np.asarray(initial_stress, dtype=np.float64)
        if stress.shape not in {(6,), (len(mesh.elements), 6)}:
            raise InputError(f"initial_stress: want shape (6,) or ({len(mesh.elements)}, 6), got {stress.shape}")
        self.initial_stress = np.ascontiguousarray(np.broadcast_to(stress, (len(mesh.elements), 6)))
        self.pattern: Pattern = pattern_of(mesh, threads=self.threads)
        parts = self.threads if len(mesh.elements) >= 200 else 1
        self._batches = batches_of(self.pattern, self.kinds, parts)
        self._elements = np.ascontiguousarray(mesh.elements)
        self._nodes = np.ascontiguousarray(mesh.nodes).reshape(-1)
        self._check_jacobians()

    def __repr__(self) -> str:
        return f"Body({len(self.mesh.elements)} elements, {self.degrees} degrees of freedom)"

    @property
    def large_strain(self) -> bool:
        """Whether any law is for large strain, which needs Newton's method."""
        return bool((self.kinds >= NEO_HOOKE).any())

    @property
    def poisson(self) -> float:
        """Largest small-strain Poisson's ratio of all elements."""
        bulk, shear = self.constants[:, 2], 2.0 * self.constants[:, :2].sum(axis=1)
        return float(((3 * bulk - 2 * shear) / (6 * bulk + 2 * shear)).max())

    @property
    def degrees(self) -> int:
        """Degrees of freedom, 3N."""
        return 3 * len(self.mesh.nodes)

    def at(
        self,
        displacement: Array | None = None,
        *,
        stiffness: bool = True,
        pressures: Array | None = None,
        increment: Array | None = None,
        reuse: Tangent | None = None,
    ) -> Tangent:
        """Stiffness and internal forces at a displacement.

        Args:
            displacement: [m], shape (3N,) or (N, 3); at rest by default.
            stiffness: Whether to assemble K, or forces only.
            pressures: Pressure of each element to use in K, shape (E,); that at the displacement by default.
            increment: Displacement about to be added [m], shape (3N,), for extrapolated ``pressures`` of the result.
            reuse: A result that is no longer needed, whose matrix is overwritten.

        Raises:
            InputError: Wrong shapes.
        """
        from warpjld_kernels import fem_element

        u = np.zeros(self.degrees) if displacement is None else np.ascontiguousarray(displacement, np.float64).ravel()
        if u.shape != (self.degrees,):
            raise InputError(f"displacement: want {self.degrees} values, got {u.size}")
        if pressures is None:
            pressures = np.zeros(len(self._elements))
            if stiffness and displacement is not None and self.large_strain:
                pressures = self.at(u, stiffness=False).pressures
        step = np.zeros(self.degrees) if increment is None else np.ascontiguousarray(increment, np.float64).ravel()
        if stiffness and reuse is not None and reuse.stiffness is not None:
            values = reuse.stiffness.values
            values.fill(0.0)
        else:
            values = np.zeros((max(len(self.pattern.columns) if stiffness else 0, 1), 3, 3))
        forces, lowest, found = np.zeros(self.degrees), np.empty(len(pressures)), np.empty(len(pressures))
        batches, model = self._arguments()
        state = grouped(fem_element.State, displacement=u, pressures=pressures, increment=step)
        out = grouped(fem_element.Sums, values=values.reshape(-1), forces=forces, lowest=lowest, pressures=found)
        arguments = [batches, model, state, stiffness, out]
        on_rows(fem_element.assemble, len(self._batches.ranges) - 1, arguments, threads=self.threads, least=2)
        matrix = BlockMatrix(self.pattern.rows, self.pattern.columns, values) if stiffness else None
        return Tangent(matrix, forces, lowest, found)

    def _arguments(self) -> tuple[Any, Any]:
        """Kernel arguments: elements in batches, and the mesh with its laws."""
        from warpjld_kernels import fem_element

        b, model = self._batches, fem_element.Model
        batches: dict[str, Any] = {
            "ranges": b.ranges,
            "first": b.range_batches,
            "elements": b.elements,
            "kinds": b.kinds,
        }
        mesh: dict[str, Any] = {"nodes": self._nodes, "elements": self._elements, "slots": self.pattern.slots}
        return (
            grouped(fem_element.Batches, **batches, counts=b.counts),
            grouped(model, **mesh, laws=self.constants, initial_stress=self.initial_stress),
        )

    def _check_jacobians(self) -> None:
        lowest = self.at(stiffness=False).lowest
        if not (lowest > 0).all():
            worst = int(np.argmin(np.where(np.isfinite(lowest), lowest, -np.inf)))
            count = int((~(lowest > 0)).sum())
            raise InputError(
                f"mesh: {count} of {len(lowest)} elements have a negative Jacobian, the worst is element {worst} "
                f"({lowest[worst]:.3g} m³/8) in region '{self.mesh.region_names[self.mesh.regions[worst]]}': "
                "nodes in the wrong order, or the element is inverted"
            )
