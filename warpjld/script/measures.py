"""Texts of SHOW DISTANCE and SHOW INTERSECTION: vertex to facet, segment in object (A §7.1, §7.2, R73, R75, R132)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpjld.script.binding import cover
from warpjld.script.grasping import placed_at
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.script.facets import Facet
    from warpjld.script.props import Prop
    from warpjld.script.scene import Actor, Scene

__all__ = ["distance", "intersection_text"]


def distance(scene: Scene, actor: Actor, frame: float, vertex: int, prop: Prop, facet: Facet) -> str:
    """Text with the coordinates of a vertex in the basis of a facet at a frame: y along the normal, negative behind."""
    covering = cover(actor)
    point = covering.points(stage(actor, np.array([frame]), scene.rate), [vertex])[0, 0].astype(np.float64)
    (x, y, z), inside = facet.coordinates(point, placed_at(scene, prop, frame))
    side = "behind" if y < 0.0 else "before"
    return (
        f"{actor.name} vertex {actor.rig.surface.numbers[vertex]} in the basis of {prop.name} facet {facet.number} at "
        f"frame {frame:g}: x {1e3 * x:.3f} mm, y {1e3 * y:.3f} mm, z {1e3 * z:.3f} mm; {side} its plane, "
        f"{'over the facet' if inside else 'beside the facet'}"
    )


def intersection_text(scene: Scene, actor: Actor, frame: float, part: str, prop: Prop) -> str:
    """Text with the vertices of a segment that lie in an object at a frame, deepest first, with their depths.

    Raises:
        InputError: There is no such segment.
    """
    from warpjld.grasp.intersection import intersection as intersect

    covering = cover(actor)
    skin = covering.deform(stage(actor, np.array([frame]), scene.rate))[0]
    found = intersect(covering, skin, placed_at(scene, prop, frame), part=part)
    lines = [f"{actor.name} {part} in {prop.name} at frame {frame:g}: {found}"]
    for k in np.argsort(-found.depths, kind="stable"):
        number = actor.rig.surface.numbers[found.vertices[k]]
        lines.append(f"  vertex {number:>7}  {1e3 * found.depths[k]:>9.3f} mm")
    return "\n".join(lines)
