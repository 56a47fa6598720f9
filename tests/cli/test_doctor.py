"""``warpjld doctor``: what is installed, and what is missing."""

import json
from importlib import metadata

import pytest

from warpjld.cli import doctor, main


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["doctor", *arguments])
    return int(ended.value.code or 0)


def test_what_is_there(capsys) -> None:
    assert run("--no-picture", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["libraries"]["numpy"] == metadata.version("numpy")
    assert None not in told["libraries"].values()
    assert any(device.startswith("cpu") for device in told["devices"])
    assert set(told["extras"]) >= {"film", "usd", "fbx", "abc", "shell", "study", "mesh"}
    assert not {"all", "dev", "docs"} & set(told["extras"])
    assert run("--no-picture") == 0
    assert "devices:" in capsys.readouterr().out


def test_what_is_missing_is_told_with_what_mends_it(monkeypatch, capsys) -> None:
    monkeypatch.setattr(
        doctor.metadata,
        "requires",
        lambda name: [
            "numpy>=2.0",
            "no-such-library>=1",
            'no-such-extra>=2; extra == "film"',
            'warpjld[film]; extra == "all"',
        ],
    )
    assert run("--no-picture") == 1
    told = capsys.readouterr()
    assert "missing: no-such-library: pip install no-such-library" in told.out
    assert "optional: film: no-such-extra: pip install 'warpjld[film]'" in told.out
    assert "does not work" in told.err


def test_a_driver_that_fails_is_told(monkeypatch, capsys) -> None:
    from warpjld import render

    def fails(*given, **how):
        raise RuntimeError("no display")

    monkeypatch.setattr(render, "shaded", fails)
    assert run() == 1
    assert "drawing:   failed: RuntimeError: no display" in capsys.readouterr().out
