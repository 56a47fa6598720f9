"""Suggestions for misspelt words."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["did_you_mean", "one_of"]


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` if a known word is similar to ``word``, ignoring case; otherwise empty."""
    pool = {name.upper(): name for name in known}
    close = get_close_matches(word.upper(), list(pool), n=1, cutoff=0.6)
    return f"; did you mean {pool[close[0]]}?" if close else ""


def one_of(word: str, known: Iterable[str]) -> str:
    """As ``did_you_mean``, but ``; want one of X, Y, …`` if no known word is similar; for short lists."""
    names = list(known)
    return did_you_mean(word, names) or f"; want one of {', '.join(names)}"
