"""A LIFT whose support cannot be removed ends, within a bounded number of linear solves."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import pytest

from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact


@pytest.mark.slow
def test_a_lift_that_does_not_succeed_ends() -> None:
    """A box of 0.49 N that AUTO takes with two tips: removing its support has no equilibrium that the solver finds."""
    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(
        "HAND LEFT BUILTIN\nOBJECT BOX BOX 0.04 0.04 0.04 AT 0 0 0\nFRAMES 0 30\nSPLINE 1\n"
        "PHYSICAL BOX YOUNG 1e6 DENSITY 780 ELEMENT 0.01\nGRASP 0 24 LEFT BOX AUTO TRIES 8\nLIFT 24 30 LEFT BOX\n"
        "FLESH LEFT THUMB INDEX ELEMENT 0.006\nPRESS 20 30 EVERY 2"
    )
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        found = run_contact(scene, Path(folder))
    assert time.process_time() - begun < 90.0  # 60 s where nothing else runs
    grip = found.solved.grips[0]
    assert grip.status in ("HELD", "HELD_SO_FAR", "EXHAUSTED")
    assert grip.rows
    assert "linear solves" in grip.text
