"""Grips found while frames are solved: the gentlest that holds an object, or the one of a wished force (R123, R124)."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.grip.force import Firmness, FirmStatus, grip_of_force
from warpjld.simulation.grip.search import GripStatus, gentlest_grip
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.bodies.model import Bodies
from warpjld.simulation.grip.hold import Lift
from warpjld.simulation.grip.squeeze import Tightening
from warpjld.simulation.specification import GripWish

__all__ = ["FoundGrip", "find_grip", "write_grips"]

_START = math.radians(0.5)
"""First step of a search [rad]."""
_NEAR = 0.08
"""How near to the gentlest grip, as a share of its angle."""

_PRESSES = 0.01
"""A digit presses with more than this share of the strongest: flesh between two digits hands a little on to both."""

_HELD = (GripStatus.HELD, GripStatus.HELD_AT_ONCE)
_COLUMNS = (
    *("actor", "object", "frame", "grip_deg", "outcome", "held", "borne", "force_n", "sliding", "share", "digit"),
    *("chosen", "status"),
)


@dataclass(frozen=True, eq=False)
class FoundGrip:
    """A grip that was searched for.

    Attributes:
        wish: What was asked.
        status: Name of how it ended.
        text: One line for people.
        grip: Angle by which the digits close on [rad]; 0 where nothing was found.
        lowered: How far the object's middle sinks when the hand takes its weight [m]; None where it does not.
        force: Sum of the normal forces on the object, or of the digits' forces [N].
        digits: Digit → force [N], largest force [N], largest share of the muscles' limits.
        rows: Every grip tried, for a table.
    """

    wish: GripWish
    status: str
    text: str
    grip: float
    lowered: float | None
    force: float
    digits: Mapping[str, tuple[float, float, float]]
    rows: tuple[dict[str, Any], ...] = field(default=())

    def content(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "actor": self.wish.actor,
            "object": self.wish.object,
            "frame": self.wish.first,
            "status": self.status,
            "message": self.text,
            "grip_degrees": round(math.degrees(self.grip), 4),
            "force_n": self.force,
            "digits": {
                name: {"force_n": force, "limit_n": limit, "share": share}
                for name, (force, limit, share) in self.digits.items()
            },
            "trials": list(self.rows),
        }


def find_grip(bodies: Bodies, wish: GripWish, after: ContactSolution, limits: Mapping[str, float]) -> FoundGrip:
    """Search, from the equilibrium at the wish's first frame."""
    hand = next(one for one in bodies.hands if one.name == wish.actor)
    skeleton = hand.drive.skeleton
    joints = [skeleton.index(channel.rpartition(".")[0]) for channel in wish.channels]
    grips = Tightening(bodies, hand, joints, after, limits)
    most = min(wish.most, grips.room)
    if wish.lift:
        return _gentlest(bodies, wish, grips, most)
    return _firm(wish, grips, most)


def _gentlest(bodies: Bodies, wish: GripWish, grips: Tightening, most: float) -> FoundGrip:
    one = next(body for body in bodies.objects if body.name == wish.object)
    friction = max(
        pair.friction
        for pair, owner in zip(bodies.pairs, bodies.owners, strict=True)
        if {owner.slave, owner.master} == {wish.actor, wish.object}
    )
    lift = Lift(grips, one)
    heavy, room = lift.weighed.weight, max(most, 1e-6)
    found = gentlest_grip(lift, 0.0, room, weight=heavy, friction=friction, start=min(_START, room), tolerance=_NEAR)
    taken = lift.taken(found.grip) if found.status in _HELD else None
    instant = grips.closed(found.grip).last if taken is None else taken[1]
    text = f"{heavy:.3g} N of {wish.object}: {found.text}"
    if taken is not None:
        text += f"; the digits close on by {math.degrees(found.grip):.2f}°"
    text += f"; {found.ended}"
    effort = grips.effort(found.grip, instant) if instant.touches else None
    rows = [
        _row(wish, grip, trial.force, trial.share, trial.who, grip == found.grip, found.status.name)
        | {"outcome": trial.outcome.name, "held": int(trial.held), "sliding": trial.sliding, "borne": trial.borne}
        for grip, trial in found.trials
    ]
    grip, lowered = (0.0, None) if taken is None else (found.grip, taken[0])
    digits = _digits(effort, wish)
    return FoundGrip(wish, found.status.name, text, grip, lowered, found.trial.force, digits, tuple(rows))


def _firm(wish: GripWish, grips: Tightening, most: float) -> FoundGrip:
    assert wish.force is not None
    counted = wish.digits or tuple(dict.fromkeys(channel.split(".")[-3] for channel in wish.channels))
    instants: dict[float, ContactInstant] = {}

    def press(grip: float) -> Firmness | None:
        closed = grips.closed(grip)
        if not closed.converged:
            return None
        instants[grip] = closed.last
        effort = grips.effort(grip, closed.last)
        worst = max(effort.digits, key=lambda digit: digit.share)
        mine = sum(d.force for d in effort.digits if d.digit.rpartition(".")[2] in counted)
        return Firmness(mine, worst.share, worst.digit)

    found = grip_of_force(press, 0.0, max(most, 1e-6), wish.force, start=min(_START, max(most, 1e-6)))
    text = f"{' + '.join(counted)}: {found.text}"
    if found.status is FirmStatus.REACHED:
        text += f"; they close on by {math.degrees(found.grip):.2f}°"
    instant = instants.get(found.grip)
    effort = grips.effort(found.grip, instant) if instant is not None else None
    rows = [
        _row(wish, grip, one.force, one.share, one.who, grip == found.grip, found.status.name)
        for grip, one in found.trials
    ]
    force = found.firmness.force if found.firmness is not None else 0.0
    return FoundGrip(wish, found.status.name, text, found.grip, None, force, _digits(effort, wish), tuple(rows))


def _digits(effort: Effort | None, wish: GripWish) -> dict[str, tuple[float, float, float]]:
    """Digits that press."""
    if effort is None:
        return {}
    least = _PRESSES * max(d.force for d in effort.digits)
    return {d.digit: (d.force, d.limit, d.share) for d in effort.digits if d.force > least}


def _row(
    wish: GripWish, grip: float, force: float, share: float, who: str, chosen: bool, status: str
) -> dict[str, Any]:
    return {
        "actor": wish.actor,
        "object": wish.object,
        "frame": wish.first,
        "grip_deg": round(math.degrees(grip), 5),
        "force_n": force,
        "share": share,
        "digit": who,
        "chosen": int(chosen),
        "status": status,
    }


def write_grips(path: Path, found: list[FoundGrip]) -> None:
    """Every grip that was tried as CSV, one row each."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, _COLUMNS, restval="")
        writer.writeheader()
        for one in found:
            writer.writerows({key: _short(value) for key, value in row.items()} for row in one.rows)


def _short(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if math.isnan(value) else f"{value:.6g}"
