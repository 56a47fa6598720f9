"""A row for each frame and digit (R95, R118, R122)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from warpjld.fem.hand.muscles import Effort
from warpjld.press.bodies import Bodies
from warpjld.press.frames import SolvedFrame
from warpjld.press.hand_body import HandBody

__all__ = ["Row", "rows_of", "write_table"]


@dataclass(frozen=True)
class Row:
    """What one digit feels and does at one frame.

    Attributes:
        frame: Number.
        actor: Whose.
        digit: ``index`` …, or ``palm``: everything else of the hand.
        against: What it touches, joined by ``+``.
        force_n: Length of the sum of its contact forces [N].
        fx_n, fy_n, fz_n: That sum [N].
        area_mm2: Area under pressure, inside a border that runs between nodes [mm²].
        peak_kpa: Highest pressure: what presses on a node over the skin around it [kPa]; the highest of all is the top
            of the pictures' scale.
        bone_n: Length of the sum of the reactions that hold its bones, less those of the same hand in the same pose
            when nothing touches it [N]. Where flesh is cut off, the cut bears with the bones that move it.
        flesh_n: Length of the latter [N]: of the weight of its flesh, and of the strain in it since time 0 where joints
            bend; NaN for the palm, and where the flesh alone finds no equilibrium: ``bone_n`` is then what contact
            hands on to the bones by nearness.
        limit_n: Largest force its muscles can bear [N]; NaN for the palm.
        share: Largest share of the limits of ``bone_n`` and of the torques it makes about the digit's joints; NaN for
            the palm.
        sliding: Share of the area under pressure that slides; NaN where nothing touches.
        state: ``free``, ``sticking``, ``sliding``, or ``partly sliding``.
    """

    frame: float
    actor: str
    digit: str
    against: str
    force_n: float
    fx_n: float
    fy_n: float
    fz_n: float
    area_mm2: float
    peak_kpa: float
    bone_n: float
    flesh_n: float
    limit_n: float
    share: float
    sliding: float
    state: str


def rows_of(bodies: Bodies, hand: HandBody, solved: SolvedFrame, effort: Effort) -> list[Row]:
    """Rows of a hand at a frame: its digits and its palm."""
    span = bodies.spans[hand.name]
    flesh = hand.part.hand
    labels = [_digit(name) for name in flesh.label_names]
    digit_of = np.array([*labels, ""])[flesh.node_labels]  # "" for nodes inside
    nodal_contact = solved.nodal_contact.of((slice(None), span))
    pressure = solved.pressure(bodies)[span]
    rows = []
    for digit in [*(d.digit.rpartition(".")[2] for d in effort.digits), "palm"]:
        nodes = np.flatnonzero(digit_of == digit)
        if not len(nodes):
            continue
        pushes = solved.nodal[:, span][:, nodes]
        force = pushes.sum(axis=(0, 1))
        against = [
            owner.master if owner.slave == hand.name else owner.slave
            for owner, push in zip(bodies.owners, pushes, strict=True)
            if np.abs(push).max(initial=0.0) > 0.0
        ]
        area = float(nodal_contact.area[:, nodes].sum())
        sliding = 1.0 - float(nodal_contact.held[:, nodes].sum()) / area if area > 0.0 else float("nan")
        work = None if digit == "palm" else effort[digit]
        rows.append(
            Row(
                solved.frame,
                hand.name,
                digit,
                "+".join(dict.fromkeys(against)),
                float(np.linalg.norm(force)),
                float(force[0]),
                float(force[1]),
                float(force[2]),
                1e6 * area,
                1e-3 * float(pressure[nodes].max(initial=0.0)),
                float(np.linalg.norm(effort.palm)) if work is None else work.force,
                float("nan") if work is None else work.flesh,
                float("nan") if work is None else work.limit,
                float("nan") if work is None else work.share,
                sliding,
                _state(sliding),
            )
        )
    return rows


def write_table(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as CSV or, by the suffix, Parquet."""
    columns = {name: [getattr(row, name) for row in rows] for name in Row.__dataclass_fields__}
    if path.suffix.lower() == ".parquet":
        import pyarrow
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.table(columns), path)
        return
    import csv

    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(columns))
        writer.writeheader()
        writer.writerows({k: _short(v) for k, v in asdict(row).items()} for row in rows)


def _short(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else f"{value:.6g}"


def _digit(label: str) -> str:
    """Digit of a part of the skin: ``left.index.distal`` → ``index``; ``left.palm.index`` → ``palm``."""
    from warpjld.skeleton import DIGITS

    parts = label.split(".")
    found = [part for part in parts if part in DIGITS]
    return found[0] if found and "palm" not in parts else "palm"


def _state(sliding: float) -> str:
    if np.isnan(sliding):
        return "free"
    return "sticking" if sliding < 0.05 else "sliding" if sliding > 0.95 else "partly sliding"
