"""Batches: many motions on one rig, bound once, processed in parallel, with a manifest, resumable."""

from warpjld.batch.clips import ClipJob, clip_jobs
from warpjld.batch.deform import Deforming, deform_clip
from warpjld.batch.record import ClipRecord
from warpjld.batch.run import BatchResult, run_batch

__all__ = ["BatchResult", "ClipJob", "ClipRecord", "Deforming", "clip_jobs", "deform_clip", "run_batch"]
