"""Plans with mistakes: each is named, with its line and what was expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.study.grasping import load_plan

GOOD = """title = "t"
seed = 1
trials = 3

[[hands]]
builtin = "left"

[[objects]]
builtin = "ball"

[[objects]]
name = "mug"
builtin = "glass"
height = 0.1

[wrist]
tilt = [0, 10]
"""


def read(folder: Path, text: str) -> object:
    (folder / "study.toml").write_text(text)
    return load_plan(folder / "study.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed = 1", "sed = 1", r"study.toml:2: sed: unknown key; did you mean seed\?"),
        ("seed = 1", "seed = 1\nfrictoin = 0.5", r"study.toml:3: frictoin: unknown key; did you mean friction\?"),
        ("seed = 1", "seed = 1\nfriction = 0.0", r"study.toml:3: friction: want a number above 0.*got 0.0"),
        ("seed = 1", "seed = 1\nfriction = nan", r"study.toml:3: friction: want a finite number, got nan"),
        ("seed = 1", "seed = -1", r"study.toml:2: seed: want a whole number from 0 on, got -1"),
        ("seed = 1", "seed = true", r"study.toml:2: seed: want a whole number"),
        ("trials = 3", "trials = 0", r"study.toml:3: trials: want a whole number from 1 on, got 0"),
        ("trials = 3", "", r"trials: is missing"),
        ("trials = 3", "trials = 3\nscales = []", r"study.toml:4: scales: want one or more numbers"),
        ("trials = 3", 'trials = 3\ndigits = ["thum"]', r"digits: want some of .* got 'thum'; did you mean thumb\?"),
        ("trials = 3", 'trials = 3\ndigits = ["thumb", "thumb"]', r"digits: names one twice"),
        ('builtin = "ball"', 'builtin = "bal"', r"study.toml:9: objects\[0\].builtin: .*'bal'; did you mean ball\?"),
        ('builtin = "glass"', "", r"study.toml: objects\[1\].builtin: want either"),
        ("height = 0.1", "heigth = 0.1", r"study.toml:14: objects\[1\].heigth: unknown key; did you mean height\?"),
        ("height = 0.1", "mass = 0", r"study.toml:14: objects\[1\].mass: want a number above 0"),
        ('name = "mug"', 'name = "a/b"', r"study.toml:12: objects\[1\].name: the name 'a/b': '/' cannot stand"),
        ('name = "mug"\nbuiltin = "glass"\nheight = 0.1', 'builtin = "ball"', r"objects: two are called 'ball'"),
        ('builtin = "left"', 'file = "no.glb"', r"study.toml:6: hands\[0\].file: no such file: .*no.glb"),
        ('builtin = "left"', 'builtin = "left"\npercentile = 50', r"hands\[0\].sex: is missing: percentile and sex"),
        ("tilt = [0, 10]", "tilt = [10, 0]", r"study.toml:17: wrist.tilt: want the smaller number first"),
        ("tilt = [0, 10]", "tilt = [0, 100]", r"study.toml:17: wrist.tilt: want a number from 0 on and up to 90"),
        ("tilt = [0, 10]", "tlit = [0, 10]", r"study.toml:17: wrist.tlit: unknown key; did you mean tilt\?"),
        ("[wrist]", "[wirst]", r"study.toml:16: wirst: unknown key; did you mean wrist\?"),
        ("[wrist]", '[measuring]\nnorm = "L2"\n[wrist]', r"study.toml:17: measuring.norm: want one of L1, Linf"),
        ("[wrist]", '[posture."thumb.bas"]\npivot = 1\n[wrist]', r"thumb.bas: unknown key; did you mean thumb.base\?"),
        ("[wrist]", '[posture."thumb.base"]\npivto = 1\n[wrist]', r"pivto: unknown key; did you mean pivot\?"),
        ("seed = 1", "seed = = 1", r"study.toml:2:8: not TOML"),
        ("seed = 1", "seed = 1\nhands = 3", r"not TOML"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in GOOD
    with pytest.raises(InputError, match=message):
        read(tmp_path, GOOD.replace(old, new, 1))


def test_the_good_one_is_read(tmp_path: Path) -> None:
    plan = read(tmp_path, GOOD)
    assert plan.seed == 1  # type: ignore[attr-defined]
    assert [thing.name for thing in plan.objects] == ["ball", "mug"]  # type: ignore[attr-defined]
    assert plan.wrist.tilt == (0.0, 10.0)  # type: ignore[attr-defined]


def test_unreadable_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.toml: cannot be read"):
        load_plan(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"seed = \xff")
    with pytest.raises(InputError, match=r"bytes.toml: is not UTF-8"):
        load_plan(tmp_path / "bytes.toml")
