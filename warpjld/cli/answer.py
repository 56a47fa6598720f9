"""Output of ``--json``: one JSON object on stdout."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import click

__all__ = ["answer"]


def answer(result: Mapping[str, Any]) -> None:
    """Write a result to stdout as ASCII JSON; numbers that are not finite become null."""
    click.echo(json.dumps(_finite(result), indent=1, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_finite(item) for item in value]
    return value
