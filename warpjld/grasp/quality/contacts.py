"""Contact set: contact points, normals, Coulomb and torsional friction of a hand on an object."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError

__all__ = ["Contacts", "patch_spin"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Contacts:
    """C contacts of a hand on a rigid object, in one frame (the world's, or the object's).

    Attributes:
        points: Contact points [m], shape (C, 3).
        normals: Normals of the object's surface pointing into the object, the direction a finger pushes, shape (C, 3).
            They are normalised here.
        friction: Coulomb coefficient μ, shape (C,) or one number; 0 is a frictionless contact.
        spin: Torsional friction: the largest torque about the normal per newton of normal force [m], shape (C,) or
            one number; 0 is a hard point contact, above 0 a soft finger (see `patch_spin`).
        tangents: First tangent direction of each contact, shape (C, 3), projected and normalised here. It is the first
            edge of the friction cone; chosen arbitrarily if left out.
        digits: Digit (or other label) of each contact.
        areas: Area of skin in contact [m²], shape (C,); 0 where unknown.

    Raises:
        InputError: Wrong shapes, not finite, zero normals, or negative friction, naming the argument.
    """

    points: Array
    normals: Array
    friction: Array
    spin: Array = field(default_factory=lambda: np.zeros(1))
    tangents: Array | None = None
    digits: tuple[str, ...] = ()
    areas: Array = field(default_factory=lambda: np.zeros(1))

    def __post_init__(self) -> None:
        points = _rows("points", self.points)
        normals = _unit("normals", _rows("normals", self.normals, len(points)))
        put = object.__setattr__  # fields of a frozen dataclass cannot be assigned otherwise
        put(self, "points", points)
        put(self, "normals", normals)
        for name in ("friction", "spin", "areas"):
            put(self, name, _numbers(name, getattr(self, name), len(points)))
        put(self, "tangents", _tangents(normals, self.tangents))
        digits = tuple(self.digits) or ("",) * len(points)
        if len(digits) != len(points):
            raise InputError(f"digits: want {len(points)}, one a contact, got {len(digits)}")
        put(self, "digits", digits)

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows: NDArray[np.integer]) -> Contacts:
        """Some of the contacts, as they are."""
        out = object.__new__(Contacts)  # these arrays have been checked and normalised
        for name in ("points", "normals", "friction", "spin", "tangents", "areas"):
            object.__setattr__(out, name, getattr(self, name)[rows])
        object.__setattr__(out, "digits", tuple(self.digits[k] for k in rows))
        return out

    @property
    def frames(self) -> Array:
        """Contact frames as columns: first tangent, second tangent, normal; right-handed, shape (C, 3, 3)."""
        assert self.tangents is not None
        return np.stack([self.tangents, np.cross(self.normals, self.tangents), self.normals], axis=2)

    def moved(self, rotation: ArrayLike | None = None, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Contacts:
        """Contacts after a rigid motion x ↦ R x + t, R of shape (3, 3)."""
        turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
        assert self.tangents is not None
        return Contacts(
            self.points @ turn.T + np.asarray(translation, dtype=np.float64),
            self.normals @ turn.T,
            self.friction,
            self.spin,
            self.tangents @ turn.T,
            self.digits,
            self.areas,
        )


def patch_spin(friction: ArrayLike, areas: ArrayLike) -> Array:
    """Torsional friction [m] of a round patch under uniform pressure: γ = ⅔ μ a, a = √(area/π).

    The torque of a slipping disc, ∫ μ p r dA = ⅔ μ a N (Howe & Cutkosky 1996, "Practical force-motion models for
    sliding manipulation", Int. J. Robotics Research 15).

    Args:
        friction: Coulomb coefficient μ.
        areas: Area of the patch [m²].
    """
    radius = np.sqrt(np.asarray(areas, dtype=np.float64) / np.pi)
    return np.asarray(2.0 / 3.0 * np.asarray(friction, dtype=np.float64) * radius)


def _rows(name: str, values: ArrayLike, count: int | None = None) -> Array:
    """Checked copy of finite rows (count, 3)."""
    array = np.array(values, dtype=np.float64)
    if array.size == 0:
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3 or (count is not None and len(array) != count):
        raise InputError(f"{name}: want shape ({'n' if count is None else count}, 3), got {array.shape}")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if bad.size:
        raise InputError(f"{name}: that of contact {bad[0]} is not finite")
    return array


def _unit(name: str, array: Array) -> Array:
    """Normalised rows; InputError for one of length zero."""
    length = np.linalg.norm(array, axis=1, keepdims=True)
    bad = np.flatnonzero(length < 1e-12)
    if bad.size:
        raise InputError(f"{name}: that of contact {bad[0]} has no direction")
    return array / length


def _numbers(name: str, values: ArrayLike, count: int) -> Array:
    """Checked numbers ≥ 0, one for each contact, shape (count,)."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1 or (array.ndim == 1 and len(array) not in (1, count)):
        raise InputError(f"{name}: want one number, or {count}, one a contact; got shape {array.shape}")
    array = np.broadcast_to(array, (count,)).copy()
    bad = np.flatnonzero(~np.isfinite(array) | (array < 0.0))
    if bad.size:
        raise InputError(f"{name}: want finite numbers ≥ 0, got {array[bad[0]]} for contact {bad[0]}")
    return array


def _tangents(normals: Array, wanted: Array | None) -> Array:
    """Unit tangents nearest to the wanted directions, or arbitrary ones, shape (C, 3)."""
    if wanted is None:
        # the coordinate axis farthest from the normal, which cannot be parallel to it
        wanted = np.eye(3)[np.abs(normals).argmin(axis=1)]
    wanted = _rows("tangents", wanted, len(normals))
    flat = wanted - normals * np.einsum("ci,ci->c", wanted, normals)[:, None]
    return _unit("tangents", flat)
