"""Scripts by the language's own grammar, as Hypothesis draws them: commands that exist, with arguments of any kind."""

from __future__ import annotations

import re

from hypothesis import strategies as st

from tests.fuzz.damage import JUNK, NUMBERS
from warpjld.script.registry import all_commands

__all__ = ["scripts"]

_SLOW = ("PRESS", "GRASP", "AUTO_WRIST", "AUTO_F_1", "AUTO_F_2_3", "LIFT", "SHOW", "HAND", "OBJECTS")
"""Commands that search, draw, or build a hand: not what a second's trial is for."""
_NAMES = ("finger", "ball", "LEFT", "RIGHT", "ALL", "index.base", "left.index.base", "nobody", "é", "a.b-c")
_TEXTS = ("rig.glb", "curl.csv", "e.npz", "p.png", "f.mp4", "a b", "../x.png", "$to", "${to}", "", "a/b.npz", "~no/x")


def scripts() -> st.SearchStrategy[str]:
    """Scripts of some lines behind a sound beginning."""
    known = [command for command in all_commands() if command.name not in _SLOW]
    line = st.sampled_from(known).flatmap(lambda command: _call(command.name, command.syntax))
    body = st.lists(st.one_of(line, line, line, _macro(line)), min_size=1, max_size=12)
    head = 'BODY "rig.glb" UNIT M NAME finger\nSIZE 64 48\nFRAMES 0 3\n'
    return st.tuples(st.sampled_from((head, head, head, "")), body).map(lambda parts: parts[0] + "\n".join(parts[1]))


def _macro(line: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    inner = st.lists(line, max_size=4).map("\n  ".join)
    call = st.sampled_from(("M 1", "M", 'M "x"', "M $to", "M M"))
    return st.tuples(inner, call).map(lambda parts: f"MACRO M to\n  {parts[0]}\nEND\n{parts[1]}")


def _call(name: str, syntax: str) -> st.SearchStrategy[str]:
    """A command with words out of its own syntax and others."""
    own = sorted(set(re.findall(r"[A-Z][A-Z_0-9]+", syntax)) - {name}) or ["ON"]
    number = st.one_of(
        st.integers(-3, 12).map(str),
        st.floats(-2.0, 2.0, allow_nan=False).map(lambda value: f"{value:.4g}"),
        st.sampled_from(NUMBERS),
        st.sampled_from(("(1 + 2 * 3)", "(1 / 0)", "$to", "(-(2))", "1e5", "-1e-9")),
    )
    text = st.one_of(st.sampled_from(_TEXTS), st.sampled_from([str(one) for one in JUNK])).map(
        lambda value: '"' + value.replace('"', "").replace("\n", "") + '"'
    )
    word = st.one_of(st.sampled_from(own), st.sampled_from(own), number, number, text, st.sampled_from(_NAMES))
    return st.lists(word, max_size=9).map(lambda words: " ".join([name, *words]))
