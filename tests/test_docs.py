"""The documentation says what there is: numbers that are cited, tests that are named, links, statuses, commands."""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Collection, Iterator, Mapping, Sequence
from enum import Enum
from functools import cache
from pathlib import Path

import click
import pytest

import warpjld
from warpjld.script.registry import Command

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.rglob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / ".github").glob("*.md")])
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_FENCE = re.compile(r"^```.*?^```$", re.M | re.S)
_R = re.compile(r"\bR(\d{1,3})[a-d]?(?:\s?[–-]\s?R(\d{1,3}))?\b")
_C = re.compile(r"\bC(\d{1,2})(?:[–-]C(\d{1,2}))?\b")


def numbers(pattern: re.Pattern[str], text: str) -> Iterator[int]:
    """What is cited, ranges written out."""
    for match in pattern.finditer(text):
        first = int(match[1])
        yield from range(first, int(match[2] or first) + 1)


def listed(page: Path, letter: str) -> set[int]:
    """Numbers that begin a row of a page's tables."""
    found: set[int] = set()
    for row in re.findall(r"^\| ([^|]+) \|", page.read_text(encoding="utf-8"), flags=re.M):
        for part in row.split(","):
            if match := re.fullmatch(rf"{letter}(\d+)(?:–{letter}(\d+))?", part.strip()):
                found |= set(range(int(match[1]), int(match[2] or match[1]) + 1))
    return found


@cache
def words() -> dict[str, str]:
    """Every module and test, by file: where numbers are cited."""
    files = [file for folder in ("warpjld", "kernels", "tests") for file in sorted((ROOT / folder).rglob("*.py"))]
    return {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in files}


def test_every_requirement_that_is_cited_is_there() -> None:
    there = listed(DOCS / "reference" / "requirements.md", "R")
    assert there == set(range(1, 143))
    wrong = {file: n for file, text in words().items() for n in numbers(_R, text) if n not in there and n > 0}
    assert wrong == {}


def test_every_reading_that_is_cited_is_there() -> None:
    there = listed(DOCS / "explanation" / "readings.md", "C")
    assert there == {*range(1, 25)} - {17}
    cited = {n for text in words().values() for n in numbers(re.compile(r"\(C(\d{1,2})(?:, C(\d{1,2}))?\)"), text)}
    assert cited <= there


def test_tests_that_stand_for_requirements_exist() -> None:
    page = (DOCS / "reference" / "requirements.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w/]+\.py)::(\w+)`", page)
    assert len(named) > 150
    gone = []
    for file, name in sorted(set(named)):
        path = ROOT / "tests" / file
        if not path.is_file() or not re.search(rf"^def {name}\(", path.read_text(encoding="utf-8"), flags=re.M):
            gone.append(f"{file}::{name}")
    assert gone == []


def test_every_requirement_has_a_test_or_says_why_not() -> None:
    page = (DOCS / "reference" / "requirements.md").read_text(encoding="utf-8")
    empty = [
        row
        for row in re.findall(r"^\| (R\d+[^|]*) \|[^|]*\|[^|]*\| *\|$", page, flags=re.M)
        if row.strip() != "R115–R116"
    ]
    assert empty == []


def test_what_meets_a_requirement_exists() -> None:
    """Commands, their options, programs and functions of the third column."""
    from warpjld.cli import command_group
    from warpjld.script.registry import all_commands

    commands = {one.name: one for one in all_commands()}
    programs = command_group.list_commands(click.Context(command_group))
    page = (DOCS / "reference" / "requirements.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (R\d+)[^|]* \| (?:[^|]|\\\|)*? \| ([^|]*?) ?\| [^|]*\|$", page, flags=re.M)
    assert len(rows) > 120
    gone = []
    for number, cell in rows:
        names = re.findall(r"`([^`]+)`", cell)
        if not names and cell != "*none*" and number != "R115":
            gone.append(f"{number}: nothing is named")
        gone += [f"{number}: {name}" for name in names if not _there(name, commands, programs)]
    assert gone == []


def _there(name: str, commands: Mapping[str, Command], programs: Collection[str]) -> bool:
    """Whether a command with its option, a program, or a dotted name exists."""
    if name.startswith("warpjld "):
        return name.split()[1] in programs
    if name[0].isupper():
        first, *options = [word for word in name.split() if word != "…"]
        known = first in commands and set(re.findall(r"[A-Z][A-Z0-9_-]+", commands[first].syntax))
        return bool(known) and set(options) <= known
    parts = name.split(".") if name.startswith("warpjld_kernels.") else ["warpjld", *name.split(".")]
    for count in range(len(parts), 0, -1):
        if importlib.util.find_spec(parts[0]) and _is_module(parts[:count]):
            found: object = importlib.import_module(".".join(parts[:count]))
            for part in parts[count:]:
                found = getattr(found, part, None)
            return found is not None
    return False


def _is_module(parts: Sequence[str]) -> bool:
    try:
        return importlib.util.find_spec(".".join(parts)) is not None
    except ModuleNotFoundError:
        return False


def anchor(heading: str) -> str:
    """As GitHub and MyST make it."""
    text = re.sub(r"[^\w\s-]", "", re.sub(r"`|\*|\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower())
    return re.sub(r"\s", "-", text.strip())


@cache
def anchors(page: Path) -> frozenset[str]:
    """Headings of a page that can be linked to."""
    text = _FENCE.sub("", page.read_text(encoding="utf-8"))
    return frozenset(anchor(heading) for heading in re.findall(r"^#{1,6} (.+)$", text, flags=re.M))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    """Files and headings of this repository; addresses elsewhere are not looked at."""
    broken = []
    for link in _LINK.findall(_FENCE.sub("", page.read_text(encoding="utf-8"))):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, heading = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (heading and heading not in anchors(target)):
            broken.append(link)
    assert broken == []


def test_files_that_pages_name_exist() -> None:
    gone = []
    for page in PAGES:
        if page.name == "CHANGELOG.md":
            continue
        for name in re.findall(
            r"`((?:warpjld|tests|kernels|docs|examples|\.ci|\.github)/[\w./-]+)`", page.read_text("utf-8")
        ):
            if not (ROOT / name).exists():
                gone.append(f"{page.relative_to(ROOT)}: {name}")
    assert gone == []


def statuses() -> dict[str, tuple[type[Enum], str]]:
    """Kinds of statuses, and the heading that explains each."""
    from warpjld import fem, grasp
    from warpjld.covering.calibrate import CalibrationStatus
    from warpjld.simulation.grip.correct import Correction
    from warpjld.simulation.grip.force import ForceStatus
    from warpjld.simulation.grip.search import GripStatus, TrialOutcome

    return {
        "Flexion searches": (grasp.SearchStatus, "##"),
        "Solves": (fem.SolveStatus, "##"),
        "Grips": (GripStatus, "##"),
        "Trials of a grip": (TrialOutcome, "###"),
        "Forces asked for": (ForceStatus, "##"),
        "Corrections": (Correction, "##"),
        "Calibration": (CalibrationStatus, "##"),
    }


def test_every_status_is_explained() -> None:
    page = (DOCS / "reference" / "statuses.md").read_text(encoding="utf-8")
    for heading, (kind, level) in statuses().items():
        part = re.split(r"^#", page.split(f"\n{level} {heading}\n")[1], maxsplit=1, flags=re.M)[0]
        explained = set(re.findall(r"^\| `(\w+)` \|", part, flags=re.M))
        more = {"OVERLAP", "RELEASED", "CRUSHED", "SHORT"} if heading == "Solves" else set()  # the verdict's own
        assert explained == {one.name for one in kind} | more, heading


def test_pages_that_follow_from_the_code_are_up_to_date() -> None:
    place = DOCS / "make_tables.py"
    spec = importlib.util.spec_from_file_location("make_tables", place)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for path, text in module.pages().items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name}: python docs/make_tables.py"


def test_the_readme_is_a_page() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 150


def test_there_is_one_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["dynamic"] == ["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {warpjld.__version__}\n" in citation
    assert (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[1].startswith(warpjld.__version__)


def blocks(page: Path) -> list[tuple[str, str]]:
    """Files that a tutorial has its reader save, and commands it has them run, in order."""
    text = page.read_text(encoding="utf-8")
    pattern = r"<!-- (run|file [\w.]+) -->\n```\w+\n(.*?)\n```"
    return [(what.removeprefix("file "), body) for what, body in re.findall(pattern, text, flags=re.S)]


TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))


@pytest.mark.usefixtures("quick_hands")
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_what_tutorials_have_one_save_is_understood(page: Path, tmp_path: Path) -> None:
    """Scripts are checked without computing, programs compiled; the mark ``slow`` runs them."""
    from warpjld.script.run_script import run_script

    files = [(name, body) for name, body in blocks(page) if name != "run"]
    assert files
    for name, body in files:
        (tmp_path / name).write_text(body, encoding="utf-8")
        if name.endswith(".jld"):
            run_script(tmp_path / name, tmp_path / "out", check=True)
        else:
            compile(body, name, "exec")


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda page: page.stem)
def test_tutorials_run_as_they_are_printed(page: Path, tmp_path: Path) -> None:
    path = os.pathsep.join([str(ROOT), str(ROOT / "kernels"), os.environ.get("PYTHONPATH", "")])
    for what, body in blocks(page):
        if what != "run":
            (tmp_path / what).write_text(body, encoding="utf-8")
            continue
        for line in body.splitlines():
            program, *arguments = line.partition("#")[0].split()
            command = [sys.executable, *(["-m", "warpjld"] if program == "warpjld" else []), *arguments]
            done = subprocess.run(
                command,
                cwd=tmp_path,
                env=os.environ | {"PYTHONPATH": path},
                capture_output=True,
                text=True,
                check=False,
            )
            assert done.returncode == 0, f"{line}\n{done.stdout}\n{done.stderr}"
