"""Frame of a hand's palm at rest: centre, normal and direction of the fingers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton import Skeleton

__all__ = ["Palm", "palm_of"]

_TOWARDS_KNUCKLE = 0.75  # place of the palm's centre along the middle metacarpal, from the wrist
_BESIDE = 0.15  # radius, relative to the metacarpal's length, of the skin that is averaged at the palm's centre


@dataclass(frozen=True, eq=False)
class Palm:
    """A hand's palm at rest.

    Attributes:
        middle: Palm centre, three quarters along the middle finger's metacarpal, or on the skin there [m], shape (3,).
        normal: Unit normal out of the palm, shape (3,).
        fingers: Unit direction towards the fingers, perpendicular to the normal, shape (3,).
        length: Length of the metacarpal [m].
    """

    middle: NDArray[np.float64]
    normal: NDArray[np.float64]
    fingers: NDArray[np.float64]
    length: float

    def on_skin(self, vertices: NDArray[np.floating]) -> Palm:
        """Copy with its centre moved along the normal to the hand's skin.

        Args:
            vertices: The skin at rest [m], shape (V, 3).

        Raises:
            InputError: There is no skin on that side.
        """
        away = vertices - self.middle
        height = away @ self.normal
        beside = np.linalg.norm(away - height[:, None] * self.normal, axis=1)
        # limited height: in a body's rest pose the thigh may lie beyond the palm
        near = (beside < _BESIDE * self.length) & (height > 0.0) & (height < self.length)
        if not near.any():
            raise InputError("hand: found no skin on the palm's side of the middle metacarpal")
        return replace(self, middle=self.middle + float(height[near].mean()) * self.normal)

    def turned_to(self, normal: NDArray[np.float64], fingers: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotations that turn the palm's normal to ``normal`` and its fingers to ``fingers``.

        Args:
            normal: Unit directions, shape (…, 3).
            fingers: Unit directions perpendicular to those, shape (…, 3).

        Returns:
            Rotation matrices, shape (…, 3, 3).
        """
        own = np.stack([self.normal, self.fingers, np.cross(self.normal, self.fingers)])
        wanted = np.stack([normal, fingers, np.cross(normal, fingers)], axis=-2)
        return np.asarray(np.einsum("...ki,kj->...ij", wanted, own))


def palm_of(skeleton: Skeleton, side: str | None = None) -> Palm:
    """The palm of a skeleton's hand; of the only hand if ``side`` is not given.

    Raises:
        InputError: There is no such hand, it has no middle finger, or there are two.
    """
    wrist, knuckle = (skeleton.index(name if side is None else f"{side}.{name}") for name in ("wrist", "middle.base"))
    metacarpal = skeleton.rest[knuckle] - skeleton.rest[wrist]
    fingers = unit(metacarpal)
    # segment × flexion axis points to the back of the hand (R20)
    look = -np.cross(skeleton.directions[knuckle], skeleton.axes[knuckle])
    middle = _TOWARDS_KNUCKLE * skeleton.rest[knuckle] + (1.0 - _TOWARDS_KNUCKLE) * skeleton.rest[wrist]
    return Palm(middle, unit(look - fingers * (look @ fingers)), fingers, float(np.linalg.norm(metacarpal)))
