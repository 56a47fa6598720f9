"""``warpjld inspect``: report what was recognised in a rig, with a picture of its skeleton."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from warpjld.cli import options
from warpjld.cli.answer import answer
from warpjld.rig import Rig
from warpjld.skeleton.tree import CHANNELS

__all__ = ["inspect_command"]


@click.command("inspect")
@click.argument("rig")
@partial(options.rig, lists_points=True)
@click.option("-o", "--out", type=click.Path(path_type=Path), help="Picture to write; the rig's name.png by default.")
@click.option("--no-picture", is_flag=True, help="Write no picture.")
@click.option("--write-skeleton", type=click.Path(path_type=Path), help="Skeleton file to write, for editing.")
@click.option("--write-map", type=click.Path(path_type=Path), help="Joint map to write, for editing (see --map).")
@options.json
@click.option("-q", "--quiet", is_flag=True, help="Print only what looks suspicious.")
def inspect_command(
    rig: str,
    out: Path | None,
    no_picture: bool,
    write_skeleton: Path | None,
    write_map: Path | None,
    as_json: bool,
    quiet: bool,
    **how: Any,
) -> None:
    """Report what was recognised in RIG: joints, domains, limits, animations, and joints that look misplaced.

    RIG is a rig file (.glb, .gltf, .vrm, .fbx, .usd, .usda, .usdc, .usdz), a surface with --skeleton, or builtin:left,
    builtin:right. A picture of the surface's wire-frame with the named skeleton is written as well, unless
    --no-picture.
    """
    from warpjld.cli.rig_argument import open_rig, rig_files
    from warpjld.files.overwriting import check_outputs
    from warpjld.runtime.quiet import silence_warp

    silence_warp()
    listed = how["points"] == options.LISTED
    how["points"] = None if listed else how["points"]
    check_outputs([path for path in (out, write_skeleton, write_map) if path is not None], rig_files(rig, how))
    opened = open_rig(rig, **how)
    report = _report(opened)
    if listed or how["points"] is not None:
        report["points"] = _points(opened)
    if write_skeleton is not None:
        from warpjld.io.skeleton_file import write_skeleton_file

        write_skeleton_file(write_skeleton, opened.skeleton)
    if write_map is not None:
        from warpjld.io.joint_map_file import write_joint_map

        write_joint_map(write_map, opened)
    picture = None if no_picture else out or Path(f"{opened.name.replace(' ', '-')}.png")
    if picture is not None:
        from warpjld.cli.inspect_picture import draw_rig

        draw_rig(opened, picture, suspicious={finding["joint"] for finding in report["placing"]})
        report["picture"] = str(picture)
    if as_json:
        answer(report)
    else:
        _print(report, quiet)


def _report(rig: Rig) -> dict[str, Any]:
    from warpjld.motion.animations import animation_names
    from warpjld.rig.centres import joint_centres
    from warpjld.skeleton.recognise.placing.check import check_placing

    skeleton, surface = rig.skeleton, rig.surface
    domains = _domains(rig)
    joints = []
    for j, name in enumerate(skeleton.names):
        parent = int(skeleton.parents[j])
        joints.append(
            {
                "name": name,
                "parent": skeleton.names[parent] if parent >= 0 else None,
                "source": rig.source_joints[j] if rig.source_joints else "",
                "position": _round(skeleton.rest[j], 6),
                "axis": _round(skeleton.axes[j], 4),
                "limits": {
                    channel: _round(np.degrees(pair), 1)
                    for channel, pair in zip(CHANNELS, skeleton.limits[j], strict=True)
                    if np.ptp(pair) > 0 and skeleton.children[j]
                },
                "initial": {
                    channel: round(float(np.degrees(angle)), 1)
                    for channel, angle in zip(CHANNELS, skeleton.initial[j], strict=True)
                    if angle
                },
                "domain": int(domains[j]),
            }
        )
    return {
        "file": str(rig.path or rig.name),
        "surface": {
            "vertices": len(surface.vertices),
            "source vertices": len(surface.weld),
            "triangles": len(surface.faces),
            "parts": [part.name for part in surface.parts],
            "size": _round(np.ptp(surface.vertices, axis=0), 4),
        },
        "joints": joints,
        "animations": [] if rig.path is None else list(animation_names(rig.path)),
        "palms": [[[skeleton.names[a], skeleton.names[b]] for a, b in palm] for palm in skeleton.palms],
        "placing": [
            vars(finding) | {"message": finding.message}
            for finding in check_placing(skeleton, surface.vertices, surface.faces)
        ],
        "off centre": [
            {
                "joint": centre.name,
                "distance": round(centre.distance, 6),
                "thickness": round(centre.thickness, 6),
                "message": centre.message,
            }
            for centre in joint_centres(skeleton, surface.vertices, surface.faces)
            if centre.off
        ],
        "suspicious": list(rig.suspicious),
        "notes": list(rig.notes),
    }


def _points(rig: Rig) -> dict[str, Any]:
    """The rig's 87 named points of a body, or 25 of each hand (R12)."""
    from warpjld.skeleton.actor import actor_skeleton, hand_points

    if "pelvis" in rig.skeleton.names:
        actor = actor_skeleton(rig.skeleton, rig.surface.vertices, rig.surface.faces)
    else:
        actor = hand_points(rig.skeleton)
    return {
        "placed": {name: _round(place, 6) for name, place in actor.points.items()},
        "missing": list(actor.missing),
    }


def _domains(rig: Rig) -> NDArray[np.int64]:
    """Number of vertices in the domain of the segment that ends at each joint, shape (J,) (R16)."""
    from warpjld.covering import bind_rig

    anchors = bind_rig(rig).anchors
    strongest = anchors.segment[np.arange(len(anchors)), anchors.weight.argmax(axis=1)]
    return np.bincount(anchors.ends[strongest, 1], minlength=len(rig.skeleton))


def _print(report: dict[str, Any], quiet: bool) -> None:
    if not quiet:
        surface = report["surface"]
        size = " × ".join(f"{1e3 * x:.0f}" for x in surface["size"])
        click.echo(
            f"{report['file']}\n"
            f"surface: {surface['vertices']} vertices ({surface['source vertices']} in the file), "
            f"{surface['triangles']} triangles, {size} mm, parts: {', '.join(surface['parts'])}\n"
            f"joints: {len(report['joints'])}; domain: vertices of the segment that ends at a joint\n"
        )
        rows = [("joint", "in the file", "domain", "limits")]
        rows += [_row(joint) for joint in report["joints"]]
        widths = [max(len(row[k]) for row in rows) for k in range(3)]
        for name, source, count, limits in rows:
            click.echo(f"{name:<{widths[0]}}  {source:<{widths[1]}}  {count:>{widths[2]}}  {limits}".rstrip())
        click.echo()
        if report["animations"]:
            click.echo(f"animations: {', '.join(report['animations'])}")
        if "points" in report:
            _print_points(report["points"])
        for note in report["notes"]:
            click.echo(f"note: {note}")
    for finding in report["placing"]:
        click.echo(f"suspicious: {finding['message']}")
    if not quiet:
        if off := report["off centre"]:
            click.echo(
                f"note: {off[0]['message']}, as knuckles may"
                f"{f', and {len(off) - 1} more' if len(off) > 1 else ''}; --centre-joints moves them there"
            )
        if not report["placing"]:
            click.echo("placing: nothing suspicious")
        if "picture" in report:
            click.echo(f"picture: {report['picture']}")


def _print_points(points: dict[str, Any]) -> None:
    from warpjld.skeleton.actor_points import ACTOR_POINTS

    placed, missing = points["placed"], points["missing"]
    click.echo(f"points: {len(placed)} of {len(placed) + len(missing)}, metres")
    for name, (x, y, z) in placed.items():
        click.echo(f"{name:<32}{x:9.4f}{y:9.4f}{z:9.4f}  {ACTOR_POINTS[name]}")
    if missing:
        click.echo(f"missing: {', '.join(missing)}")
    click.echo()


def _row(joint: dict[str, Any]) -> tuple[str, str, str, str]:
    limits = ", ".join(f"{channel} {low:g}…{high:g}°" for channel, (low, high) in joint["limits"].items())
    return joint["name"], joint["source"] or "(added)", str(joint["domain"] or ""), limits


def _round(values: NDArray[np.float64], digits: int) -> list[float]:
    return [round(float(x), digits) for x in values]
