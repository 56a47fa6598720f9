"""One trial of a grasp study: a wrist is drawn beside the object, the hand closes, the grasp is measured."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.grasp.close import close_hand
from warpjld.grasp.intersection import intersection
from warpjld.grasp.quality import contact_patches, force_closure, gravity_displacement, wrench_space
from warpjld.skeleton import CHANNELS, DIGITS, Poses, poses_from_angles
from warpjld.study.columns import Column
from warpjld.study.experiment import Outcome
from warpjld.study.grasping.columns import GRASP_COLUMNS
from warpjld.study.grasping.load import Hand, Thing, hand_of, thing_of
from warpjld.study.grasping.plan import GraspPlan
from warpjld.study.grasping.wrist import draw_approach, place_palm, touch_along

__all__ = ["GraspExperiment"]

Array = NDArray[np.float64]

_CLEAR = 5e-4  # the open hand starts at least this far from the object [m]
_BACKED_OFF = 0.25  # a palm that cannot come nearer than this is not beside the object [m]


@dataclass(frozen=True)
class GraspExperiment:
    """The experiment of a plan, for `warpjld.study.run_study`."""

    settings: GraspPlan

    columns: ClassVar[tuple[Column, ...]] = GRASP_COLUMNS
    success: ClassVar[str] = "success"
    shown: ClassVar[tuple[str, ...]] = ("penetration", "epsilon", "area", "volume", "displacement", "overlap")
    groups: ClassVar[tuple[str, ...]] = ("hand", "object", "scale", "friction")

    @property
    def trials(self) -> int:
        """How many."""
        return self.settings.trials

    @property
    def seed(self) -> int:
        """Of the study."""
        return self.settings.seed

    def identity(self) -> dict[str, Any]:
        """See `GraspPlan.identity`."""
        return self.settings.identity()

    def plan(self, trial: int) -> dict[str, Any]:
        """What is known beforehand."""
        hand, thing, scale, friction = self.settings.combination(trial)
        return {"hand": hand.name, "object": thing.name, "scale": scale, "friction": friction}

    def check(self) -> list[str]:
        """Load everything once: better now than in the middle of a study. Returns what is worth knowing.

        Raises:
            InputError: A hand or object cannot be used.
        """
        notes = []
        for hand in self.settings.hands:
            notes += [f"{hand.name}: {note}" for note in hand_of(hand).rig.notes]
        for thing in self.settings.objects:
            for scale in self.settings.scales:
                loaded = thing_of(thing, scale, self.settings.measuring.density)
            notes += [f"{thing.name}: {note}" for note in loaded.body.report.notes()]
        return notes

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Place, close, measure."""
        choice, wanted, scale, friction = self.settings.combination(trial)
        hand, thing = hand_of(choice), thing_of(wanted, scale, self.settings.measuring.density)
        skeleton = hand.rig.skeleton
        approach = draw_approach(self.settings.wrist, rng, thing.body.size)
        values: dict[str, Any] = dict(zip(("approach_x", "approach_y", "approach_z"), approach.direction, strict=True))
        values |= {"gap": approach.gap, "tilt": approach.tilt}
        start = approach.aim + 4.0 * thing.radius * approach.direction
        way = touch_along(thing.objects, start, -approach.direction, 8.0 * thing.radius)
        if way is None:
            return Outcome("missed", values, message="the line of approach passes beside the object")
        point = start + (approach.gap - way) * approach.direction
        turn, shift = place_palm(hand.palm, approach, point)
        back = self._room(hand, thing, turn, shift, approach.direction)
        if back is None:
            return Outcome("no room", values, message="the open hand does not fit beside the object")
        values["gap"] = approach.gap + back
        shift = shift + back * approach.direction
        opened = np.zeros((1, len(skeleton), len(CHANNELS)))
        root = skeleton.rest[0]
        position, rotation = (turn @ root + shift - root)[None], Rotation.from_matrix(turn).as_quat()[None]

        def posed(angles: Array) -> Poses:
            return poses_from_angles(skeleton, angles, root_position=position, root_rotation=rotation)

        closed = close_hand(hand.covering, posed(opened), opened, thing.objects, digits=self.settings.digits, threads=1)
        angles = closed.angles[0]
        poses = posed(closed.angles)
        vertices = np.asarray(hand.covering.deform(poses, threads=1)[0], dtype=np.float64)
        wrist = poses.positions[0, skeleton.index("wrist")]
        values |= dict(zip(("wrist_x", "wrist_y", "wrist_z"), wrist, strict=True))
        values |= self._measured(hand, thing, vertices, friction)
        arrays = {
            f"{choice.name}/angles": angles,
            f"{choice.name}/root_position": position[0],
            f"{choice.name}/root_rotation": rotation[0],
        }
        return Outcome("closed" if closed.touching().any() else "no contact", values, arrays)

    def _room(self, hand: Hand, thing: Thing, turn: Array, shift: Array, away: Array) -> float | None:
        """How far the open hand must be moved away until it is clear of the object [m]; None if too far."""
        skin, back = hand.rig.surface.vertices @ turn.T + shift, 0.0
        for _ in range(60):
            nearest = float(thing.objects.distances(skin + back * away, threads=1).distance.min())
            if nearest >= _CLEAR:
                return back
            back += _CLEAR - nearest + 1e-4
            if back > _BACKED_OFF:
                return None
        return None

    def _measured(self, hand: Hand, thing: Thing, vertices: Array, friction: float) -> dict[str, Any]:
        body, how, faces = thing.body, self.settings.measuring, hand.rig.surface.faces
        found = thing.objects.distances(vertices, nearest=True, threads=1)
        assert found.point is not None
        distance = found.distance[0].astype(np.float64)
        patches = contact_patches(
            vertices, faces, hand.parts, hand.names, distance, found.point[0], body.normals[found.face[0]],
            tolerance=how.contact,
        )  # fmt: skip
        contacts, center = patches.contacts(friction), body.centroid
        scale = how.torque_scale or thing.radius
        closure = force_closure(contacts, center, torque_scale=scale, edges=how.edges)
        space = wrench_space(contacts, center, torque_scale=scale, norm=how.norm, edges=how.edges)
        gravity = gravity_displacement(
            contacts, center, mass=thing.mass, torque_scale=scale, squeeze=how.squeeze, edges=how.edges,
            normal_stiffness=how.normal_stiffness, tangential_stiffness=how.tangential_stiffness,
        )  # fmt: skip
        inside = intersection(hand.covering, vertices.astype(np.float32), body)
        areas = dict.fromkeys((*DIGITS, "palm"), 0.0)
        for digit, area in zip(patches.digits, patches.areas, strict=True):
            areas["palm" if digit == "carpus" else digit] += float(area)
        worst = gravity.worst
        firm = how.displacement is None or worst <= how.displacement
        return {
            "contacts": len(patches),
            "digits": sum(areas[digit] > 0.0 for digit in DIGITS),
            "area": float(patches.areas.sum()),
            **{f"area_{part}": area for part, area in areas.items()},
            "penetration": inside.deepest,
            "overlap": inside.volume,
            "closed": closure.closed,
            "margin": closure.margin,
            "epsilon": space.epsilon,
            "volume": space.volume,
            "torque_scale": scale,
            "mass": thing.mass,
            "displacement": worst if np.isfinite(worst) else None,
            "held": int(gravity.held.sum()),
            "success": bool(closure.closed and inside.deepest <= how.penetration and firm),
        }

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """Three views of the closed hand on its object."""
        from warpjld.study.grasping.pictures import draw_grasp

        return draw_grasp(self.settings, trial, outcome, folder)
