"""A generator in a process of its own: its items in order, its errors, and what it cannot do."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.runtime.ahead import Ahead, LostError

SOURCE = '''
    """What runs elsewhere."""
    import os, time
    import numpy as np
    from warpjld.errors import InputError

    def counts(most):
        print("what is printed is no item")
        yield from (np.arange(n) for n in range(most))
        yield os.getpid()

    def refuses(path):
        yield 1
        raise InputError("no such rig", path=path)

    def fails():
        yield 1
        raise ZeroDivisionError

    def dies():
        yield 1
        os._exit(3)

    def sleeps():
        yield os.getpid()
        time.sleep(600.0)
'''


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Ahead]]:
    (tmp_path / "runs_elsewhere.py").write_text(textwrap.dedent(SOURCE), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    started: list[Ahead] = []

    def begin(name: str, *arguments: object) -> Ahead:
        started.append(Ahead(("runs_elsewhere", name), *arguments))
        return started[-1]

    yield begin
    for one in started:
        one.end()


def test_items_come_in_order_from_another_process(start: Callable[..., Ahead]) -> None:
    ahead = start("counts", 3)
    for count in range(3):
        np.testing.assert_array_equal(ahead.item(), np.arange(count))
    assert ahead.item() != os.getpid()
    with pytest.raises(LostError):
        ahead.item()
    assert ahead.ready()


def test_errors_of_the_user_are_raised_here(start: Callable[..., Ahead]) -> None:
    ahead = start("refuses", Path("hand.glb"))
    assert ahead.item() == 1
    with pytest.raises(InputError, match=r"hand\.glb.*no such rig"):
        ahead.item()


@pytest.mark.parametrize("name", ["fails", "dies", "is_not_there"])
def test_any_other_end_leaves_the_work_to_the_caller(start: Callable[..., Ahead], name: str) -> None:
    ahead = start(name)
    if name != "is_not_there":
        assert ahead.item() == 1
    with pytest.raises(LostError):
        ahead.item()


def test_arguments_that_cannot_be_sent(start: Callable[..., Ahead]) -> None:
    ahead = start("counts", lambda: 3)
    assert ahead.ready()
    with pytest.raises(LostError):
        ahead.item()


def test_the_process_is_ended(start: Callable[..., Ahead]) -> None:
    ahead = start("sleeps")
    process = ahead.item()
    assert not ahead.ready()
    ahead.end()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    with pytest.raises(LostError):
        ahead.item()
