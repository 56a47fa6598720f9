"""A sound state of a contact solve, and what reads it: a block pressed on the ground, solved once a process."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.simulate import Simulation
from warpjld.simulation.solve.checkpoint import CheckpointFile, load_checkpoint

__all__ = ["read_state", "write_state"]

_BLOCK = """
OBJECT block BOX 0.02 0.02 0.02 AT 0 0.0101 0
OBJECT ground BOX 0.1 0.02 0.1 AT 0 -0.01 0
PHYSICAL block LAW LINEAR YOUNG 1e5 ELEMENT 0.01
POINTS block top UPPER Y 0.1
VECTOR block top AT 0 0 0 0
VECTOR block top AT 2 0 -5e-4 0
FRICTION 0.5
PRESS 0 2 STATE 'state.npz'
"""


@cache
def _solved() -> tuple[Simulation, bytes]:
    scene = Scene(say=lambda text: None, warn=lambda text: None)
    Interpreter(scene).run_text(_BLOCK)
    with TemporaryDirectory() as folder:
        found = run_contact(scene, Path(folder))
        return found, (Path(folder) / "state.npz").read_bytes()


def write_state(path: Path) -> None:
    """Write what a run left."""
    path.write_bytes(_solved()[1])


def read_state(path: Path) -> object:
    """Read it as a run does that goes on from it; the displacements (F, N, 3)."""
    found, content = _solved()
    sound = path.with_name("sound-state.npz")
    sound.write_bytes(content)
    identity = load_checkpoint(sound).identity
    read = CheckpointFile(path, lambda: identity).load(found.model, found.frames.tolist())
    assert read is not None
    return read.solution.last.displacement
