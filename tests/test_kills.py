"""``kill -9`` at random moments: old outputs stay whole, and what the next run leaves is, byte for byte, what is left
by one that nobody disturbed. Fifty-four moments over six commands; minutes each, so run with ``-m slow``."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(3600),
    pytest.mark.skipif(os.name != "posix", reason="SIGKILL is POSIX's"),
]

KILLS = 9
"""Moments of each command."""

_HAND = "HAND LEFT BUILTIN RESOLUTION 1500\nSIZE 64 48\n"
_BLOCK = """
OBJECT block BOX 0.02 0.02 0.02 AT 0 0.5101 0
OBJECT ground BOX 0.1 0.02 0.1 AT 0 0.49 0
PHYSICAL block LAW LINEAR YOUNG 1e5 ELEMENT 0.005
POINTS block top UPPER Y 0.1
VECTOR block top AT 0 0 0 0
VECTOR block top AT 12 0 -3e-3 0
FRICTION 0.5
FRAMES 0 12
EXPORT "e.npz"
EXPORT "e.mdd"
VOLUME "v.pvd"
PICTURE 12 "p.png"
"""
_PLAN = """title = "Kept"
seed = 1
trials = 5
[[hands]]
name = "a"
builtin = "right"
resolution = 1500
[[objects]]
builtin = "ball"
diameter = 0.065
"""
_BOX = """title = "Box"
[mesh]
kind = "box"
size = [1, 1, 2]
counts = [4, 4, 6]
[material.body]
law = "neo-hooke"
young = YOUNG
poisson = 0.4
density = 1100.0
[[step]]
name = "press"
gravity = [0, 0, -9.81]
instants = 3
pressure = {"z+" = 10.0}
[[step.prescribed]]
where = "z-"
x = 0.0
y = 0.0
z = 0.0
"""


def _moves(frames: int) -> str:
    return f"frame,index.base.flexion,ring.base.flexion\n0,0,0\n{frames},40,70\n"


@dataclass(frozen=True)
class Command:
    """A command of the program, run in a folder of its own.

    Attributes:
        arguments: What is called.
        files: What it reads, by name.
        former: What an earlier call in that folder read instead; None where there was none.
        goes_on: What a call that was killed leaves to go on from, and what is not compared: it holds times.
    """

    arguments: str
    files: dict[str, str]
    former: dict[str, str] | None = None
    goes_on: tuple[str, ...] = ()


def _curl(frames: int) -> str:
    """A script that bends a finger."""
    return (
        f"{_HAND}FINGER1 LEFT INDEX FLEXION AT {frames} 60\nFRAMES 0 {frames}\n"
        f"EXPORT 'e.npz'\nEXPORT 'e.usda'\nPICTURE {frames} 'p.png'"
    )


COMMANDS = {
    "run": Command(
        "run a.jld -o out --quiet", {"a.jld": _curl(40)}, {"a.jld": _curl(25)}, goes_on=("out/summary.json",)
    ),
    "deform": Command(
        "deform builtin:left --motion m.csv -o m.pc2 --motion-out m.bvh --quiet",
        {"m.csv": _moves(200)},
        {"m.csv": _moves(90)},
    ),
    "study": Command(
        "study plan.toml -o out --quiet",
        {"plan.toml": _PLAN},
        goes_on=("out/study.json", "out/trials", "out/manifest.json", "out/summary.html", "out/summary.png"),
    ),
    "fem": Command(
        "fem box.toml -o out --quiet",
        {"box.toml": _BOX.replace("YOUNG", "1.2e6")},
        {"box.toml": _BOX.replace("YOUNG", "2.4e6")},
    ),
    "press": Command(
        "run a.jld -o out --quiet",
        {"a.jld": f"{_HAND}{_BLOCK}PRESS 0 12 STATE 'state.npz'"},
        {"a.jld": f"{_HAND}{_BLOCK}PRESS 0 4"},
        goes_on=("out/summary.json", "out/state.npz"),
    ),
    "bake": Command(
        "bake builtin:left -o b.glb --report r.csv --correctives 2 --poses m.csv --quiet",
        {"m.csv": _moves(30)},
        {"m.csv": _moves(12)},
    ),
}


def _started(folder: Path, command: Command) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "warpjld", *command.arguments.split()],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "OMP_NUM_THREADS": "1"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )


def _finished(folder: Path, command: Command) -> float:
    """Run it to its end; how long that took [s]."""
    begin = time.monotonic()
    process = _started(folder, command)
    told = process.communicate()[1].decode()
    assert process.returncode == 0, told
    return time.monotonic() - begin


def _killed(folder: Path, command: Command, after: float) -> bool:
    """Kill it, and the processes it started, after some time [s]; whether it was not done by then."""
    process = _started(folder, command)
    try:
        process.wait(after)
        done = True
    except subprocess.TimeoutExpired:
        done = False
    try:
        os.killpg(process.pid, signal.SIGKILL)  # the group that it and its children are
    except ProcessLookupError:
        assert done
    process.communicate()
    return not done


def _made(folder: Path, command: Command) -> dict[str, bytes]:
    """Outputs by name; what is hidden is nobody's."""
    out = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if (
            path.is_file()
            and not hidden
            and name not in command.files
            and not name.startswith(command.goes_on or ("\0",))
        ):
            out[name] = path.read_bytes()
    return out


def _write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).write_text(text)


@pytest.mark.parametrize("name", COMMANDS)
def test_outputs_are_whole_and_the_next_runs_are_those_of_an_undisturbed_one(name: str, tmp_path: Path) -> None:
    command, draw = COMMANDS[name], random.Random(f"kills {name}")
    undisturbed, folder = tmp_path / "undisturbed", tmp_path / "killed"
    undisturbed.mkdir()
    _write(undisturbed, command.files)
    took = _finished(undisturbed, command)
    wanted = _made(undisturbed, command)
    assert wanted
    former = _former(tmp_path, command)
    shutil.copytree(tmp_path / "former", folder)
    _write(folder, command.files)
    kills = 0
    while kills < KILLS:
        if _killed(folder, command, took * draw.random()):
            kills += 1
            for file, content in _made(folder, command).items():
                assert content in (former.get(file), wanted.get(file)), f"{file} is neither old nor new"
            assert set(former) <= set(_made(folder, command))
        else:
            assert _made(folder, command) == former | wanted
            shutil.rmtree(folder)
            shutil.copytree(tmp_path / "former", folder)
            _write(folder, command.files)
    _finished(folder, command)
    made = _made(folder, command)
    assert {file: made[file] for file in wanted} == wanted
    left = [path for path in folder.rglob(".*") if ".part" in path.name or ".making" in path.name]
    assert not left


def _former(tmp_path: Path, command: Command) -> dict[str, bytes]:
    """Outputs of an earlier call in the folder."""
    folder = tmp_path / "former"
    folder.mkdir()
    if command.former is None:
        return {}
    _write(folder, command.former)
    _finished(folder, command)
    return _made(folder, command)
