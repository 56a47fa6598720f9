"""Force-limited motion of digits: a digit stops where its muscles or its skin reach their limits (R118, R119).

An animation closes digits by prescribed angles; the resulting forces are those of the flesh, which stiffens without
bound between a bone and a wall. A real hand is limited by force. So a digit whose load reaches a limit keeps its
flexions there while the other digits go on; it continues when its load has dropped, and opens as the animation does.
The same holds for its abduction, either way, against what the muscles bear that move it sideways.

The angle at which a digit reaches its limit between two equilibria is found by a chord (secant): forces of flesh are
convex in the angle, so the chord's point lies short of the limit, never beyond it. A digit that ends well short of its
limit continues at the next frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import WarpjldError
from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.bone_clearance import BoneClearance, TightBone
from warpjld.simulation.solve.branch import solve_onward
from warpjld.simulation.solve.digit_caps import AngleRamp, DigitMotion, closing_joints, held_angles, limited_joints
from warpjld.simulation.solve.digit_loads import DigitLoad, digit_loads

__all__ = ["BoneInsideError", "ForceLimits", "Stop"]


class BoneInsideError(WarpjldError):
    """A bone would lie inside an object; the message names the frame."""


_Digit = tuple[str, str]
"""Name of an actor, and of its digit in the skeleton."""

_SAME = 1e-9
"""Tolerance for equal angles [rad]; also for rounding of step counts."""

_AIM = 0.97
"""Load to limit ratio at which digits stop; below 1 because loads by nearest bones differ from those of the table by a
few percent."""
_RELAXED = 0.8
"""Load to limit ratio below which a stopped digit continues."""
_TRIES = 3
"""Times a step is repeated with digits that stop within it; after that they stop at its beginning."""
_HALVINGS = 2
"""Most halvings of a load step as long as digits can stop instead."""
_SPENT = 0.25
"""Relative thickness of the flesh over a bone at which a digit stops whatever its load: pressures there are far beyond
any limit, and equilibria hard to find."""
_SQUEEZED = 0.15
"""Largest change of the relative thickness of flesh over a bone in one step; forces double meanwhile."""
_PARTS = (1.0, 0.5, 0.25, 0.125)
"""Fractions of its lag behind the animation that a digit may recover in one step, tried in turn."""
_LOOKS = 8
"""Intervals into which a step is divided to find where a bone comes too near."""


@dataclass(frozen=True)
class Stop:
    """A digit that stopped at a limit.

    Attributes:
        actor: Name of the actor.
        digit: Name of the digit in the skeleton.
        frame: Frame from which on it keeps its angles.
        why: Reason in words.
    """

    actor: str
    digit: str
    frame: float
    why: str


@dataclass(eq=False)
class ForceLimits:
    """State of the force limits: which motions of digits have stopped, and at which angles.

    Attributes:
        strength: Force limits of digits that differ from the default [N], by actor and digit.
        pressure: Pressure limit of skin [Pa].
        weights: Assumed weights of objects that only hands hold, by name [N].
        clearance: Clearance of the bones.
        stops: Digits that stopped, each the first time.
    """

    strength: Mapping[str, Mapping[str, float]]
    pressure: float
    weights: Mapping[str, float]
    clearance: BoneClearance
    stops: list[Stop] = field(default_factory=list)
    _caps: dict[DigitMotion, AngleRamp] = field(default_factory=dict)
    _course: dict[DigitMotion, AngleRamp] = field(default_factory=dict)
    _until: dict[DigitMotion, float] = field(default_factory=dict)
    _loads: dict[_Digit, DigitLoad] = field(default_factory=dict)
    _stuck: set[DigitMotion] = field(default_factory=set)

    def solve(
        self, model: ContactModel, history: History, before: ContactSolution | None, times: Sequence[float]
    ) -> ContactSolution:
        """Solve equilibria at ascending times like ``solve_onward``, stopping digits that reach their limits.

        Raises:
            BoneInsideError: A bone would enter an object although its digit does not close.
        """
        if not _bendable(model):
            return solve_onward(model, history, before, times)
        reached: list[ContactInstant] = []
        now = 0.0 if before is None else before.last.time
        self._course = dict(self._caps)
        self._check_bones(model, now, times)
        for time in self._refined(model, now, times):
            found = self._step(model, history, before, now, time)
            if not found.converged:
                return replace(found, instants=(*reached, found.last))
            reached += found.instants
            before, now = found, time
        assert before is not None
        return replace(before, instants=tuple(reached))

    def content(self) -> dict[str, Any]:
        """State as plain values, for a checkpoint."""
        return {
            "caps": [[*key, ramp.begin, ramp.end, list(ramp.most.items())] for key, ramp in self._caps.items()],
            "loads": [asdict(load) for load in self._loads.values()],
            "stuck": sorted(self._stuck),
            "stops": [asdict(stop) for stop in self.stops],
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """Restore the state that ``content`` returned."""
        self._caps = {
            DigitMotion(*key): AngleRamp(begin, end, {joint: tuple(most) for joint, most in joints})
            for *key, begin, end, joints in content.get("caps", [])
        }
        loads = [DigitLoad(**load) for load in content.get("loads", [])]
        self._loads = {(load.actor, load.digit): load for load in loads}
        self._stuck = {DigitMotion(*key) for key in content.get("stuck", [])}
        self.stops = [Stop(**stop) for stop in content.get("stops", [])]

    def edits(self, model: ContactModel, since: float, time: float) -> tuple[AngleEdit, ...]:
        """Edits of the animation at ``time`` for angles that are limited, valid after ``since``."""
        out = []
        for hand in _bendable(model):
            wanted, reached = hand.bones.angles(time), self._angles(hand, time)
            for joint, channel in np.argwhere(np.abs(reached - wanted) > _SAME).tolist():
                value = float(reached[joint, channel])
                out.append(AngleEdit(hand.name, joint, model.start + since, model.start + time, value, channel))
        return tuple(out)

    def driven(self, model: ContactModel) -> ContactModel:
        """The model with the angles of stopped digits limited."""
        stopped = {motion.actor for motion in self._caps}
        hands = [self._capped(hand) if hand.name in stopped else hand for hand in model.hands]
        return replace(model, hands=tuple(hands))

    def _capped(self, hand: FleshBody) -> FleshBody:
        caps = [one for one in self._caps.items() if one[0].actor == hand.name]  # a copy: self._caps changes
        return replace(
            hand, moves=lambda time: hand.bones.moves_of(held_angles(hand.bones.angles(time), caps, time), time)
        )

    def _refined(self, model: ContactModel, now: float, times: Sequence[float]) -> list[float]:
        """Times with intermediate ones inserted, so that no step compresses the flesh over a bone by too much."""
        out: list[float] = []
        driven = self.driven(model)
        left = self._left(driven, now)
        for time in times:
            then = self._left(driven, time)
            squeezed = max((left.get(place, 1.0) - max(share, _SPENT) for place, share in then.items()), default=0.0)
            pieces = max(1, int(np.ceil(squeezed / _SQUEEZED - _SAME)))
            out += [now + (time - now) * (k + 1) / pieces for k in range(pieces - 1)] + [time]
            left, now = then, time
        return out

    def _check_bones(self, model: ContactModel, now: float, times: Sequence[float]) -> None:
        """Reject several steps in which a bone enters an object while its digit does not close, and so cannot stop.

        Raises:
            BoneInsideError: At the first such time.
        """
        if len(times) < 2:  # a single step is checked in _step
            return
        driven, closing = self.driven(model), self._closing(model, now, times[-1])
        for time in times:
            inside = [bone for bone in self.clearance.nearest(driven, time) if bone.left <= 0.0]
            carried = [bone for bone in inside if not any(_moves(key, bone) for key in closing)]
            if carried:
                worst = min(carried, key=lambda bone: bone.left)
                raise BoneInsideError(f"at frame {model.start + time:.4g}: {worst.text}")

    def _left(self, model: ContactModel, time: float) -> dict[tuple[str, str, str], float]:
        """Relative thickness of the flesh over bones and between those of two digits, by actor, digit and object."""
        found = [*self.clearance.nearest(model, time), *self.clearance.between_digits(model, time)]
        return {(one.actor, one.digit, one.object): one.left for one in found}

    def _step(
        self, model: ContactModel, history: History, before: ContactSolution | None, now: float, time: float
    ) -> ContactSolution:
        """One step, repeated with digits stopped earlier until no closing digit is above its limit."""
        self._relax(model, now, time)
        self._course, self._until = dict(self._caps), {}
        self._spare_bones(model, now, time)
        if (inside := self.clearance.inside(self.driven(model), time)) is not None:
            raise BoneInsideError(inside)
        for tried in count():  # terminates: after _TRIES, digits above their limits stop at ``now`` and no longer close
            closing = self._closing(model, now, time)
            halvings = _HALVINGS if closing else None
            found = solve_onward(self.driven(model), history, before, [time], halvings=halvings, ease=True)
            if not found.converged:
                if not closing:
                    return found
                self._stop_loaded(model, closing, now, time)
                continue
            loads = self._loads_at(model, found)
            would_be = {key: self._share_in(loads, key) for key in closing}
            over = {key: would for key, would in would_be.items() if would > 1.0}
            if not over:
                self._loads = loads
                return found
            for key, would in over.items():
                was = self._share(key)
                part = (_AIM - was) / (would - was) if was < _AIM and tried < _TRIES else 0.0
                moved = self._until.get(key, time) - now  # it may have stopped within the step already
                why = loads[key[:2]].bound(self.pressure, key.sideways)
                self._stop(model, key, now, time, now + part * moved, why)
        raise AssertionError

    def _spare_bones(self, model: ContactModel, now: float, time: float) -> None:
        """Stop digits in whose motion a bone comes too near to an object."""
        closing = self._closing(model, now, time)
        near = [one for one in self.clearance.nearest(self.driven(model), time) if one.left < _SPENT]
        for key in closing:
            if any(_moves(key, one) for one in near):
                at = now
                for look in range(1, _LOOKS):
                    moment = now + (time - now) * look / _LOOKS
                    tight = self.clearance.nearest(self.driven(model), moment)
                    if any(_moves(key, one) and one.left < _SPENT for one in tight):
                        break
                    at = moment
                self._stop(model, key, now, time, at, "hardly any flesh is left before its bone")

    def _stop_loaded(self, model: ContactModel, closing: Sequence[DigitMotion], now: float, time: float) -> None:
        """Stop the motions that a load resists, or all of them if there is none."""
        pressing = [key for key in closing if self._share(key) > 0.0]
        for key in pressing or closing:
            self._stop(model, key, now, time, now, "no equilibrium was found beyond")
            self._stuck.add(key)

    def _share(self, key: DigitMotion) -> float:
        """Load to limit ratio of a motion at the last equilibrium."""
        return self._share_in(self._loads, key)

    def _share_in(self, loads: Mapping[_Digit, DigitLoad], key: DigitMotion) -> float:
        """Load to limit ratio of a motion; 0 without a load."""
        return loads[key[:2]].share(self.pressure, key.sideways) if key[:2] in loads else 0.0

    def _loads_at(self, model: ContactModel, found: ContactSolution) -> dict[_Digit, DigitLoad]:
        """Loads of all digits at an equilibrium."""
        out: dict[_Digit, DigitLoad] = {}
        for hand in _bendable(model):
            angles = self._angles(hand, found.last.time)
            loads = digit_loads(model, hand, angles, found.last, self.strength.get(hand.name), self.weights)
            out |= {(hand.name, digit): load for digit, load in loads.items()}
        return out

    def _angles(
        self, hand: FleshBody, time: float, caps: Mapping[DigitMotion, AngleRamp] | None = None
    ) -> NDArray[np.float64]:
        """Joint angles of a hand, limited by the current ramps or by given ones [rad], shape (J, 4)."""
        ramps = (self._caps if caps is None else caps).items()
        return held_angles(hand.bones.angles(time), (one for one in ramps if one[0].actor == hand.name), time)

    def _closing(self, model: ContactModel, now: float, time: float) -> list[DigitMotion]:
        """Digits that close in a step, a joint's flexion increasing, or move sideways, their abduction changing."""
        out = []
        for hand in _bendable(model):
            skeleton, change = hand.bones.skeleton, self._angles(hand, time) - self._angles(hand, now, self._course)
            motions = (DigitMotion(hand.name, digit, way) for digit in closing_joints(skeleton) for way in (0, 1, -1))
            for one in motions:
                if (one.sign * change[limited_joints(skeleton, one), one.channel] > _SAME).any():
                    out.append(one)
        return out

    def _stop(self, model: ContactModel, key: DigitMotion, now: float, time: float, at: float, why: str) -> None:
        """Limit a digit's angles in a step ``now`` … ``time`` to those that its course in the step has at ``at``.

        The course is that without stops in this step: a digit that lags behind the animation has gone less far at
        ``now`` than at ``at``.
        """
        hand = next(one for one in model.hands if one.name == key.actor)
        begin, end = (self._angles(hand, moment, self._course)[:, key.channel] for moment in (now, at))
        joints = limited_joints(hand.bones.skeleton, key)
        ends = {joint: (float(begin[joint]), float(end[joint])) for joint in joints}
        self._caps[key], self._until[key] = AngleRamp(now, time, ends), at
        if not any((one.actor, one.digit) == key[:2] for one in self.stops):
            self.stops.append(Stop(*key[:2], model.start + at, why))

    def _relax(self, model: ContactModel, now: float, time: float) -> None:
        """Raise the limits of stopped digits whose load has dropped, so far that flesh is compressed little in a step.

        Digits that stopped because no equilibrium was found continue only once they bear no load.
        """
        for key, ramp in list(self._caps.items()):
            here = {joint: (ramp.at(joint, now),) * 2 for joint in ramp.most}
            self._caps[key] = held = AngleRamp(now, time, here)
            share = self._share(key)
            if share >= _RELAXED or (key in self._stuck and share > 0.0):
                continue
            self._stuck.discard(key)
            hand = next(one for one in model.hands if one.name == key.actor)
            wanted = hand.bones.angles(time)[:, key.channel]
            if all(key.sign * wanted[joint] <= key.sign * most for joint, (most, _) in here.items()):
                del self._caps[key]
                continue
            left = self._left(self.driven(model), now)
            for part in _PARTS:
                lag = {joint: max(0.0, key.sign * (wanted[joint] - most)) for joint, (most, _) in here.items()}
                ends = {joint: (most, most + key.sign * part * lag[joint]) for joint, (most, _) in here.items()}
                self._caps[key] = AngleRamp(now, time, ends)
                then = self._left(self.driven(model), time)
                if all(left.get(place, 1.0) - share <= _SQUEEZED for place, share in then.items()):
                    break
            else:
                self._caps[key] = held


def _bendable(model: ContactModel) -> list[FleshBody]:
    """Hands driven by joint angles."""
    return [hand for hand in model.hands if hand.bones.bendable]


def _moves(motion: DigitMotion, bone: TightBone) -> bool:
    """Whether a motion is that of the digit of a bone."""
    return motion.actor == bone.actor and motion.digit.rpartition(".")[2] == bone.digit
