"""What is said where a stiffness that should be positive definite is not."""

from __future__ import annotations

from warpjld.errors import WarpjldError

__all__ = ["IndefiniteError"]


class IndefiniteError(WarpjldError):
    """A matrix that should be positive definite is not."""
