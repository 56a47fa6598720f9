"""Placements of an open hand drawn at random: across what fits between thumb and fingers, or palm first."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.geometry.rotations import unit
from warpjld.grasp.digits import digit_chains
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.obstacles import Obstacles
from warpjld.grasp.opening import Opening, closing_in_air
from warpjld.grasp.palm import palm_of
from warpjld.grasp.placements import Candidates, across_widths, around, sample_wrists
from warpjld.grasp.postures import AHEAD, CLOSING, POSTURES, posture_angles
from warpjld.grasp.ways import free_ways
from warpjld.grasp.widths import Widths, sample_widths
from warpjld.skeleton import CHANNELS, DIGITS

__all__ = ["WAY", "Draws", "preference"]

WAY = 0.12
"""How far off a hand is before it comes straight to its placement [m]."""

_LINES = 400  # through the object, to find where it is narrow
_PALM_FIRST = 0.25  # share of the placements that are made palm first
_VARIANTS = 6  # of a posture
_MOST_DRAWS = 8  # where obstacles are in the way
_COMES = (0.0, 0.1, 0.3, 0.6, 1.0)  # parts of the way at which a hand must not be in an obstacle


@dataclass(eq=False)
class Draws:
    """Placements for one object, as many as asked for.

    Attributes:
        covering: The hand.
        near: The object.
        obstacles: What no hand may enter on its way to its placement.
        side: Which hand.
        posture: Name of the posture.
        rng: Source of randomness.
        turned_down: Placements that obstacles were in the way of, so far.
    """

    covering: Covering
    near: NearObject
    obstacles: Obstacles
    side: str
    posture: str
    rng: np.random.Generator
    turned_down: int = 0

    @cached_property
    def start(self) -> NDArray[np.float64]:
        """Angles of the posture [rad], shape (J, 4)."""
        return posture_angles(self.covering.skeleton, self.side, self.posture)

    @cached_property
    def closing(self) -> list[str]:
        """Digits that close, without side."""
        there = digit_chains(self.covering.skeleton)
        return [digit for digit in CLOSING.get(self.posture, DIGITS) if f"{self.side}.{digit}" in there]

    @cached_property
    def widest(self) -> float:
        """How far thumb and fingers open in any posture [m]."""
        return max(float(one.width[0]) for one in self._in_air)

    @cached_property
    def least(self) -> float:
        """Least distance of thumb and fingers when they close, in any posture [m]."""
        return min(float(one.width.min()) for one in self._in_air)

    @cached_property
    def _in_air(self) -> list[Opening]:
        """All postures, closing on nothing."""
        starts = np.array([posture_angles(self.covering.skeleton, self.side, posture) for posture in POSTURES])
        return closing_in_air(self.covering, self.side, starts, self.closing)

    def narrowest(self, friction: float) -> float:
        """Least of some widths of the object that friction holds between two contacts [m]; its size without any."""
        size = float(np.linalg.norm(self.near.thing.size))
        # of its own randomness: what is drawn later does not depend on it
        found = sample_widths(self.near, _LINES, np.random.default_rng(0), widest=size)
        return float(found.width[found.slant >= np.cos(np.arctan(friction))].min(initial=size))

    def draw(self, count: int) -> Candidates:
        """``count`` placements, or fewer where obstacles leave little room."""
        some = [self._both_kinds(count)]
        if not self.obstacles:
            return some[0]
        some[0] = self._reached(some[0])
        while sum(map(len, some)) < count and len(some) < _MOST_DRAWS:
            some.append(self._reached(self._both_kinds(count)))
        return Candidates.joined(some)[:count]

    def _reached(self, hands: Candidates) -> Candidates:
        """Those that come to their placement without entering an obstacle."""
        skins = self.covering.deform(hands.poses(self.covering.skeleton))
        backs = WAY * np.array(_COMES, dtype=np.float32)[:, None, None]
        shifts = -backs * hands.approach.astype(np.float32)
        there = (skins + shifts[:, :, None]).reshape(-1, *skins.shape[1:])
        clear = self.obstacles.missed(there).reshape(len(_COMES), -1).all(axis=0)
        self.turned_down += int((~clear).sum())
        return hands[np.flatnonzero(clear)]

    def _both_kinds(self, count: int) -> Candidates:
        openings = self._variants()
        most = max(one.width[0] for one in openings)
        widths = sample_widths(self.near, _LINES, self.rng, widest=float(most))
        across = count - int(_PALM_FIRST * count) if len(widths) else 0
        some = []
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
            these = Widths(*ends, picked.slant)
            some.append(
                across_widths(self.covering, openings, self.near, these, ways[chosen], self.side, self.rng, into=into)
            )
        if count > across:
            ahead = AHEAD.get(self.posture, 0.0)
            some.append(
                sample_wrists(self.covering, self.start, self.near, self.side, count - across, self.rng, ahead=ahead)
            )
        return Candidates.joined(some)

    def _variants(self) -> list[Opening]:
        """The posture as it is, and with thumb and fingers a little elsewhere."""
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
    """How likely a width is taken: straight through, and near the centre of mass."""
    centre = thing.place.apply(thing.centroid[None])[0, 0]
    off = np.linalg.norm(0.5 * (widths.first + widths.second) - centre, axis=1)
    radius = np.linalg.norm(thing.vertices - thing.centroid, axis=1).max()
    weight = widths.slant**4 * np.exp(-((off / (0.4 * radius)) ** 2)) + 1e-6
    return np.asarray(weight / weight.sum())
