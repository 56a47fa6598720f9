"""Forms of commands: their lines are what the commands take."""

from __future__ import annotations

from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.script import all_commands, command
from warpjld.script.menus import MENUS, menu, place_in_menus
from warpjld.script.parser import parse
from warpjld.studio.document import ScriptDocument
from warpjld.studio.state import StudioState
from warpjld.studio.syntax import Choice, Field, Keyword, Option, TextField, Way, line_of, ways_of

_KNOWN = {"object": "APPLE", "actor or object": "LEFT", "actor": "LEFT", "joint": "left.index.base", "points": "TOP"}
_ENOUGH = {"joint or ALL": "ALL", 'word, number or "text"': "word"}


def filled(fields: tuple[Field, ...], place: tuple[int, ...], options: bool) -> dict[tuple[int, ...], object]:
    """Something in every field; with the optional parts or without."""
    values: dict[tuple[int, ...], object] = {}
    for k, field in enumerate(fields):
        here = (*place, k)
        match field:
            case TextField(label, _, number, suffixes, _):
                values[here] = 1.0 if number else (_KNOWN | _ENOUGH).get(label, f"name{''.join(suffixes[:1])}")
            case Choice(_, choices, optional, _):
                values[here] = choices[0] if options or not optional else ""
            case Option(_, inner):
                values[here] = options
                values |= filled(inner, here, options)
    return values


@pytest.mark.parametrize("one", [*all_commands()], ids=lambda one: one.name)
def test_every_command_has_a_form_whose_lines_are_statements_of_it(one) -> None:
    for way in ways_of(one.name, one.syntax):
        for options in (False, True):
            line = line_of(one.name, way, filled(way.fields, (), options))
            (statement,) = parse(line)
            assert statement.name.text == one.name


@pytest.mark.parametrize(
    ("name", "way", "line"),
    [
        ("FINGER1", 0, "FINGER1 LEFT THUMB FLEXION 1 1 1 1"),
        ("HAND", 0, "HAND LEFT BUILTIN"),
        ("HAND", 1, 'HAND LEFT "name"'),
        ("GRASP", 1, "GRASP 1 1 APPLE AUTO"),
        ("POINTS", 1, "POINTS APPLE name NEAR 1 1 1 1"),
        ("EXPORT", 0, 'EXPORT "name.usd"'),
        ("PICTURE", 0, 'PICTURE 1 "name.png"'),
        ("PRESS", 0, "PRESS 1 1"),
        ("PARAMETER", 0, "PARAMETER ALL INFLATION 1"),
    ],
)
def test_lines_of_forms(name: str, way: int, line: str) -> None:
    chosen = ways_of(name, all_commands()[name].syntax)[way]
    assert line_of(name, chosen, filled(chosen.fields, (), options=False)) == line


def test_ways_optional_parts_and_repeated_words_are_told_apart() -> None:
    ways = ways_of("GO", 'GO <LEFT/RIGHT> <key> [SLOW <seconds>] [UP/DOWN] or GO "<file>.png" <THUMB/INDEX> …')
    assert ways[0] == Way(
        (
            Choice("side", ("LEFT", "RIGHT")),
            TextField("key", number=True),
            Option("SLOW", (TextField("seconds"),)),
            Choice("up or down", ("UP", "DOWN"), optional=True),
        )
    )
    assert ways[1] == Way(
        (TextField("file", quoted=True, suffixes=(".png",)), Choice("digit", ("THUMB", "INDEX"), repeated=True))
    )
    assert Keyword("FROM") in ways_of("GO", "GO FROM <x>")[0].fields


def test_forms_of_commands_do_what_they_say(tmp_path: Path) -> None:
    """Lines that need nothing but a hand and a ball run as they come out of their forms."""
    state = StudioState(
        ScriptDocument(tmp_path / "a.jld", "HAND LEFT BUILTIN RESOLUTION 1500\nOBJECT APPLE BALL 0.05\n")
    )
    for name in ("FINGER1", "FINGER23", "WRIST", "JOINT", "MOVE", "TURN", "RATE", "FRAMES", "CAMERA", "POSE", "FLESH"):
        way = ways_of(name, all_commands()[name].syntax)[0]
        line = line_of(name, way, filled(way.fields, (), options=False))
        assert state.do(line), (line, state.error)


def test_menus_by_group_and_where_an_author_wants_them() -> None:
    places = {one.name: place_in_menus(one) for one in all_commands()}
    assert {name for name, _ in places.values()} >= set(MENUS)
    assert places["OBJECT"] == ("Objects", "OBJECT")
    try:

        @menu("Pose/My trick")
        @command("TRICK", syntax="TRICK <key>", help="A trick.")
        def trick(scene, arguments) -> None:
            arguments.number("the key")

        assert place_in_menus(all_commands()["TRICK"]) == ("Pose", "My trick")
    finally:
        all_commands().remove("TRICK")
    with pytest.raises(InputError, match="want 'Menu/Entry'"):
        menu("Pose")
