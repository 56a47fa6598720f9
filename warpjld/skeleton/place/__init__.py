"""Proposal of named points from a surface alone: 87 in a body, 25 in a hand (B §2.1, R12, R13)."""
