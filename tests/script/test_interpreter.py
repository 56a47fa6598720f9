"""Macros, include files, and names checked before anything runs."""

import pytest

from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene


def test_macros_take_numbers_words_and_texts(run) -> None:
    scene = run("""
        macro TELL what amount
          PRINT $WHAT ($amount * 2 - 1) "say ${what} $amount"
        end
        Tell left 20
    """)
    assert scene.said == ["left 39 say left 20"]


def test_macros_call_macros_with_their_own_arguments(run) -> None:
    scene = run("MACRO b x\nPRINT $x\nEND\nMACRO a x\nb ($x + 1)\nPRINT $x\nEND\na 1")
    assert scene.said == ["2", "1"]


def test_arithmetic_has_the_usual_order(run) -> None:
    assert run("PRINT (2 + 3 * 4) (-(2 + 3) * 4) (10 - 4 - 3) (8 / 4 / 2) (3 -5) (2*-3)").said == ["14 -20 3 1 -2 -6"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("PRINT (1 / 0)", "<script>:1:8: division by zero"),
        ("PRINT $x", "<script>:1:7: $X is only defined inside a macro"),
        ("MACRO a size\nPRINT $sise\nEND", "<script>:2:7: $SISE is not a parameter of A; did you mean SIZE?"),
        ('MACRO a b\nPRINT "$c"\nEND', "<script>:2:7: $C is not a parameter"),
        ("MACRO a b b\nPRINT\nEND", "<script>:1:11: two parameters are called b"),
        ("MACRO wrist\nPRINT\nEND", "<script>:1:7: WRIST is a word of the language"),
        ("MACRO flexion\nPRINT\nEND", "<script>:1:7: FLEXION is a word of the language"),
        ("MACRO a b\nPRINT\nEND\na", "<script>:4:2: macro A needs 1 arguments, got 0; it is A <b>"),
        ("MACRO a\nPRINT\nEND\na 1", "<script>:4:3: macro A needs 0 arguments, got 1"),
        ("MACRO a b\nRATE ($b + 1)\nEND\na left", "<script>:2:7: arithmetic needs numbers, got left"),
        ("MACRO a\na\nEND\na", "macros call one another more than 50 deep: A never ends"),
        ("MACRO a\nMACRO b\nEND\nEND", "<script>:2:1: a MACRO cannot be defined inside another"),
        ("END", "<script>:1:1: END without a MACRO"),
        ("WRST LEFT", "<script>:1:1: there is no command WRST; did you mean WRIST?"),
        ("MACRO OPENHAND\nPRINT\nEND\nOPENHND", "did you mean OPENHAND?"),
        ("MACRO a\n RATE -1\nEND\n\na", "must be greater than 0, got -1 (in A, called at <script>:5)"),
    ],
)
def test_errors(run, text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        run(text)
    assert says in str(caught.value)


def test_names_are_checked_before_the_first_command_runs(run, scene) -> None:
    with pytest.raises(InputError, match="3:1: there is no command"):
        run("PRINT 1\nRATE 12\nQXZ")
    assert scene.said == []
    assert scene.rate == 30


def write(folder, **scripts: str):
    for name, text in scripts.items():
        (folder / f"{name}.jld").parent.mkdir(exist_ok=True)
        (folder / f"{name}.jld").write_text(text)


def script_scene() -> tuple[Scene, list[str]]:
    said: list[str] = []
    return Scene(say=said.append), said


def test_include_is_relative_to_the_including_file_and_shares_macros(tmp_path, monkeypatch) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "main.jld").write_text("INCLUDE 'parts/one.jld'\nHELLO 3")
    (tmp_path / "parts" / "one.jld").write_text("include 'two.jld'")
    (tmp_path / "parts" / "two.jld").write_text("MACRO HELLO n\nPRINT hello $n\nEND")
    monkeypatch.chdir("/")
    scene, said = script_scene()
    Interpreter(scene).run_file(tmp_path / "main.jld")
    assert said == ["hello 3"]


def test_errors_in_an_included_file_name_it_before_anything_runs(tmp_path) -> None:
    write(tmp_path, a="PRINT 1\nINCLUDE 'b.jld'", b="\n  RATTE 3")
    scene, said = script_scene()
    with pytest.raises(InputError, match=r"b\.jld:2:3: there is no command RATTE; did you mean RATE\?"):
        Interpreter(scene).run_file(tmp_path / "a.jld")
    assert said == []


@pytest.mark.parametrize("name", ["a", "b", "c"])
def test_circles_of_includes_are_refused(tmp_path, name: str) -> None:
    write(tmp_path, a="INCLUDE 'b.jld'", b="INCLUDE 'c.jld'", c="INCLUDE 'a.jld'")
    with pytest.raises(InputError, match=r"\.jld:1:9: files include one another in a circle: .*→"):
        Interpreter(script_scene()[0]).run_file(tmp_path / f"{name}.jld")


def test_a_circle_made_by_a_macro_is_refused_too(tmp_path) -> None:
    write(tmp_path, a="MACRO M f\nINCLUDE $f\nEND\nM 'a.jld'")
    with pytest.raises(InputError, match="in a circle"):
        Interpreter(script_scene()[0]).run_file(tmp_path / "a.jld")


def test_the_same_file_twice_is_no_circle(tmp_path) -> None:
    write(tmp_path, a="INCLUDE 'b.jld'\nINCLUDE 'b.jld'", b="PRINT hi")
    scene, said = script_scene()
    Interpreter(scene).run_file(tmp_path / "a.jld")
    assert said == ["hi", "hi"]


def test_a_missing_file_is_suggested(tmp_path) -> None:
    write(tmp_path, a="INCLUDE 'gestur.jld'", gesture="")
    with pytest.raises(InputError, match=r"a\.jld:1:9: there is no file .*did you mean gesture\.jld\?"):
        Interpreter(script_scene()[0]).run_file(tmp_path / "a.jld")
