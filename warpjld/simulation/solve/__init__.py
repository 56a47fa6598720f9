"""Frames solved one after another: the start, sub-steps, branches, checks before and after, checkpoints."""
