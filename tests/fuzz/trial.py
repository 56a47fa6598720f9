"""One input tried: read, refused in one line, or a finding."""

from __future__ import annotations

import io
import traceback
import warnings
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.sound import KINDS
from warpjld.errors import WarpjldError

__all__ = ["tried"]

_LONGEST = 4000  # characters of a message; the command line shows 2,000 of them


def tried(name: str, path: Path) -> str:
    """Read a file; empty, or what went wrong."""
    with warnings.catch_warnings(), redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        warnings.simplefilter("ignore")
        try:
            result = KINDS[name][1](path)
        except WarpjldError as error:
            if "not done after" in str(error):  # refused in time for the user, but a hang all the same
                return str(error)
            return "" if len(str(error)) <= _LONGEST else f"a message of {len(str(error))} characters"
        except Exception:
            return traceback.format_exc()
    return _not_finite(result)


def _not_finite(result: Any) -> str:
    """What of a result is not finite."""
    if isinstance(result, np.ndarray):
        return "" if np.isfinite(result).all() else "NaN in the surface"
    poses = getattr(result, "poses", result)
    if hasattr(poses, "positions") and not (np.isfinite(poses.positions).all() and np.isfinite(poses.rotations).all()):
        return "NaN in poses"
    skeleton = getattr(result, "skeleton", None)
    if skeleton is not None and not np.isfinite(skeleton.rest).all():
        return "NaN in joints"
    vertices = getattr(result, "vertices", None)
    if vertices is not None and not np.isfinite(vertices).all():
        return "NaN in vertices"
    return ""
