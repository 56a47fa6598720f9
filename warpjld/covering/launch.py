"""Launches of the covering's kernels over the frames of a batch."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.runtime.threads import in_threads

__all__ = ["lane_of", "launch_gathered", "launch_runs"]

_BUFFERED = 150_000  # vertices × frames computed before they are reordered, few enough to stay in the CPU's caches


def launch_runs(model: list[Any], pose: Any, points: Any, device: Any, threads: int, *, scatter: bool = False) -> None:
    """Deform all frames of ``pose`` (F, columns) into ``points`` (F, V), in the order of the runs.

    Args:
        model: ``tiles``, ``runs``, ``slots``, ``coefficients`` and ``order`` on the device.
        pose: Pose inputs (:func:`~warpjld.covering.runs.palette`) on the device.
        points: Array of vec3 that is filled.
        device: Warp device.
        threads: CPU threads to split the frames over.
        scatter: Write in the surface's order instead, on a GPU.
    """
    from warpjld_kernels.covering_runs import deform_runs

    in_threads(
        lambda a, b: _deform(model, pose[a:b], points[a:b], device, scatter), len(pose), threads, deform_runs, device
    )


def launch_gathered(model: list[Any], lane: Any, pose: Any, points: Any, device: Any, threads: int) -> None:
    """Deform all frames on the CPU in the surface's order: runs into a buffer, then vertex v from lane ``lane[v]``.

    Arguments as for :func:`launch_runs`.
    """
    import warp as wp
    from warpjld_kernels.covering_runs import CPU_FRAMES, deform_runs, gather_lanes

    lanes = len(model[-1])
    together = max(CPU_FRAMES, _BUFFERED // lanes // CPU_FRAMES * CPU_FRAMES)

    def span(begin: int, end: int) -> None:
        packed = wp.empty((min(together, end - begin), lanes + 1), dtype=wp.vec3, device=device)
        for first in range(begin, end, together):
            last = min(first + together, end)
            part = packed[: last - first]
            _deform(model, pose[first:last], part, device, False)
            wp.launch(gather_lanes, dim=last - first, inputs=[part, lane], outputs=[points[first:last]], device=device)

    in_threads(span, len(pose), threads, deform_runs, device)


def _deform(model: list[Any], pose: Any, points: Any, device: Any, scatter: bool) -> None:
    """One launch of ``deform_runs`` over the frames of ``pose``."""
    import warp as wp
    from warpjld_kernels.covering_runs import CPU_FRAMES, deform_runs

    together = CPU_FRAMES if device.is_cpu else 1
    wp.launch(
        deform_runs,
        dim=(-(-len(pose) // together), len(model[0])),
        inputs=[*model, scatter, pose, together],
        outputs=[points],
        device=device,
    )


def lane_of(order: NDArray[np.int32], vertices: int) -> NDArray[np.int32]:
    """Lane of every vertex, shape (V,), from the vertex of every lane; padding lanes at the end are ignored."""
    out = np.empty(vertices, dtype=np.int32)
    out[order[:vertices]] = np.arange(vertices)
    return out
