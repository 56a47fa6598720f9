"""Success rates of a study, overall and by group; trials that failed or crashed count as no success."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from warpjld.study.wilson import wilson_interval

__all__ = ["Rate", "success_rates"]


@dataclass(frozen=True)
class Rate:
    """Success rate of a group of trials.

    Attributes:
        group: Column that defines the group, "" for all trials.
        value: The column's value in this group.
        successes: Number of successes.
        trials: Number of trials, errors and crashes included.
        low: Lower bound of the 95 % Wilson interval of the rate; likewise ``high``.
        statuses: Number of trials by status, most frequent first.
    """

    group: str
    value: str
    successes: int
    trials: int
    low: float
    high: float
    statuses: dict[str, int]

    @property
    def rate(self) -> float:
        """Fraction of successes; 0 without trials."""
        return self.successes / self.trials if self.trials else 0.0


def success_rates(rows: Sequence[dict[str, Any]], success: str, groups: Sequence[str]) -> list[Rate]:
    """Success rate of all trials, then of every value of every group column.

    Args:
        rows: The table.
        success: Name of the truth column; an empty cell is a failure.
        groups: Columns to group by.
    """
    rates = [_rate("", "all", rows, success)]
    for group in groups:
        values: list[Any] = list(dict.fromkeys(row.get(group) for row in rows))
        if len(values) < 2:
            continue
        if all(isinstance(value, int | float) for value in values):
            values.sort(key=float)
        for value in values:
            members = [row for row in rows if row.get(group) == value]
            rates.append(_rate(group, "(none)" if value is None else str(value), members, success))
    return rates


def _rate(group: str, value: str, rows: Sequence[dict[str, Any]], success: str) -> Rate:
    wins = sum(row.get(success) is True for row in rows)
    low, high = wilson_interval(wins, len(rows))
    statuses = Counter(str(row["status"]) for row in rows)
    return Rate(group, value, wins, len(rows), low, high, dict(statuses.most_common()))
