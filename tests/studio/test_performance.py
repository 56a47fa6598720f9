"""A document run anew from the first statement that changed describes what a run from the top does."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.studio.performance import Performance

HAND = "HAND LEFT BUILTIN RESOLUTION 1500\n"


def described(scene: Scene) -> object:
    """All that keys say, as plain values."""
    actors = {
        name: {channel: track.keys for channel, track in actor.motion.tracks.items()}
        for name, actor in scene.actors.items()
    }
    props = {name: {c: t.keys for c, t in prop.placement.tracks.items()} for name, prop in scene.props.items()}
    return actors, props, scene.first, scene.last, scene.rate, scene.spline, scene.outputs, scene.current


def from_the_top(text: str, path: Path) -> Scene:
    path.write_text(text)
    scene = Scene(folder=path.parent / "out", say=lambda line: None)
    Interpreter(scene).run_file(path)
    return scene


def lines(chance: random.Random) -> list[str]:
    """Some commands, in an order that matters."""
    kinds = [
        lambda: f"JOINT left.index.base FLEXION AT {chance.randint(0, 3)} {chance.randint(0, 60)}",
        lambda: f"FINGER23 LEFT RING KNUCKLES2\n  0 4 2 {chance.randint(0, 60)}",
        lambda: f"SPLINE {chance.choice([-1, 0, 0.5])}",
        lambda: f"MACRO BEND angle\n  FINGER1 LEFT PINKY FLEXION AT 1 $angle\nEND\nBEND {chance.randint(0, 40)}",
        lambda: f"RATE {chance.randint(10, 60)}",
        lambda: f"POSE LEFT FIST {chance.randint(0, 3)} SHARE 50",
        lambda: "# a comment",
        lambda: f'PICTURE {chance.randint(0, 9)} "p{chance.randint(0, 10**9)}.png"',
    ]
    return [chance.choice(kinds)() for _ in range(chance.randint(1, 40))]


@pytest.mark.parametrize("seed", [0, 1, 5])
def test_edits_anywhere_describe_the_same_as_a_run_from_the_top(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    path = tmp_path / "a.jld"
    performance = Performance(tmp_path / "out", say=lambda line: None)
    body = lines(chance)
    for _ in range(12):
        text = HAND + "\n".join(body) + "\n"
        performance.run(text, path)
        assert described(performance.scene) == described(from_the_top(text, path))
        k = chance.randrange(len(body))
        match chance.randrange(3):
            case 0:
                body[k] = lines(chance)[0]
            case 1:
                body.insert(k, lines(chance)[0])
            case _:
                if len(body) > 1:
                    del body[k]


def test_only_what_changed_runs_again_and_says_so_once(tmp_path: Path) -> None:
    said: list[str] = []
    performance = Performance(tmp_path, say=said.append)
    many = "".join(f"PRINT {k}\n" for k in range(40))
    performance.run(many, tmp_path / "a.jld")
    assert len(said) == 40
    performance.run(many + "PRINT new\n", tmp_path / "a.jld")
    assert said[40:] == ["new"]
    performance.run(many.replace("PRINT 38", "PRINT other"), tmp_path / "a.jld")
    assert said[41:] == ["other", "39"]


def test_a_fault_names_its_line_and_leaves_what_stands_before_it(tmp_path: Path) -> None:
    performance = Performance(tmp_path, say=lambda line: None)
    with pytest.raises(InputError) as caught:
        performance.run(f"{HAND}RATE 25\nJOINT left.index.base FLEXION AT 0 400\nRATE 50\n", tmp_path / "a.jld")
    assert (caught.value.line, caught.value.column) == (3, 36)
    assert performance.scene.rate == 25
    assert not performance.scene.actors["LEFT"].keyed
    performance.run(f"{HAND}RATE 25\nJOINT left.index.base FLEXION AT 0 40\nRATE 50\n", tmp_path / "a.jld")
    assert performance.scene.rate == 50


def test_files_outside_the_folder_are_not_read(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (tmp_path / "secret.jld").write_text("secret word\n")
    performance = Performance(tmp_path / "out", say=lambda line: None, within=[home])
    for name in ("../secret.jld", str(tmp_path / "secret.jld")):
        with pytest.raises(InputError, match="outside the folder") as caught:
            performance.run(f'INCLUDE "{name}"\n', home / "a.jld")
        assert "word" not in str(caught.value)
    (home / "link.jld").symlink_to(tmp_path / "secret.jld")
    with pytest.raises(InputError, match="outside the folder"):
        performance.run('INCLUDE "link.jld"\n', home / "a.jld")
