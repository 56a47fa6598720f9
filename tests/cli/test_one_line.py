"""What goes to stderr is one line, whatever names hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from warpjld.cli import main
from warpjld.cli.warn import one_line, warn


def test_line_ends_and_terminal_commands_are_written_out(capsys: pytest.CaptureFixture[str]) -> None:
    warn(["größe\n\x1b[2Jname\udcff"])
    assert capsys.readouterr().err == "warning: größe\\n\\x1b[2Jname\\udcff\n"
    assert len(one_line("9" * 100_000)) < 2100


def test_an_error_about_a_file_of_two_lines_is_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["inspect", str(tmp_path / "two\nlines.glb")])
    assert capsys.readouterr().err.count("\n") == 1
