"""Impacts of bonded objects as elastodynamics: which bonds open, and how the pieces go on (R93, R102).

From the moment of a strike, the objects that it moves are solved as deformable bodies with inertia, by implicit Euler
steps with contact, friction and bonds (``fem.load.inertia``); everything else is an obstacle. Steps are a fraction of
the time 2 D/c of a wave to and fro the largest body (D its extent, c = √(E/ρ) of its slowest piece), which in a flat
impact of a bar is the duration of contact (Johnson 1985, §11.1). The impact is over once contact has given, in the time
of half such a passage, no more than twice the impulse of the weight: the bodies have left, or lie. They go on as rigid
bodies with the momentum and the angular momentum of the finite elements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem import Dynamics, Prescribed
from warpjld.fem.contact import ContactInstant, ContactSolution, Obstacle, press
from warpjld.fem.load.inertia import lumped_masses
from warpjld.grasp import Places
from warpjld.simulation.animation import Animation
from warpjld.simulation.bodies.model import ContactModel, assemble_model
from warpjld.simulation.bodies.object_body import build_object_body
from warpjld.simulation.fall.bonded import bonded_groups
from warpjld.simulation.fall.rigid_body import RigidBody
from warpjld.simulation.fall.rigid_cluster import rigid_union
from warpjld.simulation.fall.strike import Strike
from warpjld.simulation.specification import BondStrength, ContactSpecification, SolveSpecification

__all__ = ["Impact", "solve_impact"]

_PARTS = 30
"""Time steps in the time of a wave to and fro: a bar's pressure is then within 5 %, and its duration."""
_LONGEST = 10
"""Longest impact, in times of a wave to and fro: a body that still rolls or tips over goes on as a rigid one."""
_REST = 2.0
"""Impulse of contact over that of the weight at which an impact is over."""
_HALVINGS = 2
"""Most successive halvings of a step before friction is left out."""
_TOLERANCE = 1e-4
"""Residual over the forces in balance, which is what the momentum of contact and bodies may differ by in a step."""


@dataclass(frozen=True, eq=False)
class Impact:
    """Outcome of an impact.

    Attributes:
        end: Frame at which it is over.
        bodies: Rigid bodies after it: pieces that bonds still hold together are one.
        bonds: Bonds among its objects that still hold.
        openings: Messages about those that opened.
        paths: Frames and placements of each object meanwhile, by name.
    """

    end: float
    bodies: list[RigidBody]
    bonds: list[BondStrength]
    openings: tuple[str, ...]
    paths: Mapping[str, tuple[list[float], list[Places]]]


def solve_impact(
    bodies: Sequence[RigidBody],
    obstacles: Mapping[str, Obstacle],
    animation: Animation,
    contact: ContactSpecification,
    start: float,
    rate: float,
    strike: Strike,
) -> Impact | str:
    """Solve an impact from a frame on; the reason in words where that fails.

    Args:
        bodies: The rigid bodies it moves, just before they touch.
        obstacles: Everything else by name; times of obstacles are in frames from ``start``.
        animation: Shapes of the objects.
        contact: Materials, bonds, friction and gravity.
        start: Frame at which it begins.
        rate: Frames per second.
        strike: The strike.
    """
    model, bonds = _model(bodies, obstacles, animation, contact, start)
    run = _Run(model, bodies, rate, _passage(bodies, contact))
    if failure := run.solve():
        return failure
    assert run.found is not None
    kept, openings = [], []
    share = {}
    for k, bond in bonds:
        state = run.found.states[k]
        made = np.isfinite(state.bond_gap)
        share[k] = float(state.bonded[made].mean())
        if share[k] > 0.0:
            kept.append(replace(bond, parted=tuple((~state.bonded).tolist()) if share[k] < 1.0 else bond.parted))
        if share[k] < 1.0:
            how = "opens" if share[k] == 0.0 else f"opens in part ({100.0 * share[k]:.0f} % of it still holds)"
            names = " and ".join((bond.one, bond.other))
            on = f"on impact on {' and '.join(strike.on)} at {strike.speed:.2g} m/s"
            openings.append(f"the bond of {names} {how} at frame {start + run.opened[k]:.5g}, {on}")
    if run.smooth is not None:
        what = f"the impact on {' and '.join(strike.on)} at frame {start:.5g}"
        openings.append(f"{what} is solved without friction from frame {start + run.smooth:.5g} on")
    return Impact(start + run.time, run.bodies(kept), kept, tuple(openings), run.paths())


def _model(
    bodies: Sequence[RigidBody],
    obstacles: Mapping[str, Obstacle],
    animation: Animation,
    contact: ContactSpecification,
    start: float,
) -> tuple[ContactModel, list[tuple[int, BondStrength]]]:
    """Contact model of the bodies' objects where they are, and their bonds with the numbers of their pairs."""
    parts = {part.shape.name: part for body in bodies for part in body.parts}
    bonds = [bond for bond in contact.bonds if bond.one in parts and bond.other in parts]
    own = ContactSpecification(
        physical={name: contact.physical[name] for name in parts},
        bonds=bonds,
        friction=contact.friction,
        everywhere=contact.everywhere,
        gravity=contact.pull,
        pressing=SolveSpecification(0, 1),
    )
    objects = [build_object_body(animation.objects[name], own, start, part.place) for name, part in parts.items()]
    model = assemble_model([], objects, obstacles, own, start=start, animation=animation)
    pairs = tuple(replace(pair, elastic=pair.bond is not None) for pair in model.pairs)
    model = replace(model, pairs=pairs)
    sides = [{owner.slave, owner.master} for owner in model.owners]
    return model, [(sides.index({bond.one, bond.other}), bond) for bond in bonds]


def _passage(bodies: Sequence[RigidBody], contact: ContactSpecification) -> float:
    """Longest time of a wave to and fro a body [s]."""
    out = 0.0
    for body in bodies:
        matters = [contact.physical[part.shape.name] for part in body.parts]
        slowest = min(float(np.sqrt(matter.young / matter.density)) for matter in matters)
        out = max(out, 4.0 * body.shape.reach / slowest)
    return out


class _Run:
    """One elastodynamic solve; times are in frames from its start.

    Attributes:
        found: Last solution.
        time: Time reached.
        opened: Time at which each bond opens for the first time, wholly if it does, by number of its pair.
        smooth: Time from which on there is no friction; None: it acts all the time.
    """

    def __init__(self, model: ContactModel, bodies: Sequence[RigidBody], rate: float, passage: float) -> None:
        self._model, self._rate, self._passage = model, rate, passage
        self._x, self._pairs = model.body.mesh.nodes, list(model.pairs)
        self.found: ContactSolution | None = None
        self.smooth: float | None = None
        self._masses = lumped_masses(model.body)
        self._velocity = np.zeros_like(self._x)
        body_of = {}
        for number, body in enumerate(bodies):
            for part in body.parts:
                span = model.spans[part.shape.name]
                self._velocity[span] = body.moving(self._x[span])
                body_of[part.shape.name] = number
        self._parts = {part.shape.name: part for body in bodies for part in body.parts}
        self._outer = [body_of.get(owner.master) != body_of[owner.slave] for owner in model.owners]
        self._whole: dict[int, int] = {}
        self._kept: dict[int, int] = {}
        self._shapes: list[tuple[float, NDArray[np.float64]]] = [(0.0, np.zeros_like(self._x))]
        self.time, self.opened = 0.0, dict[int, float]()

    def solve(self) -> str:
        """Solve until the impact is over; the reason in words where that fails."""
        step = self._passage / _PARTS * self._rate  # [frames]
        weight = float(self._masses.sum() * np.linalg.norm(self._model.loads.gravity))
        began, count = False, _PARTS // 2
        for _ in range(2 * _LONGEST):
            times = [self.time + (k + 1) * step for k in range(count)]
            found = self._pressed_on(times)
            if not found.converged and self.smooth is None:
                self._drop_friction()
                found = self._pressed_on(times)
            if not found.converged:
                return found.message
            self._note(found)
            self.found, self.time = found, times[-1]
            assert found.last.velocity is not None
            self._velocity = found.last.velocity
            given = sum(self._push(instant) for instant in found.instants) / count
            if began and given < _REST * weight:
                break
            began = began or given >= _REST * weight
        return ""

    def _pressed_on(self, times: list[float]) -> ContactSolution:
        """Solve on to some times."""
        return press(
            self._model.body,
            lambda time: Prescribed(np.empty(0, np.int64), np.empty(0)),
            self._pairs,
            lambda time: self._model.loads,
            times=times,
            after=self.found,
            tolerance=_TOLERANCE,
            dynamics=Dynamics(self._velocity, 1.0 / self._rate),
            halvings=_HALVINGS,
            check=False,
        )

    def _drop_friction(self) -> None:
        """Go on without friction: where bonded sides meet a third in a corner, how it acts is not always found."""
        self.smooth = self.time
        self._pairs = [replace(pair, friction=0.0) for pair in self._pairs]
        if self.found is not None:
            states = [replace(s, friction=s.friction * s.bonded[:, None]) for s in self.found.states]
            self.found = replace(self.found, states=tuple(states))

    def _push(self, instant: ContactInstant) -> float:
        """Contact forces on the bodies, from without and of each other [N]."""
        pairs = zip(instant.touches, self._outer, strict=True)
        return sum(float(np.linalg.norm(touch.force)) for touch, outer in pairs if outer)

    def _note(self, found: ContactSolution) -> None:
        """Note the shapes at whole frames, and which bonds opened when."""
        for k, state in enumerate(found.states):
            if self._model.pairs[k].bond is not None:
                self._whole.setdefault(k, int(np.isfinite(state.bond_gap).sum()))
        for instant in found.instants:
            self._shapes.append((instant.time, instant.displacement))
            for k, whole in self._whole.items():
                left = int(instant.touches[k].bonded.sum())
                if left < self._kept.get(k, whole) and (left == 0 or k not in self.opened):
                    self.opened[k] = instant.time
                self._kept[k] = left

    def paths(self) -> dict[str, tuple[list[float], list[Places]]]:
        """Frames and rigid placements of each object, by name: whole frames, and the end."""
        start = self._model.start
        times = np.array([time for time, _ in self._shapes])
        wanted = [float(f) - start for f in range(int(np.ceil(start + 1e-9)), int(np.ceil(start + self.time)))]
        out: dict[str, tuple[list[float], list[Places]]] = {name: ([], []) for name in self._parts}
        for time in [*wanted, self.time]:
            after = int(np.clip(np.searchsorted(times, time), 1, len(times) - 1))
            share = (time - times[after - 1]) / (times[after] - times[after - 1])
            u = (1.0 - share) * self._shapes[after - 1][1] + share * self._shapes[after][1]
            for name, part in self._parts.items():
                span = self._model.spans[name]
                moved = _fitted(self._x[span], self._x[span] + u[span], self._masses[span])
                out[name][0].append(start + time)
                out[name][1].append(_moved(part.place, *moved))
        return out

    def bodies(self, bonds: Sequence[BondStrength]) -> list[RigidBody]:
        """Rigid bodies at the end, with the momentum and angular momentum of the finite elements."""
        assert self.found is not None
        u = self.found.last.displacement
        out = []
        for names in bonded_groups(self._parts, bonds):
            rows = np.concatenate([np.arange(len(self._x))[self._model.spans[name]] for name in names])
            x, v, m = self._x[rows] + u[rows], self._velocity[rows], self._masses[rows]
            turn, shift = _fitted(self._x[rows], x, m)
            members = [(self._parts[name].shape, _moved(self._parts[name].place, turn, shift)) for name in names]
            body = rigid_union(members)
            centre = m @ x / m.sum()
            away = x - centre
            inertia = float(m @ (away**2).sum(axis=1)) * np.eye(3) - (away.T * m) @ away
            body.velocity = m @ v / m.sum()
            body.spin = np.linalg.solve(inertia, m @ np.cross(away, v - body.velocity))
            out.append(body)
        return out


def _fitted(
    before: NDArray[np.float64], after: NDArray[np.float64], masses: NDArray[np.float64]
) -> tuple[Rotation, NDArray[np.float64]]:
    """Rotation and translation (3,) that fit points (n, 3) with masses to others in the least-squares sense."""
    here, there = masses @ before / masses.sum(), masses @ after / masses.sum()
    turn = Rotation.align_vectors(after - there, before - here, weights=masses)[0]
    return turn, there - turn.apply(here)


def _moved(place: Places, turn: Rotation, shift: NDArray[np.float64]) -> Places:
    """A placement after a rigid motion."""
    rotation = (turn * Rotation.from_quat(place.rotation[0])).as_quat()
    return Places.of(turn.apply(place.position[0]) + shift, rotation)
