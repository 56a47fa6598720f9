"""All measures of one grasp, as columns of the table."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.both_ways import BothWays
from warpjld.grasp.quality import (
    ContactPatches,
    force_closure,
    gravity_displacement,
    penetration,
    wrench_space,
)
from warpjld.grasp.touching import touching_patches
from warpjld.skeleton import DIGITS
from warpjld.study.grasping.load import Hand, Thing
from warpjld.study.grasping.plan import Measuring

__all__ = ["measure_grasp"]


def measure_grasp(
    hand: Hand, thing: Thing, both: BothWays, vertices: NDArray[np.float32], friction: float, how: Measuring
) -> tuple[dict[str, Any], ContactPatches]:
    """Columns of the table, and the patches of contact; definitions are in `warpjld.grasp.quality`, one a measure.

    Args:
        hand: Whose skin.
        thing: What is held.
        both: The two beside one another.
        vertices: The deformed skin [m], shape (V, 3), in the object's frame.
        friction: Coulomb coefficient.
        how: Settings.
    """
    body, scale = thing.body, how.torque_scale or thing.radius
    patches, deepest = touching_patches(hand.finer, hand.parts, both.near, vertices, how.contact)
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
    )
    inside = penetration(both, vertices)
    skin_inside = max(inside.skin, deepest)
    areas = dict.fromkeys((*DIGITS, "palm"), 0.0)
    for digit, area in zip(patches.digits, patches.areas, strict=True):
        areas[digit if digit in DIGITS else "palm"] += float(area)
    firm = how.displacement is None or gravity.worst <= how.displacement
    values = {
        "contacts": len(patches),
        "digits": sum(areas[digit] > 0.0 for digit in DIGITS),
        "area": float(patches.areas.sum()),
        **{f"area_{part}": area for part, area in areas.items()},
        "penetration": max(skin_inside, inside.thing),
        "skin_inside": skin_inside,
        "object_inside": inside.thing,
        "overlap": inside.volume,
        "closed": closure.closed,
        "margin": closure.margin,
        "epsilon": space.epsilon,
        "volume": space.volume,
        "torque_scale": scale,
        "mass": thing.mass,
        "displacement": gravity.worst if np.isfinite(gravity.worst) else None,
        "held": int(gravity.held.sum()),
        "success": bool(closure.closed and max(skin_inside, inside.thing) <= how.penetration and firm),
    }
    return values, patches
