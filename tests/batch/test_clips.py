"""Which clips a batch has and what they are called."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.batch import clip_jobs
from warpjld.errors import InputError


def names(*files: str) -> list[str]:
    return [job.name for job in clip_jobs(files)]


def test_links_in_a_circle_are_for_the_reader_to_refuse(tmp_path: Path) -> None:
    (tmp_path / "round.bvh").symlink_to("round.bvh")
    assert names(str(tmp_path / "round.bvh")) == ["round"]


def test_a_clip_is_called_as_its_file() -> None:
    assert names("a/walk.bvh", "a/run.bvh") == ["walk", "run"]


def test_files_of_one_name_have_their_folders_or_suffixes_beside() -> None:
    assert names("a/walk.bvh", "b/walk.bvh", "b/run.bvh") == ["a-walk", "b-walk", "run"]
    assert names("a/walk.bvh", "a/Walk.csv") == ["a-walk-bvh", "a-Walk-csv"]
    with pytest.raises(InputError, match="clips of one name"):
        names("x/a/walk.bvh", "y/a/walk.bvh")
    with pytest.raises(InputError, match="given twice"):
        names("a/walk.bvh", "a/../a/walk.bvh")


def test_patterns(tmp_path: Path) -> None:
    for name in ("b.bvh", "a.bvh", "[1].bvh", "c.csv"):
        (tmp_path / name).touch()
    assert sorted(names(str(tmp_path / "?.bvh"))) == ["a", "b"]
    assert names(str(tmp_path / "[1].bvh")) == ["[1]"]  # a file's own name is no pattern
    with pytest.raises(InputError, match=r"no file fits the pattern '.*\*\.fbx'"):
        names(str(tmp_path / "*.fbx"))


@settings(derandomize=True, max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from("abA"), st.text(min_size=1, max_size=3), st.sampled_from([".bvh", ".csv"]))))
def test_names_are_unique_on_any_file_system(parts: list[tuple[str, str, str]]) -> None:
    files = [f"/{folder}/{stem.replace('/', '').replace(chr(0), '') or 'x'}{suffix}" for folder, stem, suffix in parts]
    try:
        found = names(*files)
    except InputError:
        return  # told apart by nothing that a file's name may hold
    assert len({name.casefold() for name in found}) == len(files)
    assert not any(set(name) & set('/\\:*?"<>|\0') or name != name.strip(" .") for name in found)
