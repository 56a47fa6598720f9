"""Scripts that were open lately."""

from __future__ import annotations

from pathlib import Path

import pytest

from warpjld.studio.recent import note_recent, recent_scripts


def test_the_last_come_first_and_what_is_gone_is_not_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_CACHE", str(tmp_path / "kept"))
    assert recent_scripts() == []
    scripts = [tmp_path / f"{k}.jld" for k in range(10)]
    for path in scripts:
        path.write_text("")
        note_recent(path)
    note_recent(scripts[4])
    assert recent_scripts() == [scripts[k] for k in (4, 9, 8, 7, 6, 5, 3, 2)]
    scripts[9].unlink()
    assert scripts[9] not in recent_scripts()
    (tmp_path / "kept" / "studio-recent.json").write_text('{"not": "a list"}')
    assert recent_scripts() == []
    (tmp_path / "kept" / "studio-recent.json").write_text("[")
    assert recent_scripts() == []
    monkeypatch.setenv("WARPJLD_CACHE", "off")
    note_recent(scripts[0])
    assert recent_scripts() == []
