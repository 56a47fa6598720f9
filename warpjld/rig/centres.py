"""Position of joints relative to the centre of the flesh around them, and rigs with joints moved to that centre.

A finger or limb that bends about a joint near its skin stretches on one side and crumples on the other. In anatomy no
joint is exactly in the middle, so only clear deviations are reported, and joints are moved on request only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.rig import Rig
from warpjld.skeleton.initial import bent_as_before
from warpjld.skeleton.recognise.placing.sections import in_trunk
from warpjld.skeleton.recognise.section import cross_section, nearby
from warpjld.skeleton.tree import Skeleton

__all__ = ["OFF_CENTRE", "OffCentre", "joint_centres", "with_centred_joints"]

OFF_CENTRE = 0.2
"""Deviation from the centre, relative to the flesh's thickness, above which a joint counts as off centre: a body's
elbows and knees deviate by up to a sixth."""
_RAYS = 72  # directions around the bone: one every 5 degrees
_ALL_ROUND = 0.97  # share of directions in which a surface must be hit, which excludes open ends
_STUBBY = 0.6  # radius relative to the shorter segment above which a section includes more than a finger or limb


@dataclass(frozen=True, eq=False)
class OffCentre:
    """A joint and the flesh around it, in the plane halfway between its two segments.

    Attributes:
        joint: Its index.
        name: Its canonical name.
        middle: Centroid of the cross-section of the flesh [m], shape (3,).
        distance: Distance of the joint from it [m].
        thickness: Diameter of the circle of the section's area [m].
    """

    joint: int
    name: str
    middle: NDArray[np.float64]
    distance: float
    thickness: float

    @property
    def off(self) -> bool:
        """Whether the joint is clearly off centre."""
        return self.distance > OFF_CENTRE * self.thickness

    @property
    def message(self) -> str:
        """One line for the user."""
        return (
            f"{self.name} lies {1e3 * self.distance:.1f} mm off the middle of its flesh, "
            f"which is {1e3 * self.thickness:.1f} mm thick there"
        )


def joint_centres(skeleton: Skeleton, vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> tuple[OffCentre, ...]:
    """Position of the joints of fingers and limbs in the cross-section of their flesh.

    Only joints between two segments neither of which branches: not the trunk's, and not a finger's base, whose section
    runs through the palm. Joints outside the flesh, or where it is open or nearly as wide as a segment is long, are
    left out.

    Args:
        skeleton: Rest skeleton.
        vertices: Rest surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
    """
    out = []
    palm = {joint for pairs in skeleton.palms for pair in pairs for joint in pair}
    for j, name in enumerate(skeleton.names):
        above = int(skeleton.parents[j])
        if above < 0 or len(skeleton.children[j]) != 1 or len(skeleton.children[above]) != 1:
            continue
        if j in palm or in_trunk(name):
            continue
        place = skeleton.rest[j]
        before, after = place - skeleton.rest[above], skeleton.rest[skeleton.children[j][0]] - place
        lengths = [float(np.linalg.norm(v)) for v in (before, after)]
        if min(lengths) < 1e-9:
            continue
        halfway = unit(before) + unit(after)
        if np.linalg.norm(halfway) < 0.2:  # segments folded back on each other have no bisecting plane
            continue
        around = nearby(vertices, faces, place, 3.0 * max(lengths))
        section = cross_section(vertices, around, place, unit(halfway), rays=_RAYS)
        if section is None or section.seen < _ALL_ROUND or section.radius > _STUBBY * min(lengths):
            continue
        distance = float(np.linalg.norm(section.centre - place))
        out.append(OffCentre(j, name, section.centre, distance, 2.0 * section.radius))
    return tuple(out)


def with_centred_joints(rig: Rig) -> Rig:
    """The rig with each joint that is clearly off centre moved to the centre of its flesh.

    Joints of the source tree stay, since the rigid motion of a bone does not depend on which point it is expressed
    about. So the file's own animations move a moved joint with the bone that begins at it, and motions given by angles
    turn the bone about the moved joint.
    """
    rest = rig.skeleton.rest.copy()
    moved = [found for found in joint_centres(rig.skeleton, rig.surface.vertices, rig.surface.faces) if found.off]
    for found in moved:
        rest[found.joint] = found.middle
    notes = tuple(
        f"{found.name} is moved by {1e3 * found.distance:.1f} mm to the middle of its flesh" for found in moved
    )
    skeleton = bent_as_before(rig.skeleton, replace(rig.skeleton, rest=rest))
    return replace(rig, skeleton=skeleton, notes=(*rig.notes, *notes))
