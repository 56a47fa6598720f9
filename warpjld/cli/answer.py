"""What a command answers a program with: one JSON object, alone on stdout."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import click

__all__ = ["answer"]


def answer(result: Mapping[str, Any]) -> None:
    """Write a result to stdout as JSON, in ASCII whatever the terminal speaks; numbers that are not finite are null."""
    click.echo(json.dumps(_finite(result), indent=1, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(one) for key, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_finite(one) for one in value]
    return value
