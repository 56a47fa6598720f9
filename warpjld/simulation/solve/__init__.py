"""Solving the frames of a contact simulation: start frame, sub-steps, branches, force limits, checks, checkpoints."""
