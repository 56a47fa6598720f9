"""Plots of a grasp study with contact: force shares, contact area, pressure, muscle effort, and pressure maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.files.whole_file import whole_file
from warpjld.skeleton import DIGITS
from warpjld.study.grasping.choices import HandChoice
from warpjld.study.grasping.load import hand_of
from warpjld.study.grasping.plan import GraspPlan

__all__ = ["GRIP_SHARES", "finger_shares", "write_grip_plots"]

GRIP_SHARES = {"index": 37.0, "middle": 37.5, "ring": 27.0, "pinky": 13.4}
"""Published mean of the fingers' largest forces in a grip of 115 ± 13 N [N]."""

_FINGERS = tuple(GRIP_SHARES)
_INKS = ("#4d7ea8", "#c8553d", "#6a994e", "#bc8034", "#7b5ea7", "#23272e")
_VIEW = (400, 300)
"""Width and height of one pressure map, including the colour scale [pixels]."""

Row = Mapping[str, Any]


def finger_shares(rows: Sequence[Row]) -> NDArray[np.float64]:
    """Share of each finger in the total force of the four fingers, index first, shape (n, 4); rows without force are
    left out."""
    forces = np.array([[row[f"force_{finger}"] or 0.0 for finger in _FINGERS] for row in rows], dtype=np.float64)
    forces = forces.reshape(-1, len(_FINGERS))
    forces = forces[forces.sum(axis=1) > 0.0]
    return np.asarray(forces / forces.sum(axis=1, keepdims=True))


def write_grip_plots(
    folder: Path, plan: GraspPlan, rows: Sequence[Row], arrays: Mapping[str, NDArray[Any]]
) -> list[Path]:
    """Write ``grips.png`` and ``pressure.png`` and return their paths; write nothing if no trial reached its force.

    Args:
        folder: Folder to write to.
        plan: Plan of the study.
        rows: Rows of the study's table.
        arrays: Arrays of the study, as in ``poses.npz``.
    """
    pressed = [row for row in rows if row.get("press") == "REACHED"]
    if not pressed:
        return []
    return [_curves(folder / "grips.png", plan, pressed), _maps(folder / "pressure.png", plan, rows, arrays)]


def _curves(path: Path, plan: GraspPlan, rows: Sequence[Row]) -> Path:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    figure = Figure(figsize=(12.0, 8.0), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(f"{plan.title}: {len(rows)} grips")
    axes: Any = figure.subplots(2, 2)
    objects = [item.name for item in plan.objects]
    _shares(axes[0, 0], objects, rows)
    _by_hand(axes[0, 1], plan, rows, lambda row: 1e6 * row["pressed_area"], "skin under pressure [mm²]")
    _by_hand(axes[1, 0], plan, rows, lambda row: 1e-3 * row["peak_pressure"], "highest pressure [kPa]")
    _efforts(axes[1, 1], objects, rows)
    for label in figure.findobj(Text):
        label.set_parse_math(False)
    with whole_file(path) as part:
        figure.savefig(part, metadata={"Software": None})
    return path


def _shares(axis: Any, objects: Sequence[str], rows: Sequence[Row]) -> None:
    places, width = np.arange(len(objects) + 1), 0.2
    means = [finger_shares([row for row in rows if row["object"] == name]) for name in objects]
    known = np.array(list(GRIP_SHARES.values())) / sum(GRIP_SHARES.values())
    bars = [*(shares.mean(axis=0) if len(shares) else np.full(len(_FINGERS), np.nan) for shares in means), known]
    for k, finger in enumerate(_FINGERS):
        heights = [100.0 * bar[k] for bar in bars]
        axis.bar(places + (k - 1.5) * width, heights, width, color=_INKS[k], label=finger)
    axis.set_xticks(places, [*objects, "published"])
    axis.set(ylabel="share of the fingers' force [%]", title="Force by finger")
    axis.legend(fontsize=8)


def _by_hand(axis: Any, plan: GraspPlan, rows: Sequence[Row], value: Any, label: str) -> None:
    objects = [item.name for item in plan.objects]
    for k, hand in enumerate(choice.name for choice in plan.hands):
        mine = [(objects.index(row["object"]), value(row)) for row in rows if row["hand"] == hand]
        shift = 0.08 * (k - 0.5 * (len(plan.hands) - 1))
        places = [at + shift for at, _ in mine]
        axis.plot(places, [height for _, height in mine], "o", color=_INKS[k % len(_INKS)], label=hand)
    axis.set_xticks(np.arange(len(objects)), objects)
    axis.set(ylabel=label, ylim=(0.0, None))
    axis.legend(fontsize=8)


def _efforts(axis: Any, objects: Sequence[str], rows: Sequence[Row]) -> None:
    for k, digit in enumerate(reversed(DIGITS)):
        known = [(objects.index(row["object"]), row[f"share_{digit}"]) for row in rows]
        mine = [(at, 100.0 * share) for at, share in known if share is not None]
        shift = 0.08 * (k - 2)
        axis.plot([at + shift for at, _ in mine], [share for _, share in mine], "o", color=_INKS[k], label=digit)
    axis.set_xticks(np.arange(len(objects)), objects)
    axis.set(ylabel="share of the muscles' limits [%]", ylim=(0.0, None))
    axis.legend(fontsize=8)


def _maps(path: Path, plan: GraspPlan, rows: Sequence[Row], arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Pressure maps of palms of flat hands: maximum over all weights; one row per hand, one column per object."""
    from warpjld.render import ColorScale, grid, save_picture

    found = {
        (hand.name, thing.name): most
        for hand in plan.hands
        for thing in plan.objects
        if (most := _highest(hand.name, thing.name, rows, arrays)) is not None
    }
    top = max(float(pressure.max()) for pressure in found.values())
    scale = ColorScale.of_pressure(top)
    hands = [hand for hand in plan.hands if any(name == hand.name for name, _ in found)]
    things = [thing.name for thing in plan.objects if any(name == thing.name for _, name in found)]
    pictures = []
    for hand in hands:
        pictures += [_palm(hand, found.get((hand.name, thing)), scale) for thing in things]
    table = [pictures[k : k + len(things)] for k in range(0, len(pictures), len(things))]
    title = f"{plan.title}: {', '.join(hand.name for hand in hands)} from top to bottom"
    return save_picture(path, grid(table, captions=things, title=title))


def _highest(
    hand: str, thing: str, rows: Sequence[Row], arrays: Mapping[str, NDArray[Any]]
) -> NDArray[np.float64] | None:
    """Maximum over the trials of the pressure at each vertex [Pa], shape (V,); None without a trial."""
    name = f"{hand}/pressure"
    if name not in arrays:
        return None
    own = [k for k, trial in enumerate(arrays[f"{name}.trials"].tolist()) if rows[trial]["object"] == thing]
    return np.asarray(arrays[name][own].max(axis=0)) if own else None


def _palm(choice: HandChoice, pressure: NDArray[np.float64] | None, scale: Any) -> NDArray[np.uint8]:
    """Picture of the palm coloured by pressure; blank if the pressure is None."""
    if pressure is None:
        return np.full((_VIEW[1], _VIEW[0], 3), 255, dtype=np.uint8)
    from warpjld.render import Camera, SceneRenderer

    hand = hand_of(choice)
    skin = hand.rig.surface.vertices
    palm = hand.palm
    camera = Camera.view("front", skin, forward=palm.normal, up=palm.fingers, side=hand.side, size=_VIEW)
    with SceneRenderer(hand.rig.surface.faces, camera, size=_VIEW, scale=scale) as scene:
        return scene.draw(skin, values=pressure)
