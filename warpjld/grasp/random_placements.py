"""Random placements of an open hand: thumb and fingers across a part that fits between them, or palm first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.geometry.rotations import unit
from warpjld.grasp.approach_directions import free_ways
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.obstacles import Obstacles
from warpjld.grasp.opening import Opening, OpeningsOfPostures, closing_in_air
from warpjld.grasp.palm import palm_of
from warpjld.grasp.placements import Candidates, across_widths, around, sample_wrists
from warpjld.grasp.postures import AHEAD, CLOSING, posture_angles
from warpjld.grasp.widths import Widths, sample_widths
from warpjld.skeleton import CHANNELS, DIGITS

__all__ = ["WAY", "Draws", "preference"]

WAY = 0.12
"""Length of the straight approach of an open hand to its placement, on which it may not collide [m]."""

_LINES = 400  # random lines through the object, to find where it is narrow
_PALM_FIRST = 0.25  # share of the placements that are made palm first
_VARIANTS = 6  # random variants of a posture
_MOST_DRAWS = 8  # repetitions where obstacles are in the way
_COMES = (0.0, 0.1, 0.3, 0.6, 1.0)  # distances back along the approach, in units of WAY, at which collisions are tested


@dataclass(eq=False)
class Draws:
    """Sampler of placements of one hand in one open posture around one object.

    Attributes:
        covering: The hand.
        near: The object.
        obstacles: Objects that the hand may not enter on its approach.
        side: ``left`` or ``right``.
        posture: Name of the posture.
        rng: Source of random numbers.
        turned_down: Number of placements rejected so far because of obstacles.
        digits: Names of the only digits that close, without side; empty: those of the posture.
    """

    covering: Covering
    near: NearObject
    obstacles: Obstacles
    side: str
    posture: str
    rng: np.random.Generator
    turned_down: int = 0
    digits: Sequence[str] = ()

    @cached_property
    def start(self) -> NDArray[np.float64]:
        """Angles of the posture [rad], shape (J, 4)."""
        return posture_angles(self.covering.skeleton, self.side, self.posture)

    @cached_property
    def closing(self) -> list[str]:
        """Names of the digits that close, without side: those that were named, or those of the posture."""
        there = digit_chains(self.covering.skeleton)
        wanted = self.digits or CLOSING.get(self.posture, DIGITS)
        return [digit for digit in wanted if f"{self.side}.{digit}" in there]

    @cached_property
    def widest(self) -> float:
        """Largest opening between thumb and fingers in any posture [m]."""
        return max(float(one.width[0]) for one in self._in_air)

    @cached_property
    def least(self) -> float:
        """Smallest distance between thumb and fingers while they close, in any posture [m]."""
        return min(float(one.width.min()) for one in self._in_air)

    @cached_property
    def _in_air(self) -> list[Opening]:
        """Opening of the hand in every posture while it closes on nothing."""
        return kept_with(self.covering, OpeningsOfPostures).of(self.side, self.closing)

    def narrowest(self, friction: float) -> float:
        """Smallest sampled width of the object that two contacts with this friction can hold [m].

        The diagonal of its bounding box where there is none.
        """
        size = float(np.linalg.norm(self.near.thing.size))
        # a generator of its own, so that later draws do not depend on whether this was called
        found = sample_widths(self.near, _LINES, np.random.default_rng(0), widest=size)
        return float(found.width[found.slant >= np.cos(np.arctan(friction))].min(initial=size))

    def draw(self, count: int) -> Candidates:
        """Draw ``count`` placements, or fewer where obstacles leave little room."""
        drawn = [self._both_kinds(count)]
        if not self.obstacles:
            return drawn[0]
        drawn[0] = self._reached(drawn[0])
        while sum(map(len, drawn)) < count and len(drawn) < _MOST_DRAWS:
            drawn.append(self._reached(self._both_kinds(count)))
        return Candidates.joined(drawn)[:count]

    def _reached(self, hands: Candidates) -> Candidates:
        """The hands whose straight approach to their placement enters no obstacle."""
        skins = self.covering.deform(hands.poses(self.covering.skeleton))
        backs = WAY * np.array(_COMES, dtype=np.float32)[:, None, None]
        shifts = -backs * hands.approach.astype(np.float32)
        there = (skins + shifts[:, :, None]).reshape(-1, *skins.shape[1:])
        clear = self.obstacles.missed(there).reshape(len(_COMES), -1).all(axis=0)
        self.turned_down += int((~clear).sum())
        return hands[np.flatnonzero(clear)]

    def _both_kinds(self, count: int) -> Candidates:
        """Draw placements, three quarters across widths of the object where there are any, the others palm first."""
        openings = self._variants()
        most = max(one.width[0] for one in openings)
        widths = sample_widths(self.near, _LINES, self.rng, widest=float(most))
        across = count - int(_PALM_FIRST * count) if len(widths) else 0
        drawn = []
        if across:
            middle = palm_of(self.covering.skeleton, self.side).middle
            reach = float(np.mean([np.linalg.norm(one.between[0] - middle) for one in openings]))
            rows, ways = free_ways(self.near, widths, reach, self.rng)
            if not len(rows):
                rows, ways = np.arange(len(widths)), around(unit(widths.second - widths.first), self.rng)
            chosen = self.rng.choice(len(rows), size=across, p=preference(widths[rows], self.near.thing))
            turned = self.rng.random(across) < 0.5
            picked = widths[rows[chosen]]
            ends = (
                np.where(turned[:, None], picked.second, picked.first),
                np.where(turned[:, None], picked.first, picked.second),
            )
            into = 0.3 if self.posture == "pinch" else 1.0
            oriented = Widths(*ends, picked.slant)
            drawn.append(
                across_widths(
                    self.covering, openings, self.near, oriented, ways[chosen], self.side, self.rng, into=into
                )
            )
        if count > across:
            ahead = AHEAD.get(self.posture, 0.0)
            drawn.append(
                sample_wrists(self.covering, self.start, self.near, self.side, count - across, self.rng, ahead=ahead)
            )
        return Candidates.joined(drawn)

    def _variants(self) -> list[Opening]:
        """The posture itself, and random variants of it: thumb pivot and abduction, flexion of the finger bases."""
        skeleton, rng, starts = self.covering.skeleton, self.rng, []
        for variant in range(_VARIANTS):
            angles = self.start.copy()
            if variant:
                bend = rng.uniform(0.0, 20.0)
                shifts = {"thumb.base": {"pivot": rng.uniform(-15, 10), "abduction": rng.uniform(-20, 15)}}
                shifts |= {f"{digit}.base": {"flexion": bend} for digit in self.closing if digit != "thumb"}
                for name, channels in shifts.items():
                    row = skeleton.index(f"{self.side}.{name}")
                    for channel, degrees in channels.items():
                        column = CHANNELS.index(channel)
                        turned = angles[row, column] + np.radians(degrees)
                        angles[row, column] = np.clip(turned, *skeleton.limits[row, column])
            starts.append(angles)
        return closing_in_air(self.covering, self.side, np.array(starts), self.closing)


def preference(widths: Widths, thing: GraspObject) -> NDArray[np.float64]:
    """Probability of every width, shape (N,): larger where it is normal to the surface and near the centre of mass."""
    centre = thing.place.apply(thing.centroid[None])[0, 0]
    off = np.linalg.norm(0.5 * (widths.first + widths.second) - centre, axis=1)
    radius = np.linalg.norm(thing.vertices - thing.centroid, axis=1).max()
    weight = widths.slant**4 * np.exp(-((off / (0.4 * radius)) ** 2)) + 1e-6
    return np.asarray(weight / weight.sum())
