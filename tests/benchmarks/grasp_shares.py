"""Shares of a grasp matrix that end plausibly, by task and by hand, with their binomial 95 % intervals.

    python tests/benchmarks/grasp_shares.py matrix.csv

The intervals are those of Clopper and Pearson (1934, Biometrika 26, 404–413), and hold for all cases of the matrix if
its rows are a random sample of them (``grasp_matrix.py --shuffle``). Medians are over rows that end with a solution.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable
from pathlib import Path
from statistics import median

from scipy.stats import binomtest

__all__ = ["interval", "shares"]

Row = dict[str, str]


def interval(good: int, count: int) -> tuple[float, float]:
    """Bounds of the share of which ``good`` out of ``count`` were drawn, each exceeded with 2.5 %."""
    found = binomtest(good, count).proportion_ci(0.95, "exact")
    return float(found.low), float(found.high)


def shares(rows: list[Row]) -> str:
    """Markdown table: a line for every task, for every hand, and for all."""
    head = ("", "rows", "plausible", "share [%]", "95 % [%]", "as asked", "newton", "newton90", "seconds")
    out = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for column in ("task", "hand"):
        for name in dict.fromkeys(row[column] for row in rows):
            out.append(_line(name, [row for row in rows if row[column] == name]))
    out.append(_line("all", rows))
    ends = {row["end"] for row in rows} - {"plausible"}
    named = (f"{end}: {sum(row['end'] == end for row in rows)}" for end in sorted(ends))
    return "\n".join([*out, "", "; ".join(named)])


def _line(name: str, rows: list[Row]) -> str:
    good = [row for row in rows if row["end"] == "plausible"]
    low, high = interval(len(good), len(rows))
    asked = sum(row["asked"] == "1" for row in good)
    middles = (_median(row[column] for row in rows if row["newton"]) for column in ("newton", "newton90", "seconds"))
    share = f"{100.0 * len(good) / len(rows):.0f}", f"{100.0 * low:.0f} to {100.0 * high:.0f}"
    return "| " + " | ".join([name, str(len(rows)), str(len(good)), *share, str(asked), *middles]) + " |"


def _median(values: Iterable[str]) -> str:
    """Median of the cells that are not empty."""
    known = [float(value) for value in values if value]
    return f"{median(known):.3g}" if known else ""


if __name__ == "__main__":
    with Path(sys.argv[1]).open(newline="", encoding="utf-8") as file:
        print(shares(list(csv.DictReader(file))))
