"""Python interface of contact simulation: ``simulate(specification, animation)`` (B §3.3, §3.4, R91–R130).

Example::

    from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
    from warpjld.simulation.simulate import simulate
    from warpjld.simulation.specification import ContactSpecification, FleshMaterial, SolveSpecification

    hand = RecordedActor("hand", rig, angles=angles)  # (F, J, 4) [rad], one row per frame
    plate = RecordedObject("plate", trimesh.creation.box((0.04, 0.006, 0.04)), positions=(0.034, -0.0275, -0.165))
    contact = ContactSpecification(
        flesh={"hand": FleshMaterial(digits=("index",))}, pressing=SolveSpecification(0, 8, every=2)
    )
    found = simulate(contact, RecordedAnimation([hand], [plate]))
    print(found.verdict.text, found.force("hand")[-1])
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import MaterialWarning
from warpjld.fem.contact import ContactWarning
from warpjld.fem.hand.suggestions import DigitSlopes
from warpjld.runtime.threads import one_blas_thread
from warpjld.runtime.warning_texts import warning_texts
from warpjld.simulation.animation import Animation
from warpjld.simulation.bodies.flesh_body import build_flesh_body
from warpjld.simulation.bodies.model import ContactModel, assemble_model
from warpjld.simulation.bodies.object_body import build_object_body
from warpjld.simulation.bodies.skin_obstacle import bystanders
from warpjld.simulation.display.solved_surfaces import surfaces_of_frames, view_of_frames
from warpjld.simulation.display.surfaces import DeformedSurfaces
from warpjld.simulation.display.visible_pressure import VisiblePressure
from warpjld.simulation.free_fall import after_contact, before_contact, let_go
from warpjld.simulation.grip.correct_frames import worst_digits
from warpjld.simulation.grip.found import FoundGrip
from warpjld.simulation.report.parted import parted_notes
from warpjld.simulation.report.table import ContactRow, ContactTable
from warpjld.simulation.report.tactile import Tactile, tactile_readings
from warpjld.simulation.report.verdict import ContactVerdict, verdict_of
from warpjld.simulation.report.visible_overlap import remaining_overlaps, visible_overlap_notes
from warpjld.simulation.sensitivity.gradient import Gradient, gradient_at
from warpjld.simulation.sensitivity.joint_slopes import joint_slopes
from warpjld.simulation.sensitivity.parameters import Parameter
from warpjld.simulation.solve.checkpoint import CheckpointFile
from warpjld.simulation.solve.checks import check_model, check_specification
from warpjld.simulation.solve.identity import identity_of
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.simulation.solve.start_frame import StartFrame
from warpjld.simulation.solve_frames import Progress, solve_frames
from warpjld.simulation.solve_result import SolveResult
from warpjld.simulation.specification import ContactSpecification, SolveSpecification

if TYPE_CHECKING:
    from warpjld.page.view import SurfaceView

__all__ = ["KEPT", "Keep", "Simulation", "simulate"]

KEPT = "contact-state.npz"
"""Name of the state file of a run that asked for none, written on request so that its frames are not lost."""

Keep = Callable[[], Path | None]
"""Writes the frames solved so far into the state file and returns its path; see ``simulate``."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """Result of a contact simulation of F solved frames, of N nodes of all bodies.

    Attributes:
        solved: Solved frames, with the model, edits of the animation, grips and corrections.
        surfaces: Shapes and pressures of the visible surfaces, at any frame from the start on.
        rows: Table with one row per frame and digit.
        verdict: Status of the run, with its explanation in words.
        notes: Remarks on meshes, convergence and visible overlaps, in words.
    """

    solved: SolveResult
    surfaces: DeformedSurfaces
    rows: list[ContactRow]
    verdict: ContactVerdict
    notes: list[str]

    def __repr__(self) -> str:
        spans = self.model.spans
        return f"Simulation({self.verdict.status}, {len(self.solved.frames)} frames solved, bodies {', '.join(spans)})"

    @property
    def model(self) -> ContactModel:
        """Model that was solved; ``model.spans[name]`` are the rows of a body's nodes."""
        return self.solved.model

    @property
    def grips(self) -> tuple[FoundGrip, ...]:
        """Results of the grip searches."""
        return self.solved.grips

    @property
    def frames(self) -> NDArray[np.float64]:
        """Numbers of the solved frames, shape (F,)."""
        return np.array([solved.frame for solved in self.solved.frames])

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacements of all nodes from rest, ``model.body.mesh.nodes`` [m], shape (F, N, 3)."""
        empty = np.zeros((0, *self.model.body.mesh.nodes.shape))
        return np.concatenate([empty, *(solved.displacement[None] for solved in self.solved.frames)])

    @property
    def contact_force(self) -> NDArray[np.float64]:
        """Contact forces on all nodes, friction included [N], shape (F, N, 3)."""
        empty = np.zeros((0, *self.model.body.mesh.nodes.shape))
        return np.concatenate([empty, *(solved.nodal.sum(axis=0)[None] for solved in self.solved.frames)])

    @property
    def pressure(self) -> NDArray[np.float64]:
        """Contact pressure at all nodes [Pa], shape (F, N)."""
        empty = np.zeros((0, len(self.model.body.mesh.nodes)))
        return np.concatenate([empty, *(solved.pressure(self.model)[None] for solved in self.solved.frames)])

    def force(self, name: str) -> NDArray[np.float64]:
        """Sum of the contact forces on a body [N], shape (F, 3).

        Raises:
            InputError: No deformable body of that name.
        """
        return np.asarray(self.contact_force[:, self._span(name)].sum(axis=1))

    def gradient(self, frame: float, parameters: Sequence[Parameter]) -> Gradient:
        """Derivatives of a frame's equilibrium by joint angles, object placements, moduli and friction at that frame.

        Earlier frames are held constant; of a frame solved in several load steps the last one is differentiated. The
        derivative is exact away from changes of the active set; where a point is about to touch, separate, stick or
        slip, it is one-sided (equations in ``warpjld.fem.contact.sensitivity``).

        Args:
            frame: One of ``frames``.
            parameters: P of ``JointAngle`` [rad], ``ObjectPlace`` [m], ``Modulus`` [1], ``Friction`` [1].

        Returns:
            Arrays by parameter: displacements (P, N, 3) [m], contact forces (P, N, 3) [N], pressures (P, N) [Pa],
            forces and torques of digits.

        Raises:
            InputError: A frame that this run did not solve, or a parameter of a joint, object or pair that is not in
                the model.
            SensitivityError: The equilibrium has no derivative: a body is free to move.
        """
        known = self.solved.equilibria.get(float(frame))
        if known is None:
            solved = ", ".join(f"{number:g}" for number in self.solved.equilibria) or "none"
            raise InputError(f"frame: want one that this run solved ({solved}), got {frame:g}")
        return gradient_at(known.model, known.history, known.solution, parameters)

    def visible_pressure(self, name: str, frame: float) -> VisiblePressure:
        """Contact pressure on the visible surface of an actor or object at a frame.

        Raises:
            InputError: No deformable body of that name, or a frame outside the solved range.
        """
        self._span(name)
        pressure = self.surfaces.pressure(name, frame)
        if pressure is None:
            last = self.frames.max(initial=self.solved.start)
            raise InputError(f"frame: want one of {self.solved.start:g} to {last:g}, got {frame:g}")
        body = self.model.named(name)
        surface = self.surfaces.refined(name, body.triangles, len(body.surface))
        return VisiblePressure(surface.of(self.surfaces.separated(frame).vertices[name]), surface.faces, pressure)

    def tactile(self, actor: str) -> Tactile:
        """Simulated tactile readings of an actor's pads at the solved frames.

        Raises:
            InputError: Its flesh was not simulated, or no frame was solved.
        """
        hands = [hand for hand in self.model.hands if hand.name == actor]
        if not hands:
            raise InputError(f"{actor} has no simulated flesh to read: FLESH {actor} adds it")
        if not self.solved.frames:
            raise InputError(f"no tactile readings of {actor}, as no frame was solved: {self.solved.message}")
        return tactile_readings(self.model, hands[0], self.solved.frames)

    def show(self) -> SurfaceView:
        """Interactive view of the solved frames, coloured by pressure, for notebooks (extra ``studio``).

        Raises:
            InputError: No frame was solved.
            MissingExtraError: viser is not installed.
        """
        return view_of_frames(self.surfaces)

    def _span(self, name: str) -> slice:
        if name not in self.model.spans:
            raise InputError(f"name: nothing called {name} deforms here; there are {', '.join(self.model.spans)}")
        return self.model.spans[name]


@one_blas_thread()
def simulate(
    specification: ContactSpecification,
    animation: Animation,
    *,
    folder: Path = Path(),
    keeping: Callable[[Keep], None] = lambda keep: None,
    showing: Callable[[DeformedSurfaces], None] = lambda surfaces: None,
    progress: Progress = lambda what, done, total: None,
) -> Simulation:
    """Solve contact over the frames of an animation and evaluate the results.

    Args:
        specification: Materials, friction, grips; its ``pressing`` says which frames to solve.
        animation: Motion of all actors and objects: of a script, of arrays (``RecordedAnimation``), or another
            implementation of the protocol. Edits are applied to a copy and returned (``solved.edits``).
        folder: Folder of the state file (``pressing.state``).
        keeping: Called before the first frame with a function that writes the frames solved so far into the state file
            (``KEPT`` if none was asked for) and returns its path, None if there is nothing to resume from.
        showing: Called after each frame with the surfaces of the frames solved so far.
        progress: Called with what is being done, how much is done and how much there is.

    Returns:
        All frames that were solved, also if some could not be or Ctrl-C ended the run: see the verdict's status.

    Raises:
        InputError: Bodies that cannot be meshed or driven, or unknown names; with the script line if there is one.

    Examples:
        >>> import trimesh
        >>> plate = trimesh.creation.box((0.1, 0.02, 0.1))  # m
        >>> block = wj.RecordedObject("block", wj.shapes.box(0.02, 0.02, 0.02), positions=(0, 0.0101, 0))
        >>> floor = wj.RecordedObject("floor", plate, positions=(0, -0.01, 0))
        >>> press = wj.RecordedObject("press", plate, positions=[[0, 0.0304, 0], [0, 0.03, 0], [0, 0.0296, 0]])
        >>> contact = wj.ContactSpecification(
        ...     physical={"block": wj.ObjectMaterial(young=1e5, element=0.01)}, pressing=wj.SolveSpecification(0, 2)
        ... )
        >>> found = wj.simulate(contact, wj.RecordedAnimation(objects=[block, floor, press]))
        >>> found.verdict.status, bool(found.pressure.max() > 1000.0)  # Pa
        ('CONVERGED', True)
    """
    request = specification.pressing
    if request is None:
        raise InputError("specification: want pressing set to the frames to solve, got None")
    check_specification(animation, specification, request)
    progress("looking for the first touch", 0, 1)
    specification, animation, before = before_contact(specification, animation, request)
    progress("meshing", 0, 1)
    model, notes = _model(specification, animation, before)
    table = ContactTable(specification.strength, animation)
    done: list[SolvedFrame] = []

    def watch(driven: ContactModel, frame: SolvedFrame) -> str | None:
        reason = table.add(driven, frame)
        notes.extend(f"frame {frame.frame:g}: {text}" for text in warned())
        done.append(frame)
        showing(surfaces_of_frames(driven, done.copy(), before))
        return reason if request.stop else None

    frames = [] if before.interrupted is not None else _frames(specification, request, model.start)
    identity = cache(partial(identity_of, model, specification, frames))
    checkpoint = CheckpointFile(folder / (request.state or KEPT), identity)
    with warning_texts(ContactWarning, MaterialWarning) as warned:
        solved = solve_frames(
            model,
            frames,
            specification,
            request,
            watch=watch,
            falling=lambda ended: let_go(ended, specification, request),
            checkpoint=None if request.state is None else checkpoint,
            saving=lambda save: keeping(lambda: checkpoint.path if save(checkpoint) else None),
            progress=progress,
        )
    before, solved = after_contact(solved, before)
    return _report(solved, before, table, request, notes)


def _model(
    specification: ContactSpecification, animation: Animation, before: StartFrame
) -> tuple[ContactModel, list[str]]:
    """Contact model of all bodies at the start frame, and notes on them."""
    notes, hands, start = before.notes(), [], before.start
    for name, material in specification.flesh.items():
        hand, remarks = build_flesh_body(animation.actors[name], material, start)
        hands.append(hand)
        notes += remarks
    objects = [
        build_object_body(animation.objects[name], specification, start, before.place(name))
        for name in specification.physical
    ]
    notes += [f"{one.name}: {note}" for one in objects for note in one.notes]
    rigid = {name: one for name, one in animation.objects.items() if name not in specification.physical}
    obstacles = {name: one.obstacle(start) for name, one in rigid.items()}
    request = specification.pressing
    assert request is not None
    frames = list(map(float, range(request.first, request.last + 1)))
    obstacles |= bystanders(dict(animation.actors), set(specification.flesh), frames, bool(objects), start)
    model = assemble_model(hands, objects, obstacles, specification, start=start, animation=animation)
    check_model(model, specification)
    return model, notes


def _frames(specification: ContactSpecification, request: SolveSpecification, start: float) -> list[float]:
    """Frames to solve, ascending: every ``request.every``-th, the last, and those at which a grip or a hold changes."""
    frames = {float(f) for f in range(request.first, request.last + 1, request.every)} | {float(request.last)}
    for grip in specification.grips:
        frames |= {grip.first, grip.middle, grip.last}
    frames |= {one.until for one in specification.prescribed.values() if one.held and one.until < request.last}
    return sorted(f for f in frames if f > start)


def _report(
    solved: SolveResult, before: StartFrame, table: ContactTable, request: SolveSpecification, notes: list[str]
) -> Simulation:
    """Surfaces, table, verdict and notes of the solved frames."""
    model = solved.model
    surfaces = surfaces_of_frames(model, solved.frames, before)

    def slopes(actor: str, frame: float, forces: Mapping[str, float]) -> Mapping[str, DigitSlopes] | None:
        known = solved.equilibria.get(frame)
        return None if known is None else joint_slopes(known.model, known.history, known.solution, actor, forces)

    verdict = verdict_of(solved, table.rows, table.suggestions(model, slopes), remaining_overlaps(surfaces))
    corrections = [*(one.text for one in worst_digits(solved.corrected)), *solved.uncorrected]
    verdict = replace(
        verdict,
        text="; ".join([verdict.text, *before.notes()]),
        grips=tuple(f"{one.request.actor} at frame {one.request.first:g}: {one.text}" for one in solved.grips),
        corrections=tuple(corrections),
    )
    notes = [*notes, *table.notes()]
    for frame, bone in solved.tight:
        if bone.left > 0.0:
            notes.append(f"at frame {frame:g} {bone.text}: pressures there are beyond what was ever measured")
    if solved.resumed:
        notes.append(f"{solved.resumed} of {len(solved.frames)} frames were in {request.state} already")
    notes += [missed.text for missed in solved.missed]
    notes += parted_notes(model, solved.frames, solved.start)
    if solved.frames:
        notes += visible_overlap_notes(surfaces, solved.frames[-1].frame)
    return Simulation(solved, surfaces, table.rows, verdict, notes)
