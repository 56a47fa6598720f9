"""A reader's questions are answered in two steps: a row of the index leads to a heading, and a line under it answers.

Commands, options and script commands that the pages print exist.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from tests.test_docs import DOCS, PAGES, ROOT, anchor

QUESTIONS = {
    "modified normal": ("explanation/operators.md", r"average of the normals carried by the two segments"),
    "add a grasp metric": ("explanation/metrics.md", r"function of `Contacts`.*`warpjld/grasp/quality/`"),
    "UNHELD": ("reference/statuses.md", r"`UNHELD` \|.*\| .*`HOLD` points of it"),
    "unit has INFLATION": ("reference/scripts.md", r"`INFLATION` \|.*\| none: share of"),
    "with friction": ("reference/scripts.md", r"^FRICTION LEFT BALL 0\.6"),
    "not recognised": ("how-to/own-rig.md", r"warpjld inspect RIG --write-map map\.json"),
    "contact.csv": ("reference/tables.md", r"`area_mm2`, `peak_kpa` \| area under pressure \[mm²\]"),
    "study on a cluster": ("how-to/cluster.md", r"warpjld study study\.toml -o out --ray first:6379"),
    "grasps scored": ("explanation/metrics.md", r"\*\*score\*\* \[N\]: epsilon plus 0\.01 N"),
    "not do": ("explanation/limits.md", r"face editor"),
}
"""Words of a question in the index: the page that answers, and what a line there matches."""

_ROW = re.compile(r"^\| ([^|]+\?) \| (.+) \|$", re.M)
_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_JLD = re.compile(r"^```jld\n(.*?)^```", re.M | re.S)
_FENCE = re.compile(r"^```(?:sh)?\n(.*?)^```|^ {4}(warpjld .*)$", re.M | re.S)
_INLINE = re.compile(r"`(warpjld [^`]+)`")


def section(page: Path, heading: str) -> str:
    """Text under a heading, up to the next of the same level or above."""
    lines: list[str] = []
    level = 0
    fenced = False
    for line in page.read_text(encoding="utf-8").splitlines():
        fenced ^= line.startswith("```")
        found = None if fenced else re.match(r"(#{1,6}) (.+)$", line)
        if level and found and len(found[1]) <= level:
            break
        if level:
            lines.append(line)
        elif found and anchor(found[2]) == heading:
            level = len(found[1])
    return "\n".join(lines)


@pytest.mark.parametrize("words", QUESTIONS)
def test_the_index_leads_to_the_answer(words: str) -> None:
    """Step one is the row's link, step two the heading that it names."""
    page, answer = QUESTIONS[words]
    rows = [(question, place) for question, place in _ROW.findall((DOCS / "index.md").read_text("utf-8"))]
    (link,) = [_LINK.findall(place)[0] for question, place in rows if words in question]
    path, _, heading = link.partition("#")
    assert path == page
    assert heading, "the row names no heading"
    text = section(DOCS / path, heading)
    assert re.search(answer, text, re.M), f"{link} does not answer"


def command_lines() -> Iterator[tuple[str, str]]:
    """Commands of the program that pages print, with their page."""
    for page in PAGES:
        if page.name == "CHANGELOG.md":  # past versions
            continue
        text = page.read_text(encoding="utf-8")
        printed = [one or two for one, two in _FENCE.findall(text)]
        for line in "\n".join([*printed, *_INLINE.findall(text)]).splitlines():
            if match := re.search(r"(?:^|&& |\| )warpjld +(.+)", line.split(" #")[0]):
                yield page.name, match[1]


def test_commands_and_options_that_pages_print_exist() -> None:
    from warpjld.cli import command_group

    context = click.Context(command_group)
    lines = list(command_lines())
    assert len(lines) > 80
    wrong = []
    for page, line in lines:
        words = re.sub(r"^(--limit \S+ |-\w+ )+", "", line).split()
        if words[0].startswith("-") or words[0] == "…":  # the program's own options
            continue
        command = command_group.get_command(context, words[0])
        if command is None:
            wrong.append(f"{page}: warpjld {words[0]}")
            continue
        there = {name for one in command.params for name in (*one.opts, *one.secondary_opts)} | {"-h", "--help"}
        given = [word.partition("=")[0] for word in words[1:] if re.match(r"--?[a-z]", word)]
        wrong += [f"{page}: warpjld {words[0]} {word}" for word in given if word not in there]
    assert wrong == []


def test_script_commands_that_pages_print_exist() -> None:
    from warpjld.script.registry import all_commands

    known = {*(one.name for one in all_commands()), "MACRO", "END"}
    wrong = []
    blocks = 0
    for page in PAGES:
        for block in _JLD.findall(page.read_text(encoding="utf-8")):
            blocks += 1
            for line in block.splitlines():
                words = line.partition("#")[0].split()
                if words and words[0].upper() not in known:
                    wrong.append(f"{page.relative_to(ROOT)}: {words[0]}")
    assert blocks > 5
    assert wrong == []
