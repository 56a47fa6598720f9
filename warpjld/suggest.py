"""Did you mean …? for misspelt words."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["did_you_mean", "one_of"]


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` where a known word is close to ``word``, whatever the case; otherwise nothing."""
    pool = {name.upper(): name for name in known}
    close = get_close_matches(word.upper(), list(pool), n=1, cutoff=0.6)
    return f"; did you mean {pool[close[0]]}?" if close else ""


def one_of(word: str, known: Iterable[str]) -> str:
    """The same, and where none is close ``; want one of X, Y, …``: for short lists."""
    names = list(known)
    return did_you_mean(word, names) or f"; want one of {', '.join(names)}"
