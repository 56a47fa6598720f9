"""Tactile readings as tables and as a plot over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from warpjld.files.whole_file import whole_file
from warpjld.simulation.report.tactile import Tactile
from warpjld.tables.columns import Column, checked_values

__all__ = ["TACTILE_COLUMNS", "draw_tactile", "tactile_rows", "write_tactile"]

TACTILE_COLUMNS = (
    Column("time", "number", "", "Time of the equilibrium: frame number where frames drive the hand."),
    Column("pad", "text", "", "Skin segment: digit and phalanx, or palm and the digit next to this part of it."),
    Column("touching", "truth", "", "Whether the pad is in contact."),
    Column("force_x", "number", "N", "Contact force on the pad, including friction; world frame, x component."),
    Column("force_y", "number", "N", "Contact force, y component."),
    Column("force_z", "number", "N", "Contact force, z component."),
    Column("normal_force", "number", "N", "Normal contact force: pressure integrated over the contact area."),
    Column("centre_x", "number", "m", "Centre of pressure, world frame, x coordinate; empty without contact."),
    Column("centre_y", "number", "m", "Centre of pressure, y coordinate."),
    Column("centre_z", "number", "m", "Centre of pressure, z coordinate."),
    Column("area", "number", "m²", "Contact area; its border is interpolated between nodes."),
    Column("peak_pressure", "number", "Pa", "Highest pressure: normal force on a node over its tributary area."),
    Column("slip", "number", "m", "Slip distance since the previous time, averaged over the contact area."),
    Column("sticking", "number", "", "Share of the contact area that sticks; empty without contact."),
)
"""One row for each time and pad."""

_SHADES = ("#1b4965", "#ca6702", "#8fb339", "#9b2226", "#6a4c93", "#555555")
"""Line colours of the pads of a digit."""


def tactile_rows(tactile: Tactile) -> list[dict[str, Any]]:
    """Rows of the table, ordered by time and pad."""
    out = []
    for t, time in enumerate(tactile.times):
        for p, pad in enumerate(tactile.pads):
            row = {"time": float(time), "pad": pad, "touching": bool(tactile.touching[t, p])}
            for k, axis in enumerate("xyz"):
                row[f"force_{axis}"] = float(tactile.force[t, p, k])
                row[f"centre_{axis}"] = float(tactile.centre[t, p, k])
            row |= {
                "normal_force": float(tactile.normal_force[t, p]),
                "area": float(tactile.area[t, p]),
                "peak_pressure": float(tactile.peak[t, p]),
                "slip": float(tactile.slip[t, p]),
                "sticking": float(tactile.sticking[t, p]),
            }
            out.append(checked_values(row, TACTILE_COLUMNS))
    return out


def write_tactile(path: Path, tactile: Tactile) -> None:
    """Write a table: Parquet where the name ends in ``.parquet``, otherwise CSV with its columns described beside it.

    Raises:
        MissingExtraError: Parquet without pyarrow.
    """
    from warpjld.tables.files import write_parquet, write_table_csv

    if path.suffix == ".parquet":
        write_parquet(path, tactile_rows(tactile), TACTILE_COLUMNS)
    else:
        write_table_csv(path, tactile_rows(tactile), TACTILE_COLUMNS, described=f"{path.stem}.columns.json")


def draw_tactile(path: Path, tactile: Tactile, title: str = "", axis: str = "time") -> None:
    """Plot normal force, area, slip and sticking share of every pad that is ever touched, one column per digit.

    Args:
        path: PNG file.
        tactile: Readings.
        title: Title of the figure.
        axis: Label of the time axis.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    used = [p for p in range(len(tactile.pads)) if tactile.touching[:, p].any()]
    groups: dict[str, list[int]] = {}
    for p in used:
        groups.setdefault(_group(tactile.pads[p]), []).append(p)
    columns = max(1, len(groups))
    figure = Figure(figsize=(3.1 * columns + 0.8, 8.2), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title or "Tactile readings", fontsize=13)
    axes: Any = figure.subplots(4, columns, squeeze=False, sharex=True, sharey="row")
    rows = (
        ("normal force, N", tactile.normal_force, 1.0),
        ("area, mm²", tactile.area, 1e6),
        ("slip since the previous time, mm", tactile.slip, 1e3),
        ("sticking share of the area", tactile.sticking, 1.0),
    )
    for column, (group, members) in enumerate(groups.items()):
        axes[0, column].set_title(group, fontsize=11)
        axes[-1, column].set_xlabel(axis)
        for row, (label, values, scale) in enumerate(rows):
            place = axes[row, column]
            for shade, p in zip(_SHADES * (1 + len(members) // len(_SHADES)), members, strict=False):
                name = tactile.pads[p].rpartition(".")[2]
                place.plot(tactile.times, scale * values[:, p], color=shade, marker="o", markersize=2.5, label=name)
            place.grid(alpha=0.25)
            if column == 0:
                place.set_ylabel(label, fontsize=9)
            if row == 0:
                place.legend(fontsize=8, frameon=False)
    for place in axes[3]:
        place.set_ylim(-0.05, 1.05)
    if not groups:
        axes[0, 0].text(0.5, 0.5, "no contact", ha="center", transform=axes[0, 0].transAxes)
    with whole_file(path) as part:
        figure.savefig(part, metadata={"Software": None})


def _group(pad: str) -> str:
    """Digit of a pad, or ``palm``; for pads outside hands, the last part but one of the name, else ``palm``."""
    parts = pad.split(".")
    return "palm" if "palm" in parts or len(parts) < 2 or parts[-1] in ("wrist", "forearm") else parts[-2]
