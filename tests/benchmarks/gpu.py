"""What a GPU gives: covering, distances, searches, conjugate gradients, beside this machine's CPU, in one run.

    python -m tests.benchmarks.gpu [--device cuda:0] [--json gpu.json]

Six minutes at most. Each row is measured on the device and on the CPU (all its cores), the least of its repetitions,
after one that compiles. *Share of copy* is the time of a copy of as many bytes as a launch writes over the time of the
launch: 1 is what memory allows. Rows "with transfers" begin and end in NumPy arrays, as the library's functions do; the
others stay on the device. Hands close on the CPU whatever the device is: their row says what there is to gain.

Conjugate gradients are Warp's own (``warp.optim.linear``) in float64 on the stiffness of a cube, Jacobi preconditioned,
50 iterations: the solver of the library computes on the CPU, and its multigrid is not what is measured here.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import click
import numpy as np
import warp as wp
from rich.console import Console
from rich.table import Table

from tests.benchmarks.distance import bumpy_ball, cloud, fist, open_hands
from warpjld.covering import Covering, bind
from warpjld.fem import Body, LinearElastic, box_hexes, prescribe
from warpjld.grasp import NEAREST, FlexionSearch, ObjectSet, Searches
from warpjld.grasp.close import Closer
from warpjld.grasp.shapes import ball
from warpjld.hand.kept import kept_hand
from warpjld.rig import Rig
from warpjld.runtime.quiet import silence_warp
from warpjld.runtime.threads import cores
from warpjld.skeleton import Poses, poses_from_angles

LIMIT = 330.0
"""Seconds after which no further row begins."""


@dataclass(frozen=True)
class Sizes:
    """How much of everything."""

    vertices: int = 18_000
    frames: int = 480
    triangles: int = 10_000
    points: int = 1_000_000
    searches: int = 100_000
    grasps: int = 16
    cells: int = 40
    repeats: int = 5


SMALL = Sizes(1_500, 4, 880, 500, 200, 1, 5, 1)


@dataclass(frozen=True)
class Row:
    """One measurement: how many units a second, the share of a copy where that means something."""

    what: str
    unit: str
    device: float
    cpu: float | None
    share: float | None = None


@click.command()
@click.option("--device", help="Warp device; the first GPU, or the CPU where there is none.")
@click.option("--small", is_flag=True, help="Small sizes: that it runs, not how fast.")
@click.option("--json", "out", type=click.Path(path_type=Path), help="Also write the rows here.")
def main(device: str | None, small: bool, out: Path | None) -> None:
    """Print the table."""
    silence_warp()
    wp.init()
    where = wp.get_device(device or ("cuda:0" if wp.is_cuda_available() else "cpu"))
    sizes, began = SMALL if small else Sizes(), time.monotonic()
    rows: list[Row] = []
    for measure in (covering, distances, searches, closing, gradients):
        if time.monotonic() - began > LIMIT:
            click.echo(f"{measure.__name__} and what follows is left out: {LIMIT:.0f} s are over", err=True)
            break
        rows += measure(where, sizes)
    table = Table(title=f"{where.name}, Warp {wp.__version__}, {time.monotonic() - began:.0f} s")
    for heading in ("", "per second", "CPU", "×", "share of copy"):
        table.add_column(heading, justify="left" if not heading else "right")
    for row in rows:
        ratio = "" if row.cpu is None else f"{row.device / row.cpu:.1f}"
        cpu, share = (f"{v:,.3g}" if v is not None else "" for v in (row.cpu, row.share))
        table.add_row(f"{row.what} ({row.unit})", f"{row.device:,.3g}", cpu, ratio, share)
    Console().print(table)
    if out:
        out.write_text(json.dumps({"device": where.name, "rows": [asdict(row) for row in rows]}, indent=1) + "\n")


def seconds(run: Callable[[], object], device: wp.Device, repeats: int) -> float:
    """The least of some runs, after one that compiles, until the device is done."""
    times = []
    for _ in range(repeats + 1):
        wp.synchronize_device(device)
        begin = time.perf_counter()
        run()
        wp.synchronize_device(device)
        times.append(time.perf_counter() - begin)
    return min(times[1:])


@cache
def hand(resolution: int) -> tuple[Rig, Covering]:
    """A hand of so many vertices, bound."""
    rig = kept_hand("left", resolution=resolution)
    return rig, bind(rig.skeleton, rig.surface)


def covering(device: wp.Device, sizes: Sizes) -> Iterator[Row]:
    """A hand of many frames."""
    rig, skin = hand(sizes.vertices)
    count = len(rig.surface.vertices) * sizes.frames
    poses = fist(rig.skeleton, sizes.frames)
    cpu = wp.get_device("cpu")
    times = []
    for where in (device, cpu):
        a, b = (wp.zeros(3 * count, dtype=float, device=where) for _ in range(2))
        copied = seconds(lambda a=a, b=b: wp.copy(a, b), where, sizes.repeats)
        times.append((seconds(_resident(skin, poses, where), where, sizes.repeats), copied))
    (kernel, copied), (there, _) = times
    rates = count / kernel / 1e6, count / there / 1e6
    yield Row("covering, on the device", "million vertices", *rates, share=copied / kernel)
    buffer = np.empty((sizes.frames, len(rig.surface.vertices), 3), dtype=np.float32)
    both = [
        seconds(lambda w=where: skin.deform(poses, device=str(w), out=buffer), where, sizes.repeats)
        for where in (device, cpu)
    ]
    yield Row("covering, with transfers", "million vertices", *(count / t / 1e6 for t in both))


def _resident(skin: Covering, poses: Poses, device: wp.Device) -> Callable[[], object]:
    """Launches whose result stays on the device; only the poses, a few numbers a frame, come to it each time."""
    rows = skin._palette(poses)
    points = wp.empty((len(poses), len(skin.surface.vertices)), dtype=wp.vec3, device=device)
    return lambda: skin._launch(rows, points, device, cores() if device.is_cpu else 1, "surface")


def distances(device: wp.Device, sizes: Sizes) -> Iterator[Row]:
    """Signed distances of points, half of them near."""
    thing = bumpy_ball(sizes.triangles)
    points = cloud(thing, sizes.points)
    both = []
    for where in (device, wp.get_device("cpu")):
        objects = ObjectSet(thing, device=str(where))
        both.append(sizes.points / seconds(lambda o=objects: o.distances(points), where, sizes.repeats))
    yield Row(f"distances, {len(thing.faces):,} triangles, with transfers", "million points", *(v / 1e6 for v in both))


def searches(device: wp.Device, sizes: Sizes) -> Iterator[Row]:
    """Flexion searches of fingertips against a ball."""
    (rig, skin), rng = hand(min(sizes.vertices, 4600)), np.random.default_rng(0)
    joints = [rig.skeleton.index(f"{d}.base") for d in ("index", "middle", "ring", "pinky")]
    thing = ball(0.09).placed((0.0, -0.075, -0.11))
    poses, angles = open_hands(rig.skeleton, 1)
    tips = np.flatnonzero(skin.surface.vertices[:, 2] < -0.12)
    wanted = Searches(vertex=rng.choice(tips, sizes.searches), joint=rng.choice(joints, sizes.searches), facet=NEAREST)
    both = []
    for where in (device, wp.get_device("cpu")):
        search = FlexionSearch(skin, ObjectSet(thing, device=str(where)))
        run = seconds(lambda s=search: s.run(poses, angles, wanted), where, sizes.repeats)
        both.append(sizes.searches / run / 1e3)
    yield Row("searches to a mesh of 5,120 triangles, with transfers", "thousand", *both)


def closing(device: wp.Device, sizes: Sizes) -> Iterator[Row]:
    """Hands closed on a ball, one thread of the CPU."""
    rig, skin = hand(1500)
    closer = Closer(skin, ball(0.065))
    shift = -np.array([0.004, -0.056, -0.062]) + np.random.default_rng(0).uniform(
        -0.004, 0.004, size=(sizes.grasps, 3)
    ) * [1, 0, 1]
    _, angles = open_hands(rig.skeleton, sizes.grasps)
    poses = poses_from_angles(rig.skeleton, angles, root_position=shift)
    run = seconds(lambda: closer.close(poses, angles), wp.get_device("cpu"), 1)
    yield Row("grasps closed, on the CPU in any case", "hands", sizes.grasps / run, sizes.grasps / run)


def gradients(device: wp.Device, sizes: Sizes) -> Iterator[Row]:
    """Fifty iterations of conjugate gradients on the stiffness of a cube."""
    from warp.optim.linear import cg, preconditioner
    from warp.sparse import bsr_from_triplets

    mesh = box_hexes(counts=(sizes.cells,) * 3)
    body = Body(mesh, LinearElastic(1.0, 0.3))
    stiffness = body.at().stiffness
    assert stiffness is not None
    free = prescribe(mesh, "x-", x=0.0, y=0.0, z=0.0).free(body.degrees)
    matrix = stiffness.to_scipy().tocoo()
    kept = (free[matrix.row] & free[matrix.col]) | (matrix.row == matrix.col)
    count, right = matrix.shape[0], np.ones(matrix.shape[0]) * free
    both = []
    for where in (device, wp.get_device("cpu")):
        rows, columns = (wp.array(a[kept].astype(np.int32), device=where) for a in (matrix.row, matrix.col))
        values = wp.array(matrix.data[kept].astype(np.float64), device=where)
        sparse = bsr_from_triplets(count, count, rows, columns, values)
        b, x = (wp.array(a, dtype=wp.float64, device=where) for a in (right, np.zeros(count)))
        jacobi = preconditioner(sparse, "diag")

        def run(a=sparse, b=b, x=x, m=jacobi) -> None:
            x.zero_()
            cg(a, b, x, tol=0.0, atol=0.0, maxiter=50, M=m, check_every=0)

        both.append(50.0 / seconds(run, where, max(1, sizes.repeats // 2)))
    yield Row(f"conjugate gradients, {count:,} unknowns", "iterations", *both)


if __name__ == "__main__":
    main()
