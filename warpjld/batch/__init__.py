"""Batches: many motions on one rig, bound once, processed in parallel, with a manifest, resumable."""

from __future__ import annotations

from typing import TYPE_CHECKING

from warpjld.runtime.lazily import lazy_names

if TYPE_CHECKING:
    from warpjld.batch.clips import ClipJob, clip_jobs
    from warpjld.batch.deform import Deforming, deform_clip
    from warpjld.batch.record import ClipRecord
    from warpjld.batch.run import BatchResult, run_batch
else:
    __getattr__ = lazy_names(
        __name__,
        {
            "ClipJob": "clips",
            "clip_jobs": "clips",
            "Deforming": "deform",
            "deform_clip": "deform",
            "ClipRecord": "record",
            "BatchResult": "run",
            "run_batch": "run",
        },
    )

__all__ = ["BatchResult", "ClipJob", "ClipRecord", "Deforming", "clip_jobs", "deform_clip", "run_batch"]
