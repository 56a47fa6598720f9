"""Complete grasps a second, stage by stage, beside those of an earlier version: before, after, and what is equal.

    git stash; python tests/benchmarks/grasps.py --save before.npz; git stash pop
    python tests/benchmarks/grasps.py --against before.npz [--hands 32] [--repeats 3]

A complete grasp is a hand that closes from an open posture, digits kept apart, deformed and judged: contacts, force
closure, epsilon, depth. Six cases: a ball of 65 mm without coupling, and finalists of ``GRASP … AUTO`` on a box, a
cylinder, a glass, a small box (pinched) and a ball of 80 mm. The file of an earlier run holds its open hands, so that
both versions close the same ones.

Columns: milliseconds of processor time a grasp (median) by stage, complete grasps a second of one thread, the largest
penetration; beside an earlier run its grasps a second, the hands whose verdict is the same (force closure, and which
digits press), the largest difference of angles, of epsilon and of depth.
"""

from __future__ import annotations

import time
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from warpjld.covering import Covering, bind
from warpjld.grasp import GraspObject
from warpjld.grasp.close import Closer
from warpjld.grasp.find_grasp import _promising
from warpjld.grasp.judge import Judge, Verdict
from warpjld.grasp.obstacles import Obstacles
from warpjld.grasp.placements import Candidates
from warpjld.grasp.random_placements import Draws
from warpjld.grasp.shapes import ball, box, cylinder, glass
from warpjld.hand import build_hand
from warpjld.runtime.quiet import silence_warp
from warpjld.skeleton import CHANNELS

FRICTION = 0.6
COUPLING = (1.0, 0.7)
CASES: dict[str, tuple[GraspObject, str]] = {
    "ball": (ball(0.065), ""),
    "box": (box(0.05, 0.08, 0.05), "sphere"),
    "cylinder": (cylinder(0.05, 0.12), "cylinder"),
    "glass": (glass(0.07, 0.12), "cylinder"),
    "pinch": (box(0.025, 0.025, 0.025), "pinch"),
    "ball 80": (ball(0.08), "sphere"),
}
STAGES = ("close", "part", "deform", "judge")


@click.command()
@click.option("--hands", default=32, show_default=True, help="Of each case, closed together.")
@click.option("--repeats", default=3, show_default=True)
@click.option("--save", type=Path, help="Keep what came out, for --against.")
@click.option("--against", type=Path, help="What an earlier run saved.")
@click.option("--case", "cases", multiple=True, type=click.Choice(list(CASES)), help="Some only.")
def main(hands: int, repeats: int, save: Path | None, against: Path | None, cases: tuple[str, ...]) -> None:
    """Print a row for every case."""
    silence_warp()
    rig = build_hand("left", resolution=1500)
    covering = bind(rig.skeleton, rig.surface)
    before = dict(np.load(against)) if against else {}
    kept: dict[str, NDArray] = {}
    table = Table(title=f"hands of {len(covering.surface.vertices):,} vertices, one thread")
    beside = ("before", "verdicts", "angles, °", "epsilon, N", "depth, mm") if before else ()
    for heading in ("", *(f"{stage}, ms" for stage in STAGES), "a second", "deepest, mm", *beside):
        table.add_column(heading, justify="right" if heading else "left")
    for name in cases or CASES:
        thing, posture = CASES[name]
        if f"{name}.position" in before:
            start = Candidates(*(before[f"{name}.{part}"] for part in ("position", "rotation", "approach", "angles")))
        else:
            start = drawn(covering, thing, posture, hands) if posture else placed(covering, hands)
        took, angles, verdicts = closed(covering, thing, start, COUPLING if posture else None, repeats)
        own = {
            **{part: getattr(start, part) for part in ("position", "rotation", "approach", "angles")},
            "closed": angles,
            "verdict": np.array([(one.epsilon, one.depth) for one in verdicts]),
            "pressing": np.array([pressing(one) for one in verdicts]),
            "rate": np.array(1e3 / took.sum()),
        }
        kept |= {f"{name}.{key}": value for key, value in own.items()}
        row = [*(f"{part:.1f}" for part in took), f"{own['rate']:.1f}", f"{1e3 * own['verdict'][:, 1].max():.2f}"]
        if f"{name}.rate" in before:
            row += beside_earlier(own, {key: before[f"{name}.{key}"] for key in own})
        table.add_row(name, *row)
    if save:
        np.savez(save, **kept)
    Console(width=160).print(table)


def beside_earlier(own: dict[str, NDArray], before: dict[str, NDArray]) -> list[str]:
    """Cells that compare with an earlier run."""
    same = (own["pressing"] == before["pressing"]).sum()
    off = np.abs(own["verdict"] - before["verdict"]).max(axis=0)
    turned = np.degrees(np.abs(own["closed"] - before["closed"])).reshape(len(own["closed"]), -1).max(axis=1)
    return [
        f"{before['rate']:.1f}",
        f"{same} of {len(own['pressing'])}",
        f"{turned.max():.4f} ({(turned > 1e-3).sum()} > .001)",
        f"{off[0]:.1e}",
        f"{1e3 * off[1]:.4f}",
    ]


def closed(
    covering: Covering, thing: GraspObject, start: Candidates, coupling: tuple[float, float] | None, repeats: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], list[Verdict]]:
    """Processor time of every stage a grasp [ms], angles of the closed hands (G, J, 4), and their verdicts."""
    closer = Closer(covering, thing)
    judge = Judge(closer.both, "left", FRICTION)
    poses, rows = start.poses(covering.skeleton), []
    for _ in range(repeats + 1):
        ticks = [time.process_time()]
        first = closer.close(poses, start.angles, coupling=coupling, apart=False)
        ticks.append(time.process_time())
        ended = closer.parted(poses, start.angles, first)
        ticks.append(time.process_time())
        there = start.poses(covering.skeleton, ended.angles)
        skins = covering.deform(there, threads=1)
        ticks.append(time.process_time())
        verdicts = judge.judge(there, skins, ended.penetration)
        ticks.append(time.process_time())
        rows.append(np.diff(ticks) * 1e3 / len(start))
    return np.median(rows[1:], axis=0), ended.angles, verdicts


def pressing(verdict: Verdict) -> str:
    """Everything of a verdict that is no number."""
    return f"{verdict.closed} {' '.join(verdict.digits)}{' palm' if verdict.palm else ''}"


def placed(covering: Covering, count: int) -> Candidates:
    """Hands above a ball, moved a little, fingers spread, thumb against them."""
    skeleton, rng = covering.skeleton, np.random.default_rng(0)
    angles = np.zeros((len(skeleton), len(CHANNELS)))
    for name, channel, degrees in (
        ("index.base", "abduction", 10),
        ("ring.base", "abduction", -8),
        ("pinky.base", "abduction", -18),
        ("thumb.base", "pivot", 30),
        ("thumb.base", "abduction", 20),
        ("thumb.base", "flexion", -10),
    ):
        angles[skeleton.index(name), CHANNELS.index(channel)] = np.radians(degrees)
    position = -np.array([0.004, -0.056, -0.062]) + rng.uniform(-0.004, 0.004, size=(count, 3)) * [1, 0, 1]
    return Candidates(
        position,
        np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        np.tile([0.0, -1.0, 0.0], (count, 1)),
        np.repeat(angles[None], count, axis=0),
    )


def drawn(covering: Covering, thing: GraspObject, posture: str, count: int) -> Candidates:
    """Open hands that ``find_grasp`` would close in full."""
    closer, rng = Closer(covering, thing), np.random.default_rng(1)
    judge, nothing = Judge(closer.both, "left", FRICTION), Obstacles(covering, ())
    draws = Draws(covering, closer.both.near, nothing, "left", posture, rng)
    how = {"digits": [f"left.{digit}" for digit in draws.closing], "coupling": COUPLING}
    some: list[Candidates] = []
    while sum(map(len, some)) < count:
        some.append(_promising(judge, closer, "left", draws.draw(32), nothing, how))
    return Candidates.joined(some)[:count]


if __name__ == "__main__":
    main()
