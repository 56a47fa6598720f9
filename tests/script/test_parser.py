"""Reading: positions, comments, continued lines, macros, and errors that say where and what."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from warpjld.errors import InputError
from warpjld.script.parser import UnfinishedError, parse, parse_file
from warpjld.script.statements import MacroDefinition, Number, Operation, Position, Reference, Statement, Text, Word


def one(text: str) -> Statement:
    (node,) = parse(text, "a.jld")
    assert isinstance(node, Statement)
    return node


def test_words_numbers_and_texts_know_their_place() -> None:
    statement = one('\n\n  FINGER1 LEFT -5 .5 1e2 "a b.png"  # why')
    assert statement.name == Word("FINGER1", Position("a.jld", 3, 3))
    assert statement.arguments == (
        Word("LEFT", Position("a.jld", 3, 11)),
        Number(-5, Position("a.jld", 3, 16)),
        Number(0.5, Position("a.jld", 3, 19)),
        Number(100, Position("a.jld", 3, 22)),
        Text("a b.png", Position("a.jld", 3, 26)),
    )
    assert statement.end == Position("a.jld", 3, 35)


@pytest.mark.parametrize("text", ["", "\n", "# only a comment", "  \n # a\n\n#b\n", "\r\n#a\r\n"])
def test_nothing_is_a_script(text: str) -> None:
    assert parse(text) == ()


@pytest.mark.parametrize(
    "text",
    [
        "SHOULDER LEFT FLEXION\n0 10 5 30",  # as the paper prints it
        "SHOULDER\n LEFT\nFlexion 0 10 5 30",
        "SHOULDER LEFT FLEXION  # first line\n  0 10 5 30",
        "SHOULDER LEFT FLEXION 0 \\\n 10 5 30",
        "SHOULDER LEFT \\  # because\n FLEXION 0 10 5 30",
        "SHOULDER LEFT FLEXION\r\n0 10 5 30\r\n",
    ],
)
def test_a_command_may_go_on_in_the_next_line(text: str) -> None:
    assert [str(a).upper() for a in one(text).arguments] == ["LEFT", "FLEXION", "0", "10", "5", "30"]


def test_other_words_begin_a_command() -> None:
    assert len(parse("PRINT\nleft.index\nLEFTOVER\nEND")) == 4


def test_a_number_after_a_blank_line_belongs_to_nothing() -> None:
    with pytest.raises(InputError, match=r"<script>:3:1: expected a command or a name, found '5'"):
        parse("FRAMES 0\n\n5")


def test_a_macro_keeps_its_body() -> None:
    (macro,) = parse("macro Curl from Amount\n\n  WRIST $from ($from + 2*-3)\n  # c\n  PRINT\nEnd\n")
    assert isinstance(macro, MacroDefinition)
    assert [w.text for w in macro.parameters] == ["from", "Amount"]
    reference, operation = macro.body[0].arguments
    assert reference == Reference("FROM", Position("<script>", 3, 9))
    assert isinstance(operation, Operation)
    assert operation.operator == "+"
    assert len(macro.body) == 2


@pytest.mark.parametrize(
    ("text", "place", "says"),
    [
        ("45 LEFT", "1:1", "expected a command or a name, found '45'"),
        ("WRIST\n\n FINGER1 4x", "3:10", "expected a word, a number or a quoted text, found '4x'"),
        ('PICTURE 3 "a.png', "1:11", "no closing quote"),
        ("RATE (1 + 2", "1:12", "found the end of the line"),
        ("RATE (1 2)", "1:9", "'+'"),
        ("RATE (LEFT)", "1:7", "expected a number"),
        ("MACRO\n", "1:6", "expected a command or a name"),
        ("MACRO a 3\nEND", "1:9", "found '3'"),
        ("RATE %", "1:6", "found '%'"),
        ("RATE 1)", "1:7", "found ')'"),
    ],
)
def test_errors_say_where_and_what(text: str, place: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(text, "a.jld")
    assert str(caught.value).startswith(f"a.jld:{place}: ")
    assert says in str(caught.value)


@pytest.mark.parametrize("text", ["MACRO a", "MACRO a b\n WRIST $b", "MACRO a\n WRIST\n"])
def test_a_macro_without_end_may_go_on(text: str) -> None:
    with pytest.raises(UnfinishedError, match="no END"):
        parse(text)


def test_files_are_utf8_with_or_without_a_mark(tmp_path) -> None:
    script = tmp_path / "a.jld"
    script.write_bytes('\ufeffPRINT "é"'.encode())
    assert parse_file(script)[0].arguments[0].text == "é"
    script.write_bytes(b"PRINT \xff")
    with pytest.raises(InputError, match="not UTF-8"):
        parse_file(script)
    with pytest.raises(InputError, match=r"none\.jld: cannot be read"):
        parse_file(tmp_path / "none.jld")


@given(st.text(alphabet="aE1 .-+*/()$\"'#\\\n\t\r%é", max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(InputError):
        parse(text)


def test_deep_arithmetic_is_refused_not_a_crash() -> None:
    with pytest.raises(InputError, match="arithmetic: 201 levels; the limit is 200"):
        parse("RATE " + "(" + "+".join(["1"] * 5000) + ")")
