"""Figures of the operators, computed by the covering itself on a tube with one joint.

    python docs/make_figures.py            # into docs/pictures/, a few seconds

The lines are the tube's back (outside) and front (inside), where the plane of flexion cuts it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import warpjld as wj
from warpjld.geometry.surface import weld_surface
from warpjld.runtime.quiet import silence_warp

PICTURES = Path(__file__).resolve().parent / "pictures"
RADIUS, LENGTH = 0.009, 0.08  # of the tube [m]
RINGS, AROUND = 161, 48
INK, GREY, RED, BLUE = "#202428", "#9aa0a6", "#b5483a", "#2f6f9f"


def tube() -> tuple[wj.Skeleton, wj.Rig]:
    """Two segments along -z with a joint in the middle, in a tube closed by flat ends."""
    rest = np.array([[0, 0, 0], [0, 0, -0.04], [0, 0, -0.08]], dtype=float)
    limits = np.zeros((3, 4, 2))
    limits[:, 0] = [0.0, np.radians(100)]
    skeleton = wj.Skeleton(
        ("index.base", "index.knuckle2", "index.tip"),
        np.array([-1, 0, 1], dtype=np.int32),
        rest,
        np.tile([-1.0, 0.0, 0.0], (3, 1)),
        limits,
    )
    along = -np.linspace(-0.008, LENGTH + 0.008, RINGS)
    turn = 2 * np.pi * np.arange(AROUND) / AROUND
    rings = np.stack(
        [
            np.broadcast_to(RADIUS * np.cos(turn), (RINGS, AROUND)),
            np.broadcast_to(RADIUS * np.sin(turn), (RINGS, AROUND)),
            np.broadcast_to(along[:, None], (RINGS, AROUND)),
        ],
        axis=-1,
    )
    number = np.arange(RINGS * AROUND).reshape(RINGS, AROUND)
    after = np.roll(number, -1, axis=1)
    a, b, c, d = number[:-1], after[:-1], after[1:], number[1:]
    low, high = RINGS * AROUND, RINGS * AROUND + 1
    faces = np.concatenate(
        [
            np.stack([a, c, b], -1).reshape(-1, 3),
            np.stack([a, d, c], -1).reshape(-1, 3),
            np.stack([number[0], after[0], np.full(AROUND, low)], -1),
            np.stack([after[-1], number[-1], np.full(AROUND, high)], -1),
        ]
    )
    points = np.concatenate([rings.reshape(-1, 3), [[0, 0, along[0]], [0, 0, along[-1]]]])
    return skeleton, wj.Rig("tube", skeleton, weld_surface(points, faces))


def section(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Back and front of the tube in the plane of flexion, (along, up) in mm, each (RINGS, 2)."""
    grid = points[: RINGS * AROUND].reshape(RINGS, AROUND, 3)
    back, front = grid[:, AROUND // 4], grid[:, 3 * AROUND // 4]
    return tuple(1e3 * np.stack([-line[:, 2], line[:, 1]], axis=-1) for line in (back, front))


def bent(skeleton: wj.Skeleton, degrees: float) -> wj.Poses:
    """The joint in the middle flexed."""
    angles = np.zeros((1, 3, 4))
    angles[0, 1, 0] = np.radians(degrees)
    return wj.poses_from_angles(skeleton, angles)


def draw(axis: Axes, points: np.ndarray, poses: wj.Poses, color: str, label: str = "", style: str = "-") -> None:
    """The tube's section and its bones."""
    back, front = section(points)
    axis.plot(*back.T, color=color, lw=1.4, ls=style, label=label)
    axis.plot(*front.T, color=color, lw=1.4, ls=style)
    joints = poses.positions[0]
    axis.plot(-1e3 * joints[:, 2], 1e3 * joints[:, 1], color=GREY, lw=1, marker="o", ms=3)
    axis.set(aspect="equal", xlabel="mm", xlim=(-12, 82), ylim=(-52, 18))


def figure(name: str, titles: list[str]) -> tuple[Figure, list[Axes]]:
    """A row of panels."""
    made = Figure(figsize=(4.2 * len(titles), 3.1), layout="constrained")
    FigureCanvasAgg(made)
    axes = [made.add_subplot(1, len(titles), k + 1) for k in range(len(titles))]
    for axis, title in zip(axes, titles, strict=True):
        axis.text(0.97, 0.94, title, fontsize=10, ha="right", va="top", transform=axis.transAxes)
    return made, axes


def save(made: Figure, name: str) -> None:
    """Into the folder of pictures, the same bytes every time."""
    made.savefig(PICTURES / f"{name}.png", dpi=110, metadata={"Software": None})
    print(PICTURES / f"{name}.png")


def modified_normal() -> None:
    """What the bisector does: beside linear blend skinning, and the paper's own operators."""
    from warpjld.covering.baselines import linear_blend_skinning
    from warpjld.rig import Skin

    skeleton, rig = tube()
    smooth, paper = wj.bind(rig), wj.bind(rig, method="paper")
    share = np.clip(0.5 - (rig.surface.vertices[:, 2] + 0.04) / 0.02, 0.0, 1.0)  # painted over 2 cm
    skin = Skin(np.tile(np.array([0, 1], dtype=np.int32), (len(share), 1)), np.stack([1 - share, share], axis=-1))
    made, axes = figure("operators", ["30°", "60°", "90°"])
    for axis, degrees in zip(axes, (30, 60, 90), strict=True):
        poses = bent(skeleton, degrees)
        draw(
            axis,
            linear_blend_skinning(skeleton, rig.surface.vertices, skin, poses)[0],
            poses,
            GREY,
            "blend skinning",
            ":",
        )
        draw(axis, paper.deform(poses)[0], poses, BLUE, "METHOD PAPER", "--")
        draw(axis, smooth.deform(poses)[0], poses, INK, "smooth")
        joint, half = poses.positions[0, 1], np.radians(degrees) / 2
        x, y = -1e3 * joint[2], 1e3 * joint[1]
        axis.annotate(
            "", (x + 20 * np.sin(half), y + 20 * np.cos(half)), (x, y), arrowprops={"arrowstyle": "->", "color": RED}
        )
    axes[0].legend(fontsize=8, loc="lower left", frameon=False)
    save(made, "operators")


def rounding() -> None:
    """The two parameters of a joint."""
    skeleton, rig = tube()
    covering, poses = wj.bind(rig), bent(skeleton, 90)
    made, axes = figure("rounding", ["INFLATION (R22a)", "PROXIMITY (R22b)"])
    for amount, color in ((0.0, BLUE), (float(covering.parameters.inflation[1]), INK), (0.8, RED)):
        parameters = replace(covering.parameters, inflation=np.full(3, amount))
        draw(axes[0], covering.with_parameters(parameters).deform(poses)[0], poses, color, f"{amount:.2f}")
    for amount, color in ((0.1, BLUE), (0.3, INK), (0.5, RED)):
        parameters = replace(covering.parameters, proximity=np.full((3, 2), amount), inflation=np.full(3, 0.6))
        draw(
            axes[1], covering.with_parameters(parameters).deform(poses)[0], poses, color, f"{amount:.1f}, inflation 0.6"
        )
    for axis in axes:
        axis.legend(fontsize=8, loc="lower left", frameon=False)
    save(made, "rounding")


def muscle() -> None:
    """The muscle inside a segment: its amplitude, where it is fullest, and its exponents (Fig. 11)."""
    skeleton, rig = tube()
    covering, poses = wj.bind(rig), bent(skeleton, 90)
    made, axes = figure("muscle", ["MUSCLE (R22c)", "PEAK (R22d)", "EXPONENTS (R65)"])
    base = covering.parameters
    for amount, color in ((0.0, BLUE), (0.5, INK), (1.0, RED)):
        draw(
            axes[0],
            covering.with_parameters(replace(base, muscle=np.full(3, amount))).deform(poses)[0],
            poses,
            color,
            f"{amount}",
        )
    for peak, color in ((0.2, BLUE), (0.5, INK), (0.8, RED)):
        chosen = replace(base, muscle=np.full(3, 1.5), peak=np.full(3, peak))
        draw(axes[1], covering.with_parameters(chosen).deform(poses)[0], poses, color, f"{peak}")
    for power, color in ((0.5, BLUE), (1.0, INK), (3.0, RED)):
        chosen = replace(base, muscle=np.full(3, 1.5), exponents=np.full((3, 2), power))
        draw(axes[2], covering.with_parameters(chosen).deform(poses)[0], poses, color, f"{power}")
    for axis in axes:
        axis.legend(fontsize=8, loc="lower left", frameon=False)
    save(made, "muscle")


if __name__ == "__main__":
    silence_warp()
    modified_normal()
    rounding()
    muscle()
