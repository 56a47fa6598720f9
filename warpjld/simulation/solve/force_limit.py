"""Digits that close no farther than their muscles can press, or than their skin bears (R118, R119).

An animation closes digits by angles; how hard they then press is left to the flesh, which stiffens without bound
between a bone and a wall. No hand does that. A digit whose load reaches its limit keeps the flexions it has there,
while all others go on; it goes on itself when its load has fallen, and opens as the animation does.

Where between two equilibria a digit reaches its limit is found by a chord: forces of flesh grow ever faster, so that
the chord's point lies short of the limit, never beyond it. What ends well short of it goes on at the next frame.
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
from warpjld.simulation.solve.digit_caps import FlexionRamp, closing_joints, held_angles
from warpjld.simulation.solve.digit_loads import DigitLoad, digit_loads
from warpjld.skeleton.channels import FLEXION

__all__ = ["BoneInsideError", "ForceLimits", "Stop"]


class BoneInsideError(WarpjldError):
    """A bone that would lie in an object, in words with the frame."""


_Key = tuple[str, str]
"""An actor and its digit, as the skeleton has it."""

_SAME = 1e-9
"""Angles that do not differ [rad]."""

_AIM = 0.97
"""Share of the limits at which digits stop: the table's loads differ from those by nearness by a few percent."""
_RELAXED = 0.8
"""Share of them below which a digit that has stopped goes on."""
_TRIES = 3
"""Times a step is looked for again with digits that stop in its course; then they stay as they were before it."""
_HALVINGS = 2
"""Times a step may be halved as long as digits could stop instead."""
_SPENT = 0.25
"""Share of the flesh over a bone that is left where a digit stops whatever its load: pressures are far beyond any limit
there, and equilibria hard to find."""
_SQUEEZED = 0.15
"""Share of the flesh over a bone by which one step squeezes it at most: forces double meanwhile."""
_PARTS = (1.0, 0.5, 0.25, 0.125)
"""Parts of what it lags behind by that a digit may make up for in a step."""
_LOOKS = 8
"""Places on a step's way at which that is looked for."""


@dataclass(frozen=True)
class Stop:
    """A digit that stopped.

    Attributes:
        actor: Whose.
        digit: As the skeleton has it.
        frame: From which on.
        why: In words.
    """

    actor: str
    digit: str
    frame: float
    why: str


@dataclass(eq=False)
class ForceLimits:
    """Which digits have stopped, and where.

    Attributes:
        strength: Largest forces of digits [N], by actor and digit, where they are not the default.
        pressure: What skin bears [Pa].
        weights: What objects may weigh that hands alone are to hold, by name [N].
        clearance: Of the bones.
        stops: Digits that stopped, the first time each.
    """

    strength: Mapping[str, Mapping[str, float]]
    pressure: float
    weights: Mapping[str, float]
    clearance: BoneClearance
    stops: list[Stop] = field(default_factory=list)
    _caps: dict[_Key, FlexionRamp] = field(default_factory=dict)
    _loads: dict[_Key, DigitLoad] = field(default_factory=dict)
    _stuck: set[_Key] = field(default_factory=set)

    def solve(
        self, model: ContactModel, history: History, before: ContactSolution | None, times: Sequence[float]
    ) -> ContactSolution:
        """Equilibria at rising times, as ``solve_onward`` has them; digits that reach their limits stop on the way.

        Raises:
            BoneInsideError: A bone would come to lie in an object by no closing of its digit.
        """
        if not _bendable(model):
            return solve_onward(model, history, before, times)
        reached: list[ContactInstant] = []
        now = 0.0 if before is None else before.last.time
        self._look_along(model, now, times)
        for time in self._finer(model, now, times):
            found = self._step(model, history, before, now, time)
            if not found.converged:
                return replace(found, instants=(*reached, found.last))
            reached += found.instants
            before, now = found, time
        assert before is not None
        return replace(before, instants=tuple(reached))

    def content(self) -> dict[str, Any]:
        """As plain values, for a run that goes on."""
        return {
            "caps": [[*key, ramp.begin, ramp.end, list(ramp.most.items())] for key, ramp in self._caps.items()],
            "loads": [asdict(load) for load in self._loads.values()],
            "stuck": sorted(self._stuck),
            "stops": [asdict(stop) for stop in self.stops],
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """Go on from what ``content`` gave."""
        self._caps = {
            (actor, digit): FlexionRamp(begin, end, {joint: tuple(most) for joint, most in joints})
            for actor, digit, begin, end, joints in content.get("caps", [])
        }
        loads = [DigitLoad(**load) for load in content.get("loads", [])]
        self._loads = {(load.actor, load.digit): load for load in loads}
        self._stuck = {(actor, digit) for actor, digit in content.get("stuck", [])}
        self.stops = [Stop(**stop) for stop in content.get("stops", [])]

    def edits(self, model: ContactModel, since: float, time: float) -> tuple[AngleEdit, ...]:
        """Angles at a time of digits that have stopped since another."""
        out = []
        for hand in _bendable(model):
            wanted, reached = hand.bones.angles(time)[:, FLEXION], self._angles(hand, time)[:, FLEXION]
            for joint in np.flatnonzero(reached < wanted - _SAME).tolist():
                value = float(reached[joint])
                out.append(AngleEdit(hand.name, joint, model.start + since, model.start + time, value))
        return tuple(out)

    def driven(self, model: ContactModel) -> ContactModel:
        """The model with digits that have stopped."""
        stopped = {actor for actor, _ in self._caps}
        hands = [self._held(hand) if hand.name in stopped else hand for hand in model.hands]
        return replace(model, hands=tuple(hands))

    def _held(self, hand: FleshBody) -> FleshBody:
        caps = [ramp for (actor, _), ramp in self._caps.items() if actor == hand.name]  # as they are now
        return replace(
            hand, moves=lambda time: hand.bones.moves_of(held_angles(hand.bones.angles(time), caps, time), time)
        )

    def _finer(self, model: ContactModel, now: float, times: Sequence[float]) -> list[float]:
        """Times with others between, so that in no step a bone's flesh is squeezed by too much."""
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

    def _look_along(self, model: ContactModel, now: float, times: Sequence[float]) -> None:
        """Refuse a way of several steps on which a bone comes to lie in an object, if its digit does not close on it
        and so cannot stop.

        Raises:
            BoneInsideError: Where it first does.
        """
        if len(times) < 2:  # each step looks at its own end
            return
        driven, closing = self.driven(model), self._closing(model, now, times[-1])
        for time in times:
            inside = [one for one in self.clearance.nearest(driven, time) if one.left <= 0.0]
            carried = [one for one in inside if _key_of(closing, one) is None]
            if carried:
                worst = min(carried, key=lambda one: one.left)
                raise BoneInsideError(f"at frame {model.start + time:.4g}: {worst.text}")

    def _left(self, model: ContactModel, time: float) -> dict[tuple[str, str, str], float]:
        """Share of flesh that is left before bones, by actor, digit and object."""
        return {(one.actor, one.digit, one.object): one.left for one in self.clearance.nearest(model, time)}

    def _step(
        self, model: ContactModel, history: History, before: ContactSolution | None, now: float, time: float
    ) -> ContactSolution:
        """One step; again with digits that stop earlier, until none is over its limit that still closes."""
        self._relax(model, now, time)
        self._spare_bones(model, now, time)
        if (inside := self.clearance.inside(self.driven(model), time)) is not None:
            raise BoneInsideError(inside)
        for tried in count():  # ends: from some try on, whatever is over its limit no longer closes in the next
            closing = self._closing(model, now, time)
            found = solve_onward(self.driven(model), history, before, [time], halvings=_HALVINGS if closing else None)
            if not found.converged:
                if not closing:
                    return found
                self._stop_what_presses(model, closing, now)
                continue
            loads = self._found(model, found)
            over = [key for key in closing if key in loads and loads[key].share(self.pressure) > 1.0]
            if not over:
                self._loads = loads
                return found
            for key in over:
                was, would = self._share(key), loads[key].share(self.pressure)
                part = (_AIM - was) / (would - was) if was < _AIM and tried < _TRIES else 0.0
                self._stop(model, key, now + part * (time - now), loads[key].bound(self.pressure))
        raise AssertionError

    def _spare_bones(self, model: ContactModel, now: float, time: float) -> None:
        """Stop digits on whose way a bone comes too near to an object."""
        closing = self._closing(model, now, time)
        near = {_key_of(closing, one) for one in self.clearance.nearest(self.driven(model), time) if one.left < _SPENT}
        for key in closing:
            if key in near:
                at = now
                for look in range(1, _LOOKS):
                    moment = now + (time - now) * look / _LOOKS
                    tight = self.clearance.nearest(self.driven(model), moment)
                    if any(_key_of(closing, one) == key and one.left < _SPENT for one in tight):
                        break
                    at = moment
                self._stop(model, key, at, "hardly any flesh is left before its bone")

    def _stop_what_presses(self, model: ContactModel, closing: Sequence[_Key], now: float) -> None:
        """Stop the digits that press; all that close where none does."""
        pressing = [key for key in closing if self._share(key) > 0.0]
        for key in pressing or closing:
            self._stop(model, key, now, "no equilibrium was found beyond")
            self._stuck.add(key)

    def _share(self, key: _Key) -> float:
        """Load of a digit at the last equilibrium, over what it may be."""
        return self._loads[key].share(self.pressure) if key in self._loads else 0.0

    def _found(self, model: ContactModel, found: ContactSolution) -> dict[_Key, DigitLoad]:
        """Loads of all digits at an equilibrium."""
        out: dict[_Key, DigitLoad] = {}
        for hand in _bendable(model):
            angles = self._angles(hand, found.last.time)
            loads = digit_loads(model, hand, angles, found.last, self.strength.get(hand.name), self.weights)
            out |= {(hand.name, digit): load for digit, load in loads.items()}
        return out

    def _angles(self, hand: FleshBody, time: float) -> NDArray[np.float64]:
        """Joint angles [rad], shape (J, 4), of a hand some of whose digits have stopped."""
        caps = (ramp for (actor, _), ramp in self._caps.items() if actor == hand.name)
        return held_angles(hand.bones.angles(time), caps, time)

    def _closing(self, model: ContactModel, now: float, time: float) -> list[_Key]:
        """Digits of which a joint flexes on in a step."""
        out = []
        for hand in _bendable(model):
            way = (self._angles(hand, time) - self._angles(hand, now))[:, FLEXION]
            digits = closing_joints(hand.bones.skeleton).items()
            out += [(hand.name, digit) for digit, joints in digits if (way[joints] > _SAME).any()]
        return out

    def _stop(self, model: ContactModel, key: _Key, time: float, why: str) -> None:
        """Keep a digit's flexions from a time on."""
        hand = next(one for one in model.hands if one.name == key[0])
        angles = self._angles(hand, time)
        joints = closing_joints(hand.bones.skeleton)[key[1]]
        self._caps[key] = FlexionRamp(time, time, {joint: (float(angles[joint, FLEXION]),) * 2 for joint in joints})
        if not any((one.actor, one.digit) == key for one in self.stops):
            self.stops.append(Stop(*key, model.start + time, why))

    def _relax(self, model: ContactModel, now: float, time: float) -> None:
        """Let digits go on in a step whose load has fallen, by no more than squeezes flesh little; those beyond which
        there was no equilibrium when they are free."""
        for key, ramp in list(self._caps.items()):
            here = {joint: (ramp.at(joint, now),) * 2 for joint in ramp.most}
            self._caps[key] = held = FlexionRamp(now, time, here)
            share = self._share(key)
            if share >= _RELAXED or (key in self._stuck and share > 0.0):
                continue
            self._stuck.discard(key)
            hand = next(one for one in model.hands if one.name == key[0])
            wanted = hand.bones.angles(time)[:, FLEXION]
            if all(most <= ramp.at(joint, now) for joint, most in enumerate(wanted) if joint in ramp.most):
                del self._caps[key]
                continue
            left = self._left(self.driven(model), now)
            for part in _PARTS:
                ends = {
                    joint: (most, most + part * max(0.0, wanted[joint] - most)) for joint, (most, _) in here.items()
                }
                self._caps[key] = FlexionRamp(now, time, ends)
                then = self._left(self.driven(model), time)
                if all(left.get(place, 1.0) - share <= _SQUEEZED for place, share in then.items()):
                    break
            else:
                self._caps[key] = held


def _bendable(model: ContactModel) -> list[FleshBody]:
    return [hand for hand in model.hands if hand.bones.bendable]


def _key_of(keys: Sequence[_Key], bone: TightBone) -> _Key | None:
    return next((key for key in keys if key[0] == bone.actor and key[1].rpartition(".")[2] == bone.digit), None)
