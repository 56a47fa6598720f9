"""Summary page of a study: success rates with confidence intervals, statuses, and distributions of the metrics."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.files.whole_file import whole_file
from warpjld.study.rates import Rate
from warpjld.tables.columns import Column

__all__ = ["write_summary"]

_BAR, _MISS, _INK = "#4d7ea8", "#c8553d", "#23272e"
_STYLE = """body{font:15px/1.5 system-ui,sans-serif;color:#23272e;max-width:60rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:1rem 0}td,th{padding:.25rem .8rem;text-align:right;border-bottom:1px solid #dde}
td:first-child,td:nth-child(2),th:first-child,th:nth-child(2){text-align:left}img{max-width:100%}"""


def write_summary(
    folder: Path, title: str, rates: Sequence[Rate], rows: Sequence[dict[str, Any]], shown: Sequence[Column]
) -> list[Path]:
    """Write ``summary.png`` and ``summary.html``, which holds the picture too.

    Args:
        folder: Output folder.
        title: Title of the study.
        rates: Success rates, see `success_rates`.
        rows: The table.
        shown: Number columns whose distributions are drawn.

    Returns:
        The files written.
    """
    picture, page = folder / "summary.png", folder / "summary.html"
    _draw(picture, title, rates, rows, shown)
    encoded = base64.b64encode(picture.read_bytes()).decode()
    with whole_file(page) as part:
        part.write_text(_page(title, rates, encoded), encoding="utf-8")
    return [picture, page]


def _draw(
    path: Path, title: str, rates: Sequence[Rate], rows: Sequence[dict[str, Any]], shown: Sequence[Column]
) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    measured = [column for column in shown if _spread(rows, column.name)]
    statuses = rates[0].statuses
    left = 0.34 * len(rates) + 0.3 * len(statuses) + 2.0
    height = max(left, 1.5 * ((len(measured) + 1) // 2) + 1.0, 4.2)
    figure = Figure(figsize=(12.0, height), dpi=110, layout="constrained")
    canvas = FigureCanvasAgg(figure)
    figure.suptitle(title, color=_INK, fontsize=14)
    halves: Any = figure.subfigures(1, 2)
    top, bottom = halves[0].subplots(2, 1, height_ratios=(len(rates) + 1.5, len(statuses) + 1.5))
    _rate_bars(top, rates)
    _status_bars(bottom, statuses)
    if measured:
        axes = halves[1].subplots((len(measured) + 1) // 2, 2, squeeze=False).ravel()
        for axis, column in zip(axes, measured, strict=False):
            _histogram(axis, rows, column)
        for axis in axes[len(measured) :]:
            axis.set_axis_off()
    for label in figure.findobj(Text):
        label.set_parse_math(False)  # a title may contain $
    with whole_file(path) as part:
        canvas.print_png(part, metadata={"Software": None})  # savefig would draw twice


def _rate_bars(axis: Any, rates: Sequence[Rate]) -> None:
    places = np.arange(len(rates))[::-1]
    shares = np.array([r.rate for r in rates])
    bounds = np.array([[r.rate - r.low, r.high - r.rate] for r in rates]).T
    colors = [_INK if not r.group else _BAR for r in rates]
    axis.barh(places, shares, color=colors, alpha=0.85, height=0.65)
    axis.errorbar(shares, places, xerr=np.maximum(bounds, 0.0), fmt="none", ecolor=_INK, capsize=3, lw=1.2)
    axis.set_yticks(places, [f"{r.group}: {r.value}" if r.group else "all" for r in rates])
    for place, rate in zip(places, rates, strict=True):
        axis.text(1.02, place, f"{rate.successes}/{rate.trials}", va="center", fontsize=9, color=_INK)
    axis.set(xlim=(0.0, 1.0), xlabel="success rate, 95 % Wilson interval; failures count", title="Successes")
    _plain(axis)


def _status_bars(axis: Any, statuses: dict[str, int]) -> None:
    places = np.arange(len(statuses))[::-1]
    axis.barh(places, list(statuses.values()), color=_BAR, alpha=0.85, height=0.65)
    axis.set_yticks(places, list(statuses))
    for place, count in zip(places, statuses.values(), strict=True):
        axis.annotate(str(count), (count, place), (4, 0), textcoords="offset points", va="center", fontsize=9)
    axis.margins(x=0.12)
    axis.set(xlabel="trials", title="How trials ended")
    _plain(axis)


def _histogram(axis: Any, rows: Sequence[dict[str, Any]], column: Column) -> None:
    values = _finite(rows, column.name)
    shown, unit = _readable(values, column.unit)
    axis.hist(shown, bins=min(24, max(6, len(shown) // 4)), color=_BAR, alpha=0.85)
    axis.axvline(float(np.median(shown)), color=_MISS, lw=1.4)
    name = column.name.replace("_", " ")
    axis.set_title(f"{name} [{unit}]" if unit else name, fontsize=10)
    axis.set_xlabel(f"median {np.median(shown):.3g}, n = {len(shown)}", fontsize=9)
    _plain(axis)


def _readable(values: np.ndarray, unit: str) -> tuple[np.ndarray, str]:
    """Values and unit; lengths, areas and volumes below (0.5 m)ⁿ are converted to millimetres."""
    power = {"m": 1, "m²": 2, "m³": 3}.get(unit)
    if power and np.abs(values).max() < 0.5**power:
        return values * 1000.0**power, f"m{unit}"
    return values, unit


def _plain(axis: Any) -> None:
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    axis.tick_params(labelsize=9)


def _finite(rows: Sequence[dict[str, Any]], name: str) -> np.ndarray:
    values = np.array([row[name] for row in rows if row.get(name) is not None], dtype=np.float64)
    return values[np.isfinite(values)]


def _spread(rows: Sequence[dict[str, Any]], name: str) -> bool:
    values = _finite(rows, name)
    return len(values) > 1 and float(np.ptp(values)) > 0.0


def _page(title: str, rates: Sequence[Rate], picture: str) -> str:
    lines = [
        f"<tr><td>{html.escape(r.group)}</td><td>{html.escape(r.value)}</td><td>{r.successes}</td><td>{r.trials}</td>"
        f"<td>{100 * r.rate:.1f} %</td><td>{100 * r.low:.1f}–{100 * r.high:.1f} %</td>"
        f"<td>{html.escape(', '.join(f'{k} {v}' for k, v in r.statuses.items()))}</td></tr>"
        for r in rates
    ]
    name = html.escape(title)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{name}</title><style>{_STYLE}</style>'
        f"<h1>{name}</h1><p>All trials are counted; errors and crashes are failures. Intervals are 95 % Wilson score "
        f"intervals.</p><table><tr><th>group</th><th>value</th><th>successes</th><th>trials</th><th>rate</th>"
        f"<th>interval</th><th>how they ended</th></tr>{''.join(lines)}</table>"
        f'<img alt="Success rates and distributions" src="data:image/png;base64,{picture}"></html>\n'
    )
