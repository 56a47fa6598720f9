"""Kept bindings give back what binding gives, are used for nothing else, and mend themselves."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from warpjld.cli.bind import bind_command
from warpjld.cli.deform import deform_command
from warpjld.covering import bind_rig
from warpjld.covering.kept import bind_kept, load_binding, save_binding
from warpjld.covering.parameters import default_parameters
from warpjld.errors import InputError
from warpjld.files.kept_files import CACHE_VARIABLE
from warpjld.files.whole_file import whole_file
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles


@pytest.fixture(scope="module")
def hand(hands: dict[str, Rig]) -> Rig:
    return hands["left"]


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

    works = (
        "surface_binding.domains_from_geometry",
        "surface_binding.anchor",
        "covering.operator_fields",
    )
    for work in (*works, "covering.Diffusion", "covering.pack_runs"):
        monkeypatch.setattr(f"warpjld.covering.{work}", refuse)
    kept = bind_kept(hand)[0]
    kept.deform(_poses(hand))
    kept.points(_poses(hand), [0, 7])
    kept.with_parameters(replace(kept.parameters, inflation=0.5 * kept.parameters.inflation)).points(_poses(hand), [3])


def test_all_that_is_kept_is_what_was_bound(hand: Rig, folder: Path) -> None:
    bound = bind_kept(hand)[0]
    kept = bind_kept(hand)[0]
    assert kept is not bound
    for name in ("anchors", "parameters"):
        one, other = getattr(bound, name), getattr(kept, name)
        for field in fields(one):
            np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))
    np.testing.assert_array_equal(kept.domains, bound.domains)
    shaped = replace(bound.parameters, proximity=0.9 * bound.parameters.proximity)
    poses = _poses(hand)
    for one, other in ((bound, kept), (bound.with_parameters(shaped), kept.with_parameters(shaped))):
        np.testing.assert_array_equal(one.fields.stacked().toarray(), other.fields.stacked().toarray())
        np.testing.assert_array_equal(one.deform(poses), other.deform(poses))
    again = pickle.loads(pickle.dumps(bind_kept(hand)[0]))  # as it is sent to a worker
    np.testing.assert_array_equal(again.fields.stacked().toarray(), bound.fields.stacked().toarray())


def test_two_processes_may_keep_the_same_binding(hand: Rig, tmp_path: Path) -> None:
    place, covering = tmp_path / "hand.npz", bind_rig(hand)
    with whole_file(place) as half:  # another process has begun
        half.write_bytes(b"half")
        script = (
            "import sys; from pathlib import Path; from warpjld.files.whole_file import whole_file\n"
            "with whole_file(Path(sys.argv[1])) as part: part.write_bytes(b'other')"
        )
        subprocess.run([sys.executable, "-c", script, place], check=True)
        assert place.read_bytes() == b"other"
        assert half.read_bytes() == b"half"
        half.unlink()
        save_binding(half, covering, hand)
    load_binding(place, hand)


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


def test_a_cache_that_cannot_be_written_is_none(hand: Rig, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file"))
    (tmp_path / "file").write_text("no folder")
    assert bind_kept(hand)[0].skeleton is hand.skeleton


def test_bind_and_deform_with_what_it_wrote(
    hands: dict[str, Rig], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("warpjld.hand.kept.kept_hand", lambda side, **_: hands[side])
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
