"""The library's face: what ``import warpjld`` gives, that it is what is listed, and that its examples run."""

from __future__ import annotations

import doctest
import inspect
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import warpjld as wj
from warpjld.errors import WarpjldError

LISTING = Path(__file__).resolve().parents[1] / "docs" / "reference" / "names.txt"
NAMES = [name for name in dir(wj) if not name.startswith("_")]


def signature(name: str) -> str:
    """A name as it is listed: with its arguments, or what it is."""
    found = getattr(wj, name)
    if inspect.ismodule(found):
        return f"{name}: module with {', '.join(found.__all__)}"
    if isinstance(found, type) and issubclass(found, Exception):
        return f"{name}({found.__bases__[0].__name__}): error"
    kind = "class " if inspect.isclass(found) else ""
    # what a type is called differs between versions of Python and NumPy; names, order and defaults do not
    arguments: list[str] = []
    for one in inspect.signature(found).parameters.values():
        if one.kind is one.KEYWORD_ONLY and "*" not in arguments:
            arguments.append("*")
        arguments.append(one.name + ("=…" if one.default is not one.empty else ""))
    methods = ""
    if kind:
        own = [m for m in vars(found) if not m.startswith("_") and (callable(getattr(found, m, None)))]
        methods = f"; {', '.join(sorted(own))}" if own else ""
    return f"{kind}{name}({', '.join(arguments)}){methods}"


def test_the_listing_is_what_there_is() -> None:
    wanted = "".join(f"{signature(name)}\n" for name in NAMES)
    assert LISTING.read_text(encoding="utf-8") == wanted, (
        "the public names changed: python -m tests.test_face > docs/reference/names.txt, and say so in CHANGELOG.md"
    )


def test_every_name_is_there_once() -> None:
    assert sorted(wj.__all__) == sorted([*NAMES, "__version__"])
    found = [getattr(wj, name) for name in NAMES]
    assert len({id(one) for one in found}) == len(found)
    assert 40 <= len(NAMES) <= 50
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        wj.nothing  # noqa: B018


def test_nothing_is_imported_before_it_is_asked_for() -> None:
    """And so it takes no time: 30 ms of processor time would be much."""
    program = (
        "import sys, time; before = set(sys.modules); began = time.process_time(); import warpjld; "
        "print(time.process_time() - began, *sorted(set(sys.modules) - before))"
    )
    runs = [subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True) for _ in "123"]
    told = [run.stdout.split() for run in runs]
    assert {name for name in told[0][1:] if name.startswith("warpjld")} == {"warpjld"}
    assert not {"numpy", "scipy", "warp", "click", "typing"} & set(told[0][1:])
    assert min(float(one[0]) for one in told) < 0.03


def test_kinds_of_errors() -> None:
    errors = [getattr(wj, name) for name in NAMES if name.endswith("Error")]
    assert all(issubclass(kind, WarpjldError) for kind in errors)
    from warpjld.fem import SolveError
    from warpjld.fem.contact import ContactError

    assert issubclass(SolveError, WarpjldError)
    assert issubclass(ContactError, WarpjldError)


def test_things_print_in_a_line(hands, bound) -> None:
    hand, motion = hands["left"], wj.Motion()
    motion.set_key("index.base.flexion", 0, 0.5)
    ball, mesh = wj.shapes.ball(0.06), wj.fem.box_hexes((0.1, 0.1, 0.1), (2, 2, 2))
    body = wj.fem.Body(mesh, wj.fem.LinearElastic(1e6, 0.3))
    solved = wj.fem.solve(body, wj.fem.prescribe(mesh, "x-", x=0.0, y=0.0, z=0.0))
    actor, thing = wj.RecordedActor("hand", hand, poses=motion.poses(hand.skeleton)), wj.RecordedObject("ball", ball)
    things = (hand, hand.skeleton, hand.surface, bound, bound.parameters, motion, motion.poses(hand.skeleton), ball)
    things = (*things, mesh, body, solved, solved.last, actor, thing, wj.RecordedAnimation([actor], [thing]))
    for one in things:
        text = repr(one)
        assert "\n" not in text
        assert "array(" not in text
        assert text.startswith(f"{type(one).__name__}(")
        assert len(text) < 160, text


def examples_of(name: str) -> list[doctest.DocTest]:
    """The examples in a name's docstring, its methods' left out."""
    found = getattr(wj, name)
    finder = doctest.DocTestFinder(recurse=False)
    return [one for one in finder.find(found, name, globs={"wj": wj, "Path": Path}) if one.examples]


@cache
def _built(make: Any, *given: Any) -> Any:
    return make(*given[:-1], **dict(given[-1]))


@pytest.mark.parametrize("name", NAMES)
def test_examples(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every name has an example that runs. Hands are built and bound once: that is what takes long."""
    from warpjld.hand.kept import kept_hand
    from warpjld.runtime.quiet import silence_warp

    tests = examples_of(name)
    assert tests, f"{name} has no example"
    silence_warp()  # its greeting is no part of what examples print
    for slow, less in (("build_hand", {"resolution": 1500}), ("build_body", {"resolution": 250}), ("bind", {})):
        original = kept_hand if slow == "build_hand" else getattr(wj, slow)
        monkeypatch.setattr(
            wj,
            slow,
            lambda *given, _original=original, _less=less, **how: _built(
                _original, *given, tuple((_less | how).items())
            ),
        )
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    for one in tests:
        runner.run(one, out=told.append)
    assert not runner.summarize(verbose=False).failed, re.sub(r"\n+", "\n", "".join(told))


if __name__ == "__main__":
    for name in NAMES:
        print(signature(name))
