"""A study: a deformable body and a sequence of load steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from warpjld.fem.arrays import Ints
from warpjld.fem.body import Body
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed, prescribe
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.solver.solution import Instant, Solution
from warpjld.fem.solver.static import solve

__all__ = ["FemStudy", "Step", "StudyInstant", "Support"]


@dataclass(frozen=True)
class Support:
    """Prescribed displacements of a node set, or planes that it is moved to.

    Attributes:
        where: Node set or face set.
        moves: Displacement along some axes [m], by axis index.
        onto: Target coordinate along some axes [m], by axis index.
    """

    where: str
    moves: Mapping[int, float] = field(default_factory=dict)
    onto: Mapping[int, float] = field(default_factory=dict)

    def on(self, mesh: HexMesh) -> Prescribed:
        """The prescribed displacements of a mesh's nodes.

        Raises:
            InputError: Unknown set.
        """
        nodes = mesh.node_set(self.where)
        target = np.full((len(nodes), 3), np.nan)
        for axis, value in self.onto.items():
            target[:, axis] = value - mesh.nodes[nodes, axis]
        for axis, value in self.moves.items():
            target[:, axis] = value
        return prescribe(mesh, nodes, displacement=target)


@dataclass(frozen=True)
class Step:
    """Loads and prescribed displacements that are applied together.

    Attributes:
        name: Name in tables and pictures.
        loads: Loads at the end of the step.
        prescribed: Displacements at the end of the step.
        instants: Number of load instants.
        free: Treatment of bodies with free rigid motions: ``refuse`` or ``hold``.
    """

    name: str
    loads: Loads
    prescribed: tuple[Support, ...]
    instants: int
    free: str


@dataclass(frozen=True, eq=False)
class StudyInstant:
    """An equilibrium of a study.

    Attributes:
        step: The step it belongs to.
        time: Number of steps completed, including the share of this one.
        instant: The equilibrium.
        solution: Solution of the whole step.
        held: Prescribed degrees of freedom, by the set they were given for.
    """

    step: Step
    time: float
    instant: Instant
    solution: Solution
    held: dict[str, Ints]


@dataclass(frozen=True, eq=False)
class FemStudy:
    """A body and its load steps (see ``load_study``).

    Attributes:
        title: Title for the user.
        body: Mesh and materials.
        steps: Load steps in order.
        method: Linear solver.
        precision: Its precision.
        notes: Information on meshing, for the user.
    """

    title: str
    body: Body
    steps: tuple[Step, ...]
    method: str = "auto"
    precision: str = "float64"
    notes: tuple[str, ...] = ()

    def run(self, progress: Callable[[str], None] | None = None) -> Iterator[StudyInstant]:
        """Equilibria in order, step by step; ends after a step that does not converge."""
        after: Solution | None = None
        for number, step in enumerate(self.steps):
            known = Prescribed(np.empty(0, np.int64), np.empty(0))
            held: dict[str, Ints] = {}
            for support in step.prescribed:
                part = support.on(self.body.mesh)
                known = known + part
                held[support.where] = np.union1d(held.get(support.where, []), part.degrees).astype(np.int64)
            solution = solve(
                self.body,
                known,
                step.loads,
                after=after,
                instants=step.instants,
                free=step.free,
                method=self.method,
                precision=self.precision,
                check=False,
                progress=None if progress is None else lambda text, name=step.name: progress(f"{name}: {text}"),  # type: ignore[misc]
            )
            if len(solution.held):
                held["held because free"] = solution.held
            for instant in solution.instants:
                yield StudyInstant(step, number + instant.factor, instant, solution, held)
            if not solution.converged:
                return
            after = solution
