"""Contact solve of a grasp: digits flex until their force on the object holds a given weight (R123)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import WarpjldError
from warpjld.simulation.grip.force import ForceStatus
from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
from warpjld.simulation.report.table import ContactRow
from warpjld.simulation.simulate import Simulation, simulate
from warpjld.simulation.specification import (
    ContactSpecification,
    FleshMaterial,
    GripSpecification,
    SolveSpecification,
    name_pair,
)
from warpjld.skeleton import DIGITS
from warpjld.study.grasping.load import Hand, Thing
from warpjld.study.grasping.pressing import ContactPlan
from warpjld.study.grasping.reach import digits_short_of

__all__ = ["press_grasp"]

Array = NDArray[np.float64]

_HAND, _OBJECT = "hand", "object"
_CLOSING = (0.0, 0.8, 0.95, 1.0, 1.0)
"""Interpolation from the open (0) to the closed hand (1), by frame; contact begins in the last part of it."""
_CLOSED = 3
"""Frame at which the hand is closed; the digits flex further until the next one."""
_KNUCKLES = ("base", "knuckle2", "knuckle3")


def press_grasp(
    hand: Hand,
    thing: Thing,
    start: Array,
    angles: Array,
    position: Array,
    rotation: Array,
    *,
    friction: float,
    weight: float,
    how: ContactPlan,
) -> tuple[dict[str, Any], Array | None, str]:
    """Flex the digits, as ``SQUEEZE … FORCE`` does, until their force is the one that holds a weight.

    Args:
        hand: Hand, whose flesh is meshed.
        thing: Held object; it is rigid and does not move.
        start: Angles of the open hand [rad], shape (J, 4).
        angles: Angles of the closed hand [rad], shape (J, 4).
        position: Displacement of the root from rest [m], shape (3,).
        rotation: Rotation of the root about its rest position, quaternion x, y, z, w.
        friction: Coulomb coefficient of skin on object.
        weight: Weight to be held [N].
        how: Settings.

    Returns:
        Values of the columns by name; contact pressure at the skin's vertices [Pa], shape (V,), None without a
        solution; and a message, which may be empty.
    """
    asked = how.force(weight, friction)
    short = digits_short_of(hand, thing, angles, position, rotation, most=float(np.radians(how.most)))
    values: dict[str, Any] = {"asked_force": asked, "success": False, "without_share": _without_share(short)}
    if len(short) == len(DIGITS):
        return values | {"press": ForceStatus.NO_CONTACT.name}, None, ForceStatus.NO_CONTACT.value
    closing = np.array(_CLOSING)[:, None, None] * (angles - start) + start
    # recorded angles have no rotation of the root: the hand stays at rest, the object gets the inverse placement
    back, root = Rotation.from_quat(rotation).inv(), hand.rig.skeleton.rest[0]
    place = {"positions": root - back.apply(root + position), "rotations": back.as_quat()}
    animation = RecordedAnimation(
        [RecordedActor(_HAND, hand.rig, angles=closing, covering=hand.covering)],
        [RecordedObject(_OBJECT, thing.body, **place)],
    )
    try:
        found = simulate(_specification(hand, asked, friction, how, short), animation)
    except WarpjldError as error:
        return values | {"press": ForceStatus.NO_SOLUTION.name}, None, str(error)
    values["press"] = _ending(found)
    if found.grips:
        values["without_share"] = _without_share(short, found.grips[0].left_out, found.grips[0].on_bone)
    if not found.grips or not len(found.frames) or found.frames[-1] <= _CLOSED:
        return values, None, found.verdict.text
    last = float(found.frames[-1])
    rows = [row for row in found.rows if row.frame == last and row.actor == _HAND]
    pressure = found.visible_pressure(_HAND, last).pressure[: hand.rig.surface.vertices.shape[0]]
    values |= _measured(found, rows)
    reached = values["press"] == ForceStatus.REACHED.name
    values["success"] = reached and how.kept(values["force"], asked=asked)
    message = found.grips[0].text if not values["success"] else ""
    if reached and message:
        message += f"; at the last frame they press with {values['force']:.3g} N"
    return values, np.asarray(pressure), message


def _specification(
    hand: Hand, asked: float, friction: float, how: ContactPlan, short: Mapping[str, float]
) -> ContactSpecification:
    """Specification of the solve; where muscles share, digits that do not reach the object stay as they are."""
    most = float(np.radians(how.most))
    share: Literal["muscles"] | None = "muscles" if how.share == "muscles" else None
    closing = [digit for digit in DIGITS if share is None or digit not in short]
    channels = tuple(f"{hand.side}.{digit}.{knuckle}.flexion" for digit in closing for knuckle in _KNUCKLES)
    grip = GripSpecification(_HAND, _OBJECT, _CLOSED, _CLOSED + 1, channels, most=most, force=asked, share=share)
    return ContactSpecification(
        flesh={_HAND: FleshMaterial(element=how.element, itself=False)},
        friction={name_pair(_HAND, _OBJECT): friction},
        grips=[grip],
        pressing=SolveSpecification(0, _CLOSED + 1, rigid=True),
    )


def _ending(found: Simulation) -> str:
    """Final status: that of the grip if the solver converged, else that of the solver."""
    return found.grips[0].status if found.grips and found.verdict.status == "CONVERGED" else found.verdict.status


def _without_share(short: Mapping[str, float], left_out: Sequence[str] = (), on_bone: Sequence[str] = ()) -> str:
    """Digits that press with less than their share, and why: short of the object, touching, or stopped by a bone."""
    named = [f"{digit} {1e3 * short[digit]:.1f} mm short" for digit in DIGITS if digit in short]
    return ", ".join(
        [
            *named,
            *(f"{digit} {'on bone' if digit in on_bone else 'touching'}" for digit in left_out if digit not in short),
        ]
    )


def _measured(found: Simulation, rows: list[ContactRow]) -> dict[str, Any]:
    """Columns measured at the last solved frame; ``rows``: its rows of the contact table."""
    parts = {row.digit: row for row in rows}
    digits = [parts[digit] for digit in DIGITS if digit in parts]
    worst = max(digits, key=lambda row: row.share)
    last = found.solved.frames[-1]
    return {
        "grip": found.grips[0].grip,
        "force": sum(row.bone_n for row in digits),
        "normal_force": float(last.nodal_contact.force[:, found.model.spans[_HAND]].sum()),
        "pressed_area": 1e-6 * sum(row.area_mm2 for row in rows),
        "peak_pressure": 1e3 * max(row.peak_kpa for row in rows),
        "muscle_share": worst.share,
        "strained": worst.digit,
        **{f"force_{name}": row.force_n for name, row in parts.items()},
        **{f"pressed_area_{name}": 1e-6 * row.area_mm2 for name, row in parts.items()},
        **{f"share_{row.digit}": row.share for row in digits},
    }
