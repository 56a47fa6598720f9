"""TOUCH on random poses: faces that cross before and after, the largest leap in time, and what a frame costs.

    python -m tests.benchmarks.touch [--rigs webxr,anny_hand] [--kinds single,curls,fist,limbs] [--count 24]

Poses are drawn anew by a seed, so none was chosen; a leap is what is left of the largest step of a closing motion when
the two frames around it come ever closer.
"""

from __future__ import annotations

import time

import click
import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.skin.rigs import RIGS, load
from warpjld.covering import Covering
from warpjld.covering.intersections import crossing_faces
from warpjld.covering.pose_sets import CURL
from warpjld.runtime.quiet import silence_warp
from warpjld.skeleton import CHANNELS, Skeleton, poses_from_angles
from warpjld.touch import Touch

__all__ = ["KINDS", "crossing_before_and_after", "largest_leap", "random_angles"]

KINDS = ("single", "curls", "fist", "limbs")
_FINGERS = ("index", "middle", "ring", "pinky")
_FIST = {"base": 80.0, "knuckle2": 97.0, "knuckle3": 63.0}
_THUMB = {"base": 15.0, "knuckle2": 40.0, "knuckle3": 50.0}


def random_angles(skeleton: Skeleton, kind: str, count: int, seed: int) -> NDArray[np.float64]:
    """Angles [rad] of one hand, and of one arm and leg: the left where there are two; shape (count, J, channels).

    ``single``: one finger curled by .5 to 1.1; ``curls``: all digits, each differently; ``fist``: all bent to .85 to
    1.1 of a fist, the thumb across; ``limbs``: elbow and knee bent by 60 to 150 degrees.
    """
    draw = np.random.default_rng(seed).uniform
    side = "left" if any(n.startswith("left.") for n in skeleton.names) else "right"
    numbers = {name: j for j, name in enumerate(skeleton.names)}
    out = np.zeros((count, len(skeleton), len(CHANNELS)))
    for frame in out:

        def put(joint: str, degrees: float, channel: str = "flexion", frame: NDArray[np.float64] = frame) -> None:
            number = numbers.get(f"{side}.{joint}")
            if number is not None and skeleton.children[number]:
                frame[number, CHANNELS.index(channel)] = np.radians(degrees)

        if kind == "single":
            finger, amount = _FINGERS[int(draw(0, 4))], draw(0.5, 1.1)
            for joint, full in CURL.items():
                put(f"{finger}.{joint}", amount * full)
        elif kind == "curls":
            for finger in _FINGERS:
                amount = draw(0.2, 1.05)
                for joint, full in CURL.items():
                    put(f"{finger}.{joint}", float(np.clip(amount + draw(-0.2, 0.2), 0.0, 1.1)) * full)
                put(f"{finger}.base", draw(-8, 8), "abduction")
            put("thumb.base", draw(-5, 20))
            put("thumb.base", draw(-25, 15), "abduction")
            put("thumb.knuckle2", draw(0, 45))
            put("thumb.knuckle3", draw(0, 60))
        elif kind == "fist":
            amount = draw(0.85, 1.1)
            for finger in _FINGERS:
                for joint, full in _FIST.items():
                    put(f"{finger}.{joint}", amount * full * draw(0.95, 1.05))
            for joint, full in _THUMB.items():
                put(f"thumb.{joint}", amount * full)
        else:
            put("elbow", draw(60, 150))
            put("elbow", draw(-40, 40), "twisting")
            put("knee", draw(60, 150))
            put("hip", draw(0, 100))
            put("wrist", draw(-60, 60))
    return out


def crossing_before_and_after(covering: Covering, touch: Touch, angles: NDArray[np.float64]) -> NDArray[np.int64]:
    """Faces that cross others, more than at rest, before and after parting, shape (F, 2)."""
    poses = poses_from_angles(covering.skeleton, angles)
    before = covering.deform(poses)
    both = zip(before, touch.apply(before, poses)[0], strict=True)
    faces = covering.surface.faces
    return np.array(
        [[len(np.unique(touch.new_crossings(crossing_faces(p, faces).pairs))) for p in pair] for pair in both]
    )


def largest_leap(
    covering: Covering, touch: Touch, angles: NDArray[np.float64], *, frames: int = 48, times: int = 10
) -> tuple[float, float]:
    """Of the displacement while angles (J, channels) are taken from .3 to 1 of themselves: the largest step of a vertex
    between two of so many frames [m], and what is left of it when that step is halved so many times, into the half
    that moves more each time."""

    def shift(amounts: NDArray[np.float64]) -> NDArray[np.float64]:
        poses = poses_from_angles(covering.skeleton, amounts[:, None, None] * angles)
        points = covering.deform(poses)
        return np.asarray(touch.apply(points, poses)[0] - points, dtype=np.float64)

    def steps(amounts: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.linalg.norm(np.diff(shift(amounts), axis=0), axis=2).max(axis=1))

    amounts = np.linspace(0.3, 1.0, frames + 1)
    found = steps(amounts)
    left = 0.0
    for k in np.argsort(found)[::-1][:3].tolist():
        low, high, last = amounts[k], amounts[k + 1], found[k]
        for _ in range(times):
            middle = 0.5 * (low + high)
            first, second = steps(np.array([low, middle, high]))
            low, high = (low, middle) if first >= second else (middle, high)
            last = max(first, second)
        left = max(left, float(last))
    return float(found.max()), left


@click.command()
@click.option("--rigs", default="webxr,anny_hand,godot_low", help=f"Of {', '.join(RIGS)}.")
@click.option("--kinds", default=",".join(KINDS), help=f"Of {', '.join(KINDS)}.")
@click.option("--count", default=24, help="Poses of each kind; a third of them for leaps.")
def main(rigs: str, kinds: str, count: int) -> None:
    """Print the table in Markdown."""
    silence_warp()
    print("| rig | poses | faces crossing | after | worse in | by | largest step [mm] | leap [mm] | ms a frame |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in rigs.split(","):
        bench = load(name)
        if bench is None:
            continue
        covering, touch = bench.covering, Touch.of(bench.covering)
        for kind in kinds.split(","):
            if kind == "limbs" and not bench.is_body:
                continue
            angles = random_angles(covering.skeleton, kind, count, seed=1)
            before, after = crossing_before_and_after(covering, touch, angles).T
            worse = after - before
            some = random_angles(covering.skeleton, kind, max(count // 3, 2), seed=2)
            leaps = np.array([largest_leap(covering, touch, one) for one in some]).max(axis=0)
            poses = poses_from_angles(covering.skeleton, angles)
            points = covering.deform(poses)
            start = time.process_time()
            touch.apply(points, poses, threads=1)
            took = 1e3 * (time.process_time() - start) / count
            print(
                f"| {name} | {count} {kind} | {before.sum()} | {after.sum()} | {(worse > 0).sum()} | "
                f"{max(worse.max(), 0)} | {1e3 * leaps[0]:.2f} | {1e3 * leaps[1]:.3f} | {took:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
