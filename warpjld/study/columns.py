"""The columns that every study's table begins with."""

from __future__ import annotations

from warpjld.tables.columns import Column

__all__ = ["COMMON_COLUMNS"]

COMMON_COLUMNS = (
    Column("trial", "integer", "", "Number of the trial, from 0: the row to give to --rerun."),
    Column("seed", "text", "", "Spawn key of the trial's generator, numpy SeedSequence(study seed, spawn_key=seed)."),
    Column("status", "text", "", "How the trial ended: a status of the experiment, or 'error', or 'crashed'."),
    Column("message", "text", "", "Error message or remark; empty otherwise."),
)
"""Columns before those of the experiment."""
