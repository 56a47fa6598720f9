"""Success rates of a study, overall and by group, failures in the denominator."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from warpjld.study.wilson import wilson_interval

__all__ = ["Rate", "success_rates"]


@dataclass(frozen=True)
class Rate:
    """Success rate of some trials.

    Attributes:
        group: Column told apart, "" for all trials.
        value: Its value in these trials.
        successes: How many succeeded.
        trials: How many there were, errors and crashes included.
        low: Lower bound of the 95 % Wilson interval of the rate; likewise ``high``.
        statuses: Status → number of trials, most frequent first.
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
        """Share of successes; 0 where there were no trials."""
        return self.successes / self.trials if self.trials else 0.0


def success_rates(rows: Sequence[dict[str, Any]], success: str, groups: Sequence[str]) -> list[Rate]:
    """Rate of all trials, then of every value of every group column.

    Args:
        rows: The table.
        success: Truth column that counts; an empty cell is a failure.
        groups: Columns whose values are told apart.
    """
    rates = [_rate("", "all", rows, success)]
    for group in groups:
        values: list[Any] = list(dict.fromkeys(row.get(group) for row in rows))
        if len(values) < 2:
            continue
        if all(isinstance(value, int | float) for value in values):
            values.sort(key=float)
        for value in values:
            some = [row for row in rows if row.get(group) == value]
            rates.append(_rate(group, "(none)" if value is None else str(value), some, success))
    return rates


def _rate(group: str, value: str, rows: Sequence[dict[str, Any]], success: str) -> Rate:
    wins = sum(row.get(success) is True for row in rows)
    low, high = wilson_interval(wins, len(rows))
    statuses = Counter(str(row["status"]) for row in rows)
    return Rate(group, value, wins, len(rows), low, high, dict(statuses.most_common()))
