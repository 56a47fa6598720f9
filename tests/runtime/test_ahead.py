"""A generator in a process of its own: its items in their order, its errors, and what happens where it breaks."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.runtime.ahead import Ahead, LostError


def counted(folder: str, count: int) -> Iterator[NDArray[np.int64] | int]:
    """The process's number, then arrays; what is printed must not get among them."""
    assert folder in sys.path
    yield os.getpid()
    for k in range(count):
        print("printed")
        yield np.full(200_000, k)


def wrong_after_one(folder: str) -> Iterator[str]:
    """An item, then an error of the user's."""
    yield "first"
    raise InputError("rig.glb: no joints")


def fault_after_one(folder: str) -> Iterator[str]:
    """An item, then a fault of the program's."""
    yield "first"
    raise ZeroDivisionError


def ends_after_one(folder: str) -> Iterator[str]:
    """An item, then the process is gone."""
    yield "first"
    os._exit(1)


def waits(file: str) -> Iterator[int]:
    """Tells its number in a file, and never gives anything."""
    Path(file).write_text(str(os.getpid()))
    time.sleep(600.0)
    yield 0


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> str:
    """This folder, from which the process imports the functions above."""
    folder = str(Path(__file__).parent)
    monkeypatch.syspath_prepend(folder)
    return folder


def _ahead(function: str, *arguments: object) -> Ahead:
    return Ahead((Path(__file__).stem, function), *arguments)


def test_items_come_in_their_order_from_another_process(here: str) -> None:
    ahead = _ahead("counted", here, 3)
    try:
        assert ahead.item() != os.getpid()
        for k in range(3):
            np.testing.assert_array_equal(ahead.item(), np.full(200_000, k))
        with pytest.raises(LostError):
            ahead.item()
        assert ahead.ready()
    finally:
        ahead.end()


def test_an_error_of_the_users_is_raised_here(here: str) -> None:
    ahead = _ahead("wrong_after_one", here)
    try:
        assert ahead.item() == "first"
        with pytest.raises(InputError, match=r"rig\.glb: no joints"):
            ahead.item()
    finally:
        ahead.end()


@pytest.mark.parametrize("function", ["fault_after_one", "ends_after_one"])
def test_after_a_fault_there_are_no_more_items(here: str, function: str) -> None:
    ahead = _ahead(function, here)
    try:
        assert ahead.item() == "first"
        with pytest.raises(LostError):
            ahead.item()
    finally:
        ahead.end()


@pytest.mark.parametrize("argument", [lambda: 0, sys.modules])
def test_arguments_that_cannot_be_sent(here: str, argument: object) -> None:
    ahead = _ahead("counted", argument)
    assert ahead.ready()
    with pytest.raises(LostError):
        ahead.item()
    ahead.end()


def test_a_python_that_does_not_start(here: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    ahead = _ahead("counted", here, 1)
    with pytest.raises(LostError):
        ahead.item()
    ahead.end()


def test_the_process_ends_with_what_it_does(here: str, tmp_path: Path) -> None:
    number = tmp_path / "number"
    ahead = _ahead("waits", str(number))
    begun = time.monotonic()
    while not (number.exists() and number.read_text()):
        assert time.monotonic() - begun < 60.0
        time.sleep(0.01)
    assert not ahead.ready()
    ahead.end()
    with pytest.raises(ProcessLookupError):
        os.kill(int(number.read_text()), 0)
    with pytest.raises(LostError):
        ahead.item()
