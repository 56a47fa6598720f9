"""Commands added from Python and by installed packages (R88), and the table of commands."""

import importlib
import re
import sys
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.script import all_commands, command, commands_table, registry

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "commands.md"


@pytest.fixture
def added():
    """Names to forget afterwards."""
    names: list[str] = []
    yield names
    for name in names:
        all_commands().remove(name)


def test_a_decorator_adds_a_command(run, added) -> None:
    @command("SNAP", syntax="SNAP <key> [LOUD]", help="Snap.")
    def snap(scene, arguments) -> None:
        key = arguments.number("the key")
        scene.say(f"snap {key:g} {arguments.keyword('LOUD')}")
        arguments.interpreter.run_text(f"FINGER23 LEFT MIDDLE KNUCKLES2 AT {key} 60", "<SNAP>")

    added.append("SNAP")
    scene = run("snap 7 loud")
    assert scene.said == ["snap 7 LOUD"]
    assert scene.actor().key_frames == [7]
    with pytest.raises(InputError, match=r"1:5: expected the key here; the command is SNAP <key> \[LOUD\]"):
        run("SNAP")
    with pytest.raises(InputError, match=r"^<script>:2:1: <SNAP>:1:\d+: flexion of left.middle.knuckle2 goes from"):
        run("LIMIT middle.knuckle2 FLEXION 0 50\nSNAP 3")
    assert "| `SNAP <key> [LOUD]` | Snap. |" in commands_table()


def test_a_bug_in_a_user_command_is_named_with_its_line(run, added) -> None:
    @command("OOPS", syntax="OOPS", help="Fails.")
    def oops(scene, arguments) -> None:
        raise ZeroDivisionError("by me")

    added.append("OOPS")
    with pytest.raises(InputError, match=r"<script>:2:1: OOPS failed: ZeroDivisionError: by me"):
        run("PRINT 1\nOOPS")


def test_names_are_not_taken_twice() -> None:
    with pytest.raises(InputError, match="there is a command WRIST already"):
        command("wrist", syntax="", help="")(lambda scene, arguments: None)
    with pytest.raises(InputError, match="END is a word of the language"):
        command("end", syntax="", help="")(lambda scene, arguments: None)
    with pytest.raises(InputError, match="want one word"):
        command("TWO WORDS", syntax="", help="")(lambda scene, arguments: None)


def install(folder: Path, monkeypatch, body: str) -> None:
    """A package as pip leaves it: a module, and a .dist-info with an entry point."""
    (folder / "snapping.py").write_text(body)
    info = folder / "snapping-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: snapping\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[warpjld.commands]\nsnap = snapping\n")
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(registry, "_loaded", False)
    monkeypatch.delitem(sys.modules, "snapping", raising=False)
    importlib.invalidate_caches()


def test_an_installed_package_adds_commands(tmp_path, monkeypatch, run, added) -> None:
    install(
        tmp_path,
        monkeypatch,
        "from warpjld.script import command\n"
        "@command('CLICK', syntax='CLICK', help='Click.', group='Sounds')\n"
        "def click(scene, arguments): scene.say('click')\n",
    )
    assert "CLICK" in all_commands()
    added.append("CLICK")
    assert run("Click").said == ["click"]
    assert "**Sounds**" in commands_table()


def test_a_broken_package_does_not_stop_the_others(tmp_path, monkeypatch) -> None:
    install(tmp_path, monkeypatch, "raise RuntimeError('no luck')")
    with pytest.warns(UserWarning, match=r"commands of 'snap' \(snapping\) left out: no luck"):
        assert "WRIST" in all_commands()


def test_every_command_is_documented() -> None:
    for c in all_commands():
        assert re.match(rf"{c.name}\b", c.syntax), c.name
        assert c.help.endswith("."), c.name
        assert len(c.help) < 130, c.name


def test_the_page_lists_the_commands_as_they_are() -> None:
    text = PAGE.read_text(encoding="utf-8")
    found = re.search(r"<!-- commands -->\n(.*?)<!-- /commands -->", text, re.DOTALL)
    assert found is not None, "commands.md has no table of commands between <!-- commands --> and <!-- /commands -->"
    assert found[1].strip() == commands_table().strip()
