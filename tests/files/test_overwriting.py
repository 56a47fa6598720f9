"""What is read is not written over, by no command."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz.sound import sound
from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.files.overwriting import check_outputs


def test_inputs_by_any_name_and_outputs_named_twice_are_refused(tmp_path: Path) -> None:
    (tmp_path / "rig.glb").touch()
    (tmp_path / "link.glb").symlink_to("rig.glb")
    check_outputs([tmp_path / "a.usd", tmp_path / "b.usd"], [tmp_path / "rig.glb"])
    for output in (tmp_path / "rig.glb", tmp_path / "link.glb", tmp_path / "no" / ".." / "rig.glb"):
        with pytest.raises(InputError, match=r"is read .*: it is not written over"):
            check_outputs([output], [tmp_path / "rig.glb"])
    with pytest.raises(InputError, match=r"a\.usd: would be written twice"):
        check_outputs([tmp_path / "a.usd", tmp_path / "a.usd"], [])


@pytest.mark.parametrize(
    "arguments",
    [
        ("deform", "a.glb", "a.glb", "-o", "a.glb"),
        ("deform", "a.glb", "a.glb", "--motion-out", "a.glb"),
        ("deform", "a.glb", "a.glb", "-o", ".", "--format", "glb"),
        ("inspect", "a.glb", "--no-picture", "--write-map", "a.glb"),
        ("calibrate", "a.glb", "-o", "./a.glb"),
        ("run", "a.jld", "-o", "."),
    ],
)
def test_commands_refuse_to_write_over_a_rig(
    arguments: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    sound("a.glb", tmp_path)
    (tmp_path / "a.jld").write_text('BODY "a.glb"\nFRAMES 0 1\nEXPORT "a.glb"\n')
    before = (tmp_path / "a.glb").read_bytes()
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    assert ended.value.code == 1
    assert "it is not written over" in capsys.readouterr().err
    assert (tmp_path / "a.glb").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.glb", "a.jld"]


def test_what_is_in_the_way_is_said_before(tmp_path: Path) -> None:
    (tmp_path / "a.npz").mkdir()
    (tmp_path / "b").write_text("")
    with pytest.raises(InputError, match=r"a\.npz: a folder stands where this file should go"):
        check_outputs([tmp_path / "new" / "c.npz", tmp_path / "a.npz"], [])
    with pytest.raises(InputError, match="b: is a file; want a folder to write into"):
        check_outputs([tmp_path / "b" / "c" / "a.npz"], [])
