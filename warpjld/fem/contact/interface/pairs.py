"""Contact pairs: slave and master surfaces, friction, bonds, and what never meets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.fem.contact.obstacles.obstacle import Obstacle

__all__ = ["Bond", "Exclusion", "Pair"]


@dataclass(frozen=True)
class Bond:
    """Two surfaces that are one until the traction between them is too much, point by point and for good (R101, R102).

    Attributes:
        normal: Tension at which they part [Pa].
        shear: Shear at which they part [Pa].
    """

    normal: float = np.inf
    shear: float = np.inf

    def __post_init__(self) -> None:
        for name, value in (("normal", self.normal), ("shear", self.shear)):
            if not value > 0.0:
                raise InputError(f"bond: want a {name} strength above 0 Pa, got {value}")


@dataclass(frozen=True, eq=False)
class Exclusion:
    """Facets that never meet: neighbouring phalanges, and what touches at rest (R127).

    Attributes:
        slave: Label of each slave face, shape (F,).
        master: Label of each master face, shape (G,).
        never: Pairs of labels that are left out, shape (L, L).
        joined: Pairs of labels that belong together, shape (L, L): facets of the two overlap in a bent joint, and are
            not parted; ``never`` if left out.
        fringe: Share with which faces meet those that they belong together with, 0 beside what they are both next to,
            shape (F,).
    """

    slave: Ints32
    master: Ints32
    never: Mask
    joined: Mask | None = None
    fringe: Array | None = None


@dataclass(frozen=True, eq=False)
class Pair:
    """Two surfaces that may touch.

    Attributes:
        slave: Face set, or faces (F, 2), of the body: where pressures live. The softer or the finer side.
        master: Face set or faces of the same (merged) body, or an obstacle. The same set again is self-contact: of two
            labels the lower one is then the slave.
        friction: Coulomb's μ.
        name: For people, and to tell what touches by; its two sides' names if left out.
        exclusion: Facets that never meet.
        bond: Surfaces that are tied from the start.
        sites: Where an obstacle is looked for: at the slave's ``nodes``; or at the integration points of its ``faces``,
            which takes more iterations, and meets obstacles with edges or tips smaller than a face.
        offset: How far what touches lies outside the mesh at every node of the body [m], shape (N,): a glove, or a
            skin finer than the elements. Gaps are measured from there.
    """

    slave: str | Ints32
    master: str | Ints32 | Obstacle
    friction: float = 0.0
    name: str = ""
    exclusion: Exclusion | None = None
    bond: Bond | None = None
    sites: str = "nodes"
    offset: Array | None = None

    def __post_init__(self) -> None:
        if not (self.friction >= 0.0 and np.isfinite(self.friction)):
            raise InputError(f"{self.title}: want a friction of 0 or more, got {self.friction}")

        if self.offset is not None and not (np.ndim(self.offset) == 1 and np.isfinite(self.offset).all()):
            raise InputError(f"{self.title}: offset: want a finite length for each node")
        if self.sites not in {"nodes", "faces"}:
            raise InputError(f"{self.title}: want sites 'nodes' or 'faces', got '{self.sites}'")

    @property
    def title(self) -> str:
        """What it is called in messages."""
        return f"contact '{self.label}'"

    @property
    def label(self) -> str:
        """Its name, or its two sides' where it has none."""
        if self.name:
            return self.name
        sides = [side if isinstance(side, str) else type(side).__name__.lower() for side in (self.slave, self.master)]
        return f"{sides[0]}–{sides[1]}"
