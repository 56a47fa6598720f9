"""Compare four methods of deforming one rig, in numbers and pictures: LBS and dual quaternions with painted weights,
JLD with default parameters and calibrated to the rig.

python examples/compare_methods.py RIG [-o FOLDER] [--parameters FILE] [--tables-only]
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

import warpjld as wj
from warpjld.covering.baselines import dual_quaternion_skinning, linear_blend_skinning
from warpjld.covering.intersections import crossing_faces, surface_parts
from warpjld.covering.pose_sets import curled
from warpjld.covering.quality import Stretch, edge_stretch, enclosed_volume, unique_edges
from warpjld.render import Camera, ColorScale, Quality, grid, save_picture, shaded
from warpjld.skeleton import CHANNELS

Method = Callable[[wj.Poses], np.ndarray]

CELL = (420, 420)
STRETCH = ColorScale(np.log2(0.5), np.log2(2.0), title="log2 of edge stretch", colormap="coolwarm")


def shots(skeleton: wj.Skeleton) -> dict[str, tuple[wj.Poses, tuple[str, ...]]]:
    """Poses worth looking at, and where to look from."""

    def posed(**degrees: float) -> wj.Poses:
        angles = np.zeros((1, len(skeleton), len(CHANNELS)))
        for place, value in degrees.items():
            *joint, channel = place.split("_")
            angles[0, skeleton.index(".".join(joint)), CHANNELS.index(channel)] = np.radians(value)
        return wj.poses_from_angles(skeleton, angles)

    turned = ("radial", "palmar", "three-quarter-back")
    return {
        **{f"curl {c}": (curled(skeleton, [c]), turned) for c in (0.3, 0.6, 0.9)},
        "thumb opposed": (posed(thumb_base_abduction=-30, thumb_base_flexion=15), ("dorsal", "palmar", "radial")),
        "thumb spread": (posed(thumb_base_abduction=30), ("dorsal", "palmar")),
        "palm cupped": (
            posed(pinky_carpometacarpal_flexion=20, ring_carpometacarpal_flexion=20),
            ("palmar", "dorsal", "tips"),
        ),
    }


def methods(rig: wj.Rig, parameters: Path | None) -> tuple[wj.Covering, dict[str, Method]]:
    """The covering, and every method as a function from poses to positions (F, V, 3)."""
    covering = wj.bind(rig)
    fitted = wj.calibrate(covering).parameters if parameters is None else wj.load_parameters(parameters, rig.skeleton)
    calibrated = covering.with_parameters(fitted)
    out: dict[str, Method] = {}
    if rig.skin is not None:
        skin = rig.skin
        out["LBS"] = lambda poses: linear_blend_skinning(rig.skeleton, rig.surface.vertices, skin, poses)
        out["DQS"] = lambda poses: dual_quaternion_skinning(rig.skeleton, rig.surface.vertices, skin, poses)
    return covering, out | {"JLD default": covering.deform, "JLD calibrated": calibrated.deform}


def table(rig: wj.Rig, covering: wj.Covering, ways: dict[str, Method]) -> str:
    """Volume, stretch and crossing faces of every shot and method, as Markdown."""
    surface, parts = rig.surface, surface_parts(covering)
    edges, rest = unique_edges(surface.faces), enclosed_volume(surface.vertices, surface.faces)
    lines = [
        "| pose | method | volume | edge stretch min, 1 %, 99 %, max | folded faces | faces in contact |",
        "|---|---|---|---|---|---|",
    ]
    for name, (poses, _) in shots(rig.skeleton).items():
        for method, deform in ways.items():
            points = deform(poses)[0]
            change = 100.0 * (enclosed_volume(points, surface.faces) / rest - 1.0)
            stretch = Stretch.of(edge_stretch(surface.vertices, points, edges))
            crossings = crossing_faces(points, surface.faces)
            touching = crossings.contact(parts)
            where = ", ".join(f"{p} {n}" for p, n in touching.summary(parts).items())
            folds = len(crossings.folds(parts).faces)
            lines.append(f"| {name} | {method} | {change:+.1f} % | {stretch} | {folds} | {where or 0} |")
    return "\n".join(lines)


def worst_stretch(rig: wj.Rig, points: np.ndarray) -> np.ndarray:
    """log2 of the stretch of each vertex's most stretched or squeezed edge, shape (V,)."""
    edges = unique_edges(rig.surface.faces)
    log = np.log2(edge_stretch(rig.surface.vertices, points, edges))
    high, low = np.zeros(len(points)), np.zeros(len(points))
    for end in edges.T:
        np.maximum.at(high, end, log)
        np.minimum.at(low, end, log)
    return np.where(high > -low, high, low)


def draw(rig: wj.Rig, ways: dict[str, Method], folder: Path, quality: Quality | None) -> list[Path]:
    """A sheet per shot: methods side by side; views one above the other, the first also coloured by stretch."""
    wrist = rig.skeleton.index("wrist")
    base = rig.skeleton.index("middle.base")
    side = "right" if rig.skeleton.names[wrist].startswith("right") else "left"
    upward = rig.skeleton.rest[base] - rig.skeleton.rest[wrist]
    forward = -np.cross(rig.skeleton.directions[base], rig.skeleton.axes[base])
    written = []
    for name, (poses, views) in shots(rig.skeleton).items():
        points = [deform(poses)[0].astype(float) for deform in ways.values()]
        rows, captions = [], []
        for view in views:
            camera = Camera.view(view, points, forward=forward, up=upward, side=side, size=CELL)
            rows.append([shaded(p, rig.surface.faces, camera, size=CELL, quality=quality) for p in points])
            captions.append(view)
            if view == views[0]:
                colors = [worst_stretch(rig, p) for p in points]
                rows.append(
                    [
                        shaded(p, rig.surface.faces, camera, size=CELL, values=v, scale=STRETCH, quality=quality)
                        for p, v in zip(points, colors, strict=True)
                    ]
                )
                captions.append("stretch")
        sheet = grid(rows, captions=list(ways), row_captions=captions, title=f"{rig.name}: {name}")
        written.append(save_picture(folder / f"{name.replace(' ', '_').replace('.', '')}.png", sheet))
    return written


def main(arguments: list[str] | None = None) -> str:
    """Write table and pictures, and return the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("rig", type=Path, help="a hand, e.g. a glTF file with painted weights")
    parser.add_argument("-o", "--out", type=Path, default=Path("compared"))
    parser.add_argument("--parameters", type=Path, help="calibrated parameters; calibrates by default")
    parser.add_argument("--tables-only", action="store_true", help="draw nothing")
    parser.add_argument("--draft", action="store_true", help="draw quickly")
    given = parser.parse_args(arguments)
    rig = wj.load_rig(given.rig)
    covering, ways = methods(rig, given.parameters)
    text = table(rig, covering, ways)
    print(text)
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "table.md").write_text(text + "\n", encoding="utf-8")
    if not given.tables_only:
        for path in draw(rig, ways, given.out, Quality.draft() if given.draft else None):
            print(path)
    return text


if __name__ == "__main__":
    main()
