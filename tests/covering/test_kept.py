"""Kept bindings give back what binding gives, are used for nothing else, and mend themselves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from warpjld.cli.bind import command as bind_command
from warpjld.cli.deform import command as deform_command
from warpjld.covering import bind_rig
from warpjld.covering.kept import CACHE_VARIABLE, bind_kept, cache_folder, load_binding, save_binding
from warpjld.covering.parameters import default_parameters
from warpjld.errors import InputError
from warpjld.hand import build_hand
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles


@pytest.fixture(scope="module")
def hand() -> Rig:
    return build_hand("left", resolution=1500)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


def _poses(rig: Rig) -> Poses:
    angles = np.random.default_rng(0).uniform(0.0, 0.4, (3, len(rig.skeleton), len(CHANNELS)))
    return poses_from_angles(rig.skeleton, angles)


def test_what_is_kept_deforms_to_the_bit_as_what_is_bound(hand: Rig, folder: Path) -> None:
    poses = _poses(hand)
    expected = bind_rig(hand).deform(poses)
    for _ in range(2):
        covering, notes = bind_kept(hand)
        np.testing.assert_array_equal(covering.deform(poses), expected)
        assert not notes
    assert len(list(folder.iterdir())) == 1


def test_it_is_not_bound_again(hand: Rig, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bind_kept(hand)

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("bound again")

    monkeypatch.setattr("warpjld.covering.covering.domains_from_geometry", refuse)
    monkeypatch.setattr("warpjld.covering.covering.pack_runs", refuse)
    bind_kept(hand)[0].deform(_poses(hand))


def test_a_broken_file_is_made_anew_and_told_of(hand: Rig, folder: Path) -> None:
    bind_kept(hand)
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    for broken in (b"", b"no binding", whole[: len(whole) // 2]):
        file.write_bytes(broken)
        covering, notes = bind_kept(hand)
        assert "made anew" in notes[0]
        assert not bind_kept(hand)[1]
        assert len(covering.surface.vertices) == len(hand.surface.vertices)


def test_other_rigs_and_settings_have_other_bindings(hand: Rig, tmp_path: Path) -> None:
    file = tmp_path / "hand.npz"
    save_binding(file, bind_rig(hand), hand)
    load_binding(file, hand)
    moved = replace(hand, surface=replace(hand.surface, vertices=hand.surface.vertices + 1e-9))
    stronger = default_parameters(hand.skeleton)
    stronger = replace(stronger, inflation=stronger.inflation * 1.01)
    with pytest.raises(InputError, match="another rig"):
        load_binding(file, moved)
    with pytest.raises(InputError, match="another rig"):
        load_binding(file, hand, parameters=stronger)
    with pytest.raises(InputError, match="no such file"):
        load_binding(tmp_path / "none.npz", hand)


def test_the_cache_moves_and_is_switched_off(hand: Rig, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for word in ("", "off", "0"):
        monkeypatch.setenv(CACHE_VARIABLE, word)
        assert cache_folder() is None
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file"))
    (tmp_path / "file").write_text("no folder")
    assert bind_kept(hand)[0].skeleton is hand.skeleton  # a cache that cannot be written is none


def test_bind_and_deform_with_what_it_wrote(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    kept, motion = tmp_path / "hand.npz", tmp_path / "motion.csv"
    made = CliRunner().invoke(bind_command, ["builtin:left", "-o", str(kept)])
    assert made.exit_code == 0, made.output
    assert kept.is_file()
    motion.write_text("frame,left.index.base.flexion\n0,0\n1,30\n")
    outputs = []
    for more in ([], ["--binding", str(kept)]):
        out = tmp_path / f"out{len(more)}.pc2"
        told = CliRunner().invoke(deform_command, ["builtin:left", str(motion), "-o", str(out), *more])
        assert told.exit_code == 0, told.output
        assert "made anew" not in told.output
        outputs.append(out.read_bytes())
    assert outputs[0] == outputs[1]
