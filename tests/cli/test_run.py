"""``warpjld run`` from outside: exit codes, what goes to stdout and stderr, commands from a Python file."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from warpjld.cli import main

pytestmark = pytest.mark.usefixtures("quick_hands")

SCRIPT = "HAND LEFT BUILTIN RESOLUTION 1500\nWRIST LEFT FLEXION AT 0 10\nPRINT ready\nEXPORT 'a.npz'\n"


def run(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["run", *map(str, arguments)])
    return ended.value.code


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "a.jld"
    path.write_text(SCRIPT)
    return path


def test_it_says_what_it_made(script, tmp_path, capfd) -> None:
    assert run(script, "-o", tmp_path / "out") == 0
    out, err = capfd.readouterr()
    assert out.startswith("ready\nLEFT: left hand,")
    assert "a.npz" in out
    assert "frames" in out
    assert not [line for line in err.splitlines() if "Warp" not in line]
    assert (tmp_path / "out" / "a.npz").is_file()


def test_json_is_alone_on_stdout(script, tmp_path, capfd) -> None:
    assert run(script, "-o", tmp_path / "out", "--json") == 0
    out, err = capfd.readouterr()
    assert json.loads(out)["files"][0]["name"] == "a.npz"
    assert "ready" in err


def test_quiet_says_nothing(script, tmp_path, capfd) -> None:
    assert run(script, "-o", tmp_path / "out", "-q") == 0
    assert capfd.readouterr().out == ""


def test_check_makes_nothing(script, tmp_path, capfd) -> None:
    assert run(script, "-o", tmp_path / "out", "--check") == 0
    assert "to be made" in capfd.readouterr().out
    assert not (tmp_path / "out").exists()


def test_check_searches_and_solves_nothing(tmp_path, monkeypatch) -> None:
    for what in ("grasp.find_grasp.find_grasp", "simulation.simulate.simulate", "covering.kept.bind_kept"):
        monkeypatch.setattr(f"warpjld.{what}", None)  # whoever calls it fails
    path = tmp_path / "b.jld"
    path.write_text(
        "HAND LEFT BUILTIN RESOLUTION 1500\nOBJECT CUP GLASS 0.065 0.11 AT 0 0 0\nFRAMES 0 8\n"
        "GRASP 0 8 LEFT CUP AUTO\nPHYSICAL CUP\nFLESH LEFT\nPRESS 0 8\nEXPORT 'a.npz'\n"
    )
    assert run(path, "-o", tmp_path / "out", "--check") == 0
    assert [one.name for one in tmp_path.iterdir()] == ["b.jld"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("WRIST LEFT FLEXION AT 0 10", "a.jld:1:1: there is no actor yet"),
        (SCRIPT + "WRIST LEFT FLEXION AT 0 100", "a.jld:5:25: flexion of left.wrist goes from -70° to 80°"),
        (SCRIPT + "FINGR1 LEFT", "a.jld:5:1: there is no command FINGR1; did you mean FINGER1?"),
        ("", "there is no actor yet"),
    ],
)
def test_errors_are_one_line_and_leave_nothing(script, tmp_path, capfd, text: str, says: str) -> None:
    script.write_text(text)
    assert run(script, "-o", tmp_path / "out") == 1
    err = [line for line in capfd.readouterr().err.splitlines() if "Warp" not in line]
    assert len(err) == 1
    assert err[0].startswith("error: ")
    assert says in err[0]
    assert not (tmp_path / "out").exists()


def test_a_missing_script_and_a_wrong_option(tmp_path, capfd) -> None:
    assert run(tmp_path / "none.jld") == 1
    assert "none.jld: cannot be read: No such file" in capfd.readouterr().err
    assert run(tmp_path / "none.jld", "--colour") == 2


def test_an_unknown_device_is_refused_with_those_there_are(script, tmp_path, capfd) -> None:
    assert run(script, "-o", tmp_path / "out", "--device", "cuda:99") == 1
    assert "device 'cuda:99' is not available; want one of: cpu" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


def test_commands_from_a_python_file(script, tmp_path, capfd) -> None:
    from warpjld.script import all_commands

    mine = tmp_path / "mine.py"
    mine.write_text(
        "from warpjld.script import command\n"
        "@command('GREET', syntax='GREET', help='Greet.')\n"
        "def greet(scene, arguments): scene.say('hello')\n"
    )
    script.write_text("GREET\n" + SCRIPT)
    assert run(script, "--commands", mine, "--check", "-o", tmp_path / "out") == 0
    assert capfd.readouterr().out.startswith("hello\n")
    all_commands().remove("GREET")
    mine.write_text("\n1 / 0\n")
    assert run(script, "--commands", mine) == 1
    assert "mine.py:2: ZeroDivisionError: division by zero" in capfd.readouterr().err
    mine.write_text("def (:\n")
    assert run(script, "--commands", mine) == 1
    assert "mine.py:1:5: not Python" in capfd.readouterr().err


def test_reading_a_script_loads_neither_warp_nor_pyvista() -> None:
    code = (
        "import sys; from warpjld.script import Interpreter, Scene; Interpreter(Scene()).run_text('PRINT 1');"
        "print({'warp', 'pyvista', 'vtkmodules', 'matplotlib', 'trimesh'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, env=_environment())
    assert (done.stdout, done.stderr) == ("1\nset()\n", "")


def _environment() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_nothing(tmp_path, number) -> None:
    script, out = tmp_path / "long.jld", tmp_path / "out"
    script.write_text(SCRIPT + "FRAMES 0 100000\nFILM 'long.mp4'\n")
    command = [sys.executable, "-m", "warpjld", "run", str(script), "-o", str(out)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=_environment()) as process:
        try:
            deadline = time.monotonic() + 60
            while not any(out.glob(".making*/.long*")) and time.monotonic() < deadline:
                time.sleep(0.05)
            assert any(out.glob(".making*/.long*")), "the film was begun"
            process.send_signal(number)
            error = process.communicate(timeout=30)[1]
        finally:
            process.kill()
    assert process.returncode == 130
    assert error.rstrip().endswith("interrupted")
    assert not out.exists()
