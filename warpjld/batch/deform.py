"""Processing of one clip on one rig: read the motion, deform the surface, write all outputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from warpjld.errors import InputError
from warpjld.motion.load import LoadedMotion, load_motion
from warpjld.rig import Rig

if TYPE_CHECKING:
    from warpjld.covering import Covering, Parameters

__all__ = ["ClipFiles", "Deforming", "deform_clip", "frame_span"]


@dataclass(frozen=True, eq=False)
class Deforming:
    """A rig and the settings of its deformation.

    Attributes:
        rig: The rig.
        parameters: Parameters of the covering; None for the defaults.
        domains: As of ``bind``; likewise ``method``.
        reading: Keyword arguments of ``load_motion``: rate, limits, side.
        span: ``A:B``, first and last frame, counted from 0; None for all.
        device: Warp device.
        threads: CPU threads; None chooses their number by the work.
        touch: Whether intersecting skin is separated: "off", "on", or "limit" to close digits only until they touch.
        binding: File of a stored binding; None for the cache's.
    """

    rig: Rig
    parameters: Parameters | None = None
    domains: Literal["geometry", "skin"] = "geometry"
    method: Literal["smooth", "paper"] = "smooth"
    reading: dict[str, Any] = field(default_factory=dict)
    span: str | None = None
    device: str = "cpu"
    threads: int | None = None
    touch: Literal["off", "on", "limit"] = "off"
    binding: Path | None = None

    @cached_property
    def covering(self) -> Covering:
        """The rig's surface, bound on first access; copies sent to other processes contain it."""
        return self.bound[0]

    @cached_property
    def bound(self) -> tuple[Covering, tuple[str, ...]]:
        """The covering, and notes on how it was obtained."""
        from warpjld.covering.kept import bind_kept

        how = {"parameters": self.parameters, "domains": self.domains, "method": self.method}
        return bind_kept(self.rig, path=self.binding, **how)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class ClipFiles:
    """Outputs of one clip.

    Attributes:
        files: Files written.
        frames: Number of frames; ``first`` the number of the first.
        moved: The motion on the rig.
        notes: Information for users of the files.
        warnings: What of the motion is not followed or not written, and what looks wrong.
    """

    files: tuple[Path, ...]
    frames: int
    first: int
    moved: LoadedMotion
    notes: tuple[str, ...]
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        names = ", ".join(file.name for file in self.files[:3]) + (", …" if len(self.files) > 3 else "")
        doubts = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"ClipFiles({names}: {self.frames} frames at {self.moved.rate:g} a second{doubts})"


def deform_clip(
    how: Deforming,
    motion: str | Path,
    *,
    animation: str | None = None,
    surfaces: tuple[Path, ...] = (),
    motions: tuple[Path, ...] = (),
    report: Callable[[str, int, int], None] = lambda what, done, total: None,
    moved: LoadedMotion | None = None,
) -> ClipFiles:
    """Deform a rig by a motion file, and write its surface or the motion of its joints.

    Args:
        how: The rig and the settings.
        motion: The motion file.
        animation: Name of the animation to use; None for the first.
        surfaces: Vertex caches to write; suffixes determine their formats.
        motions: Files for the motion of the rig's own joints, likewise.
        report: Called with the current activity, the amount done, and the total.
        moved: The motion on this rig where it was read before.

    Raises:
        InputError: A motion that cannot be read or does not fit the rig, frames it does not have, or a file that
            cannot be written. No file is left then.
    """
    from contextlib import ExitStack

    from warpjld.covering.blocks import FEW_FRAMES
    from warpjld.covering.device import checked_device
    from warpjld.io.caches import open_cache
    from warpjld.motion.out import write_motion

    if surfaces:
        checked_device(how.device)
    rig = how.rig
    if moved is None:
        moved = load_motion(motion, rig, animation=animation, **how.reading)
    first, last = frame_span(how.span, len(moved.poses))
    poses = moved.poses[slice(first, last + 1)]
    contact = None
    if how.touch != "off":
        from warpjld.touch.contact import SkinContact

        contact = SkinContact(how.covering, limits=how.touch == "limit")
        poses = contact.poses(poses, first=first)
    caches = []
    with ExitStack() as opened:
        for path in surfaces:
            cache = open_cache(path, rig.surface, frames=len(poses), rate=moved.rate, start_frame=first, name=rig.name)
            caches.append(opened.enter_context(cache))
        if caches:
            report("binding", 0, len(poses))
            many = None if contact is None else FEW_FRAMES
            for start, block in how.covering.blocks(poses, frames=many, device=how.device, threads=how.threads):
                some = poses[start : start + len(block)]
                parted = block if contact is None else contact.skin(block, some, first=first + start)
                for cache in caches:
                    cache.write(parted)
                report("deforming", start + len(block), len(poses))
        # inside the block, so that a failure to write a motion leaves no cache
        told = [write_motion(path, rig, poses, rate=moved.rate, start_frame=first) for path in motions]
    return ClipFiles(
        files=(*(file for cache in caches for file in cache.files), *motions),
        frames=len(poses),
        first=first,
        moved=moved,
        notes=(
            *(how.bound[1] if caches else ()),
            *(cache.note for cache in caches if cache.note),
            *(note for one in told for note in one.notes),
        ),
        warnings=(
            *moved.warnings,
            *(() if contact is None else contact.messages()),
            *(warning for one in told for warning in one.warnings),
        ),
    )


def frame_span(text: str | None, count: int) -> tuple[int, int]:
    """First and last frame of ``A:B``; either may be left out.

    Raises:
        InputError: Not of that form, or beyond the motion's frames.
    """
    if text is None:
        return 0, count - 1
    left, colon, right = text.partition(":")
    try:
        first, last = int(left or 0), int(right) if right else (count - 1 if colon else int(left))
    except ValueError:
        raise InputError(f"--frames '{text}': want two frame numbers, such as 10:60") from None
    if not 0 <= first <= last < count:
        raise InputError(f"--frames '{text}': the motion has frames 0 to {count - 1}")
    return first, last
