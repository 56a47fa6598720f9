"""Warp without its remarks, for programs whose output belongs to what they print."""

from __future__ import annotations

import os
import sys

__all__ = ["silence_warp"]


def silence_warp() -> None:
    """Start Warp without its greeting on stdout, which belongs to what the command prints, and without its native
    library's remark on stderr that there is no GPU: whoever asks for one is told by an error."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    if sys.stderr is not None:
        sys.stderr.flush()
    try:
        kept = os.dup(2)
    except OSError:  # closed: nothing can be heard there
        warp.init()
        return
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        warp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
