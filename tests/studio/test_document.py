"""The document: edits, undo and redo, saving."""

from __future__ import annotations

from pathlib import Path

from warpjld.studio.document import ScriptDocument


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_edits_are_undone_and_done_again_one_by_one(tmp_path: Path) -> None:
    document = ScriptDocument(tmp_path / "a.jld")
    document.append("RATE 25")
    document.append("FRAMES 0 10")
    assert document.text == "RATE 25\nFRAMES 0 10\n"
    assert document.undo()
    assert document.text == "RATE 25\n"
    assert document.undo()
    assert document.text == ""
    assert not document.undo()
    assert document.redo()
    assert document.redo()
    assert not document.redo()
    assert document.text == "RATE 25\nFRAMES 0 10\n"


def test_a_drag_is_one_step_of_undoing_and_a_later_drag_another(tmp_path: Path) -> None:
    clock = Clock()
    document = ScriptDocument(tmp_path / "a.jld", clock=clock)
    for value in range(5):
        clock.now += 0.1
        document.edit(f"RATE {value + 1}\n", kind="rate")
    clock.now += 5.0
    document.edit("RATE 50\n", kind="rate")
    assert document.undo()
    assert document.text == "RATE 5\n"
    assert document.undo()
    assert document.text == ""


def test_an_edit_of_another_kind_or_after_undo_is_a_step_of_its_own(tmp_path: Path) -> None:
    document = ScriptDocument(tmp_path / "a.jld", clock=Clock())
    document.edit("a", kind=1)
    document.edit("b", kind=2)
    document.undo()
    document.edit("c", kind=1)
    assert not document.can_redo
    document.undo()
    assert document.text == "a"


def test_saved_whole_and_autosaved_until_saved(tmp_path: Path) -> None:
    document = ScriptDocument(tmp_path / "a.jld")
    document.edit("RATE 25\n")
    document.autosave()
    assert document.autosaved.read_text() == "RATE 25\n"
    assert not (tmp_path / "a.jld").exists()
    document.save()
    document.autosave()
    assert (tmp_path / "a.jld").read_text() == "RATE 25\n"
    assert not document.autosaved.exists()
    assert not document.changed
