"""Deformation of a rig by one motion file: the function behind ``warpjld deform``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from warpjld.batch.deform import ClipFiles, Deforming, deform_clip
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion.tracks import Limits
from warpjld.rig import Rig

if TYPE_CHECKING:
    from warpjld.covering import Parameters
    from warpjld.motion.load import LoadedMotion

__all__ = ["deform_file"]


def deform_file(
    rig: Rig | str | Path,
    motion: str | Path,
    out: str | Path | None = None,
    *,
    motion_out: Sequence[str | Path] = (),
    parameters: Parameters | None = None,
    binding: str | Path | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
    method: Literal["smooth", "paper"] = "smooth",
    touch: Literal["off", "on", "limit"] = "off",
    animation: str | None = None,
    side: Literal["left", "right"] | None = None,
    flat_hand_mean: bool | None = None,
    frames: str | None = None,
    rate: float | None = None,
    limits: Limits = "error",
    device: str = "cpu",
    threads: int | None = None,
    report: Callable[[str, int, int], None] = lambda what, done, total: None,
    moved: LoadedMotion | None = None,
) -> ClipFiles:
    """Deform a rig by a motion file, and write the surface of every frame, or the motion of the rig's joints.

    Args:
        rig: The rig, or its file.
        motion: BVH, CSV, a file with animations, or a recording of hands (see ``load_motion``).
        out: Vertex cache to write; the suffix determines the format (see ``open_cache``).
        motion_out: Files for the motion of the rig's own joints: .bvh, .glb, .usd, .npz.
        parameters: Parameters of the covering; None for the defaults.
        binding: File of a stored binding, as ``warpjld bind`` writes it.
        domains: Source of the vertices' domains: "geometry", or "skin" for painted weights.
        method: "smooth", or "paper" for one segment per vertex as published.
        touch: Whether intersecting skin is separated: "off", "on", or "limit" to close digits only until they touch.
        animation: Name of one of the motion file's animations; the first by default.
        side: Side of a recorded hand, if its file does not state it.
        flat_hand_mean: Whether zero rotations in MANO poses are the flat hand, if the file does not state it.
        frames: ``A:B``, first and last frame, counted from 0; None for all.
        rate: Frames a second; None for the motion's own, 30 for CSV.
        limits: CSV angles beyond a joint's limit: "error", "clamp" or "ignore".
        device: Warp device.
        threads: CPU threads; None chooses their number by the work.
        report: Called with the current activity, the amount done, and the total.
        moved: The motion on this rig where it was read before, by ``load_motion``.

    Raises:
        InputError: Nothing to write, or an unusable rig, motion or path: no file is left then.
        MissingExtraError: A format needs an optional dependency.

    Examples:
        >>> from tempfile import mkdtemp
        >>> folder = Path(mkdtemp())
        >>> _ = (folder / "bend.csv").write_text("frame,index.base.flexion\\n0,0\\n10,60\\n")
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> wj.deform_file(hand, folder / "bend.csv", folder / "bend.npz")
        ClipFiles(bend.npz: 11 frames at 30 a second)
    """
    from warpjld.io.caches import check_cache
    from warpjld.motion.out import check_motion_out

    surfaces = () if out is None else (Path(out),)
    motions = tuple(Path(path) for path in motion_out)
    if not (surfaces or motions):
        raise InputError("out, motion_out: want a file to write")
    for path in surfaces:  # report unknown suffixes and missing libraries before the work of binding
        check_cache(path)
    for path in motions:
        check_motion_out(path)
    how = Deforming(
        rig if isinstance(rig, Rig) else load_rig(rig),
        parameters,
        domains,
        method,
        {"rate": rate, "limits": limits, "side": side, "flat_hand_mean": flat_hand_mean},
        frames,
        device,
        threads,
        touch,
        None if binding is None else Path(binding),
    )
    return deform_clip(how, motion, animation=animation, surfaces=surfaces, motions=motions, report=report, moved=moved)
