"""All metrics of one grasp, as values of the table's columns."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.grasp.quality import (
    SIX_DIRECTIONS,
    force_closure,
    gravity_displacement,
    penetration,
    self_penetration,
    wrench_space,
)
from warpjld.skeleton import DIGITS
from warpjld.study.grasping.load import Hand, Thing
from warpjld.study.grasping.plan import Measuring
from warpjld.study.grasping.tried import TouchingSkin

__all__ = ["measure_grasp"]

_DOWN = int((SIX_DIRECTIONS @ [0.0, -1.0, 0.0]).argmax())


def measure_grasp(
    hand: Hand, thing: Thing, both: HandObjectGaps, touching: TouchingSkin, friction: float, how: Measuring
) -> dict[str, Any]:
    """Measure a grasp; `warpjld.grasp.quality` defines the metrics, one per file.

    Args:
        hand: The hand.
        thing: The object.
        both: Distances between the two.
        touching: The hand's skin, with the contacts of ``how.contact``.
        friction: Coulomb coefficient.
        how: Settings.

    Returns:
        Values by column.
    """
    body, scale = thing.body, how.torque_scale or thing.radius
    patches, vertices = touching.patches, touching.skin
    contacts, center = patches.contacts(friction), body.centroid
    closure = force_closure(contacts, center, torque_scale=scale, edges=how.edges)
    space = wrench_space(contacts, center, torque_scale=scale, norm=how.norm, edges=how.edges)
    gravity = gravity_displacement(
        contacts,
        center,
        mass=thing.mass,
        torque_scale=scale,
        squeeze=how.squeeze,
        normal_stiffness=how.normal_stiffness,
        tangential_stiffness=how.tangential_stiffness,
        edges=how.edges,
        closure=closure,
    )
    inside = penetration(both, vertices)
    skin_inside = max(inside.skin, touching.deepest)
    areas = dict.fromkeys((*DIGITS, "palm"), 0.0)
    for digit, area in zip(patches.digits, patches.areas, strict=True):
        areas[digit if digit in DIGITS else "palm"] += float(area)
    firm = how.displacement is None or gravity.worst <= how.displacement
    return {
        "contacts": len(patches),
        "digits": sum(areas[digit] > 0.0 for digit in DIGITS),
        "area": float(patches.areas.sum()),
        **{f"area_{part}": area for part, area in areas.items()},
        "penetration": max(skin_inside, inside.thing),
        "skin_inside": skin_inside,
        "object_inside": inside.thing,
        "overlap": inside.volume,
        "self_penetration": self_penetration(hand.covering, vertices),
        "touching": " ".join(part for part in (*reversed(DIGITS), "palm") if areas[part] > 0.0),
        "closed": closure.closed,
        "margin": closure.margin,
        "epsilon": space.epsilon,
        "volume": space.volume,
        "torque_scale": scale,
        "mass": thing.mass,
        "displacement": gravity.worst if np.isfinite(gravity.worst) else None,
        "held": int(gravity.held.sum()),
        "lift": float(gravity.lift[_DOWN]),
        "lift_least": float(gravity.lift.min()),
        "success": bool(closure.closed and max(skin_inside, inside.thing) <= how.penetration and firm),
    }
