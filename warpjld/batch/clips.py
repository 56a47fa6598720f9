"""The clips of a batch and their names."""

from __future__ import annotations

import glob
import os
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["ClipJob", "clip_jobs"]


@dataclass(frozen=True)
class ClipJob:
    """One clip of a batch.

    Attributes:
        name: Unique in the batch regardless of case: the stem of its output files.
        motion: The motion file.
        animation: Name of the animation in it; None for the first or only one.
    """

    name: str
    motion: Path
    animation: str | None = None


def clip_jobs(motions: Sequence[str | Path], animation: str | None = None) -> list[ClipJob]:
    """Clips of motion files, in their order.

    A clip has its file's name. Files of the same name are prefixed by their folder's name, files that differ only in
    suffix get the suffix appended; an animation's name is appended to that of its file.

    Args:
        motions: Files; a name with ``*``, ``?`` or ``[`` that is not a file is a pattern.
        animation: Name of the animation to use of every file, or ``all``.

    Raises:
        InputError: A pattern without matches, a file given twice, or names that remain ambiguous.
    """
    files = [file for motion in motions for file in _files(motion)]
    places = Counter(os.path.realpath(file) for file in files)  # Path.resolve raises for circular links
    twice = [file for file, count in places.items() if count > 1]
    if twice:
        raise InputError("is given twice", path=twice[0])
    jobs = []
    for file, name in zip(files, _names(files), strict=True):
        if animation == "all":
            from warpjld.motion.animations import animation_names

            found = animation_names(file)
            suffixes = _told_apart([_safe(title) for title in found])
            if len(found) < 2:
                jobs.append(ClipJob(name, file))
            else:
                jobs += [ClipJob(f"{name}.{end}", file, title) for end, title in zip(suffixes, found, strict=True)]
        else:
            jobs.append(ClipJob(name, file, animation))
    if same := _repeated(job.name for job in jobs):
        raise InputError(f"two clips would be called '{same.pop()}': rename a motion file or an animation")
    return jobs


def _files(motion: str | Path) -> list[Path]:
    path = Path(motion)
    if path.exists() or not glob.has_magic(str(motion)):
        return [path]
    found = sorted(Path(name) for name in glob.glob(str(motion)))  # for shells that do not expand patterns
    if not found:
        raise InputError(f"no file fits the pattern '{motion}'")
    return found


def _names(files: Sequence[Path]) -> list[str]:
    names = [_safe(file.stem) for file in files]
    for lengthen in (
        lambda name, file: f"{_safe(Path(os.path.realpath(file)).parent.name)}-{name}",
        lambda name, file: f"{name}-{file.suffix.lstrip('.')}",
    ):
        same = _repeated(names)
        names = [lengthen(n, f) if n.casefold() in same else n for n, f in zip(names, files, strict=True)]
    same = _repeated(names)
    if same:
        clash = [file for name, file in zip(names, files, strict=True) if name.casefold() in same]
        raise InputError(f"{clash[0]} and {clash[1]} would be clips of one name: rename one")
    return names


def _told_apart(names: Sequence[str]) -> list[str]:
    """Names, with a number appended to repeated ones."""
    seen: Counter[str] = Counter()
    out = []
    for name in names:
        seen[name.casefold()] += 1
        count = seen[name.casefold()]
        out.append(name if count == 1 else f"{name}-{count}")
    return out


def _repeated(names: Iterable[str]) -> set[str]:
    return {name for name, count in Counter(name.casefold() for name in names).items() if count > 1}


def _safe(name: str) -> str:
    """A name that is valid in every file system."""
    plain = re.sub(r'[\x00-\x1f<>:"/\\|?*]+', "_", name).strip(" .")
    return plain or "clip"
