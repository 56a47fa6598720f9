"""How fast the covering is, beside NumPy's linear blend skinning and the cost of writing alone, in one run.

    python tests/benchmarks/deform.py [--vertices 18000] [--frames 240] [--repeats 15]

Linear blend skinning is one matrix product over all frames, the quickest form NumPy has. The write floor fills an array
of the same size. Rows are measured in turn, so that a machine that slows down slows all of them; compare ratios.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import click
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from warpjld.covering import Covering, bind
from warpjld.hand import build_hand
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles

_FIRST_RUN = """
import time; start = time.perf_counter()
from warpjld.covering import bind
from warpjld.hand import build_hand
from warpjld.skeleton import rest_poses
rig = build_hand("left", resolution=2000)
built = time.perf_counter()
bind(rig.skeleton, rig.surface).deform(rest_poses(rig.skeleton))
print(built - start, time.perf_counter() - built)
"""


@click.command()
@click.option("--vertices", default=18_000, show_default=True)
@click.option("--frames", default=240, show_default=True)
@click.option("--repeats", default=15, show_default=True)
def main(vertices: int, frames: int, repeats: int) -> None:
    """Print throughput, latency and start-up as tables."""
    rig = build_hand("left", resolution=vertices)
    covering = bind(rig.skeleton, rig.surface)
    poses = fist(covering, frames)
    count = len(rig.surface.vertices)
    console = Console()
    table = Table(title=f"{count:,} vertices × {frames} frames, million vertex-frames per second (median)")
    for heading in ("", "1 thread", "2 threads"):
        table.add_column(heading, justify="left" if not heading else "right")
    times = {threads: throughput(covering, poses, threads, repeats) for threads in (1, 2)}
    for name in times[1]:
        table.add_row(name, *(f"{count * frames / 1e6 / np.median(times[t][name]):.0f}" for t in (1, 2)))
    for name in ("warpjld, order of the runs", "warpjld, order of the surface"):
        for other in ("NumPy LBS, one product", "write floor"):
            ratios = [np.median(np.divide(times[t][other], times[t][name])) for t in (1, 2)]
            table.add_row(f"{name} / {other}", *(f"{r:.2f} ×" for r in ratios))
    console.print(table)
    one = poses[:1]
    latency = [_seconds(lambda: covering.deform(one, threads=1)) for _ in range(200)]
    console.print(f"one frame, poses to vertices: {1e3 * np.median(latency):.2f} ms")
    for label, (build, first) in first_runs().items():
        console.print(f"first run, kernels {label}: import and hand {build:.1f} s, bind and one frame {first:.1f} s")


def fist(covering: Covering, frames: int) -> Poses:
    """Fingers that curl to 90 % of their limits."""
    skeleton = covering.skeleton
    flexion = CHANNELS.index("flexion")
    angles = np.zeros((frames, len(skeleton), len(CHANNELS)))
    for joint, name in enumerate(skeleton.names):
        if name.endswith(("base", "knuckle2", "knuckle3")):
            angles[:, joint, flexion] = np.linspace(0.0, 0.9, frames) * skeleton.limits[joint, flexion, 1]
    return poses_from_angles(skeleton, angles)


def throughput(covering: Covering, poses: Poses, threads: int, repeats: int) -> dict[str, list[float]]:
    """Seconds of every repeat, all methods in turn."""
    count, frames = len(covering.surface.vertices), len(poses)
    out = np.empty((frames, count, 3), dtype=np.float32)
    skinned = np.empty((3 * frames, count), dtype=np.float32)
    transforms, weighted = linear_blend_factors(covering, poses)
    halves = np.array_split(out, threads)

    def fill() -> None:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda part: part.fill(1.0), halves))

    def product() -> None:
        with threadpool_limits(threads):
            np.matmul(transforms, weighted, out=skinned)

    methods: dict[str, Callable[[], object]] = {
        "warpjld, order of the runs": lambda: covering.deform(poses, out=out, threads=threads, order="runs"),
        "warpjld, order of the surface": lambda: covering.deform(poses, out=out, threads=threads),
        "NumPy LBS, one product": product,
        "write floor": fill,
    }
    times = defaultdict(list)
    for repeat in range(repeats + 1):
        for name, method in methods.items():
            time.sleep(0.1)  # BLAS threads spin for a while after their work and would take a core from the next row
            seconds = _seconds(method)
            if repeat:  # the first one compiles
                times[name].append(seconds)
    return times


def linear_blend_factors(covering: Covering, poses: Poses) -> tuple[np.ndarray, np.ndarray]:
    """Bone transforms (3 F, 4 J) and weighted rest vertices (4 J, V), whose product is the skinned surface."""
    skeleton, rest = covering.skeleton, covering.surface.vertices
    joints, frames = len(skeleton), len(poses)
    matrices = Rotation.from_quat(poses.rotations.reshape(-1, 4)).as_matrix().reshape(frames, joints, 3, 3)
    shift = poses.positions - np.einsum("fjab,jb->fja", matrices, skeleton.rest)
    transforms = np.concatenate([matrices, shift[..., None]], axis=3).transpose(0, 2, 1, 3).reshape(3 * frames, -1)
    weights = np.zeros((len(rest), joints))
    for fan, column in zip(covering.fans, covering.domains.T, strict=True):
        weights[:, fan.segments[0].proximal] += column
    homogeneous = np.column_stack([rest, np.ones(len(rest))])
    weighted = (weights[:, :, None] * homogeneous[:, None, :]).reshape(len(rest), -1).T
    return transforms.astype(np.float32), np.ascontiguousarray(weighted, dtype=np.float32)


def first_runs() -> dict[str, tuple[float, float]]:
    """Seconds to import and build, and to bind and deform once, in new processes."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "WARP_CACHE_PATH": folder}
        out = {}
        for label in ("compiled", "cached"):
            command = [sys.executable, "-c", _FIRST_RUN]
            printed = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
            build, first = printed.split()[-2:]
            out[label] = (float(build), float(first))
    return out


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
