"""Contact pairs: slave and master surfaces, friction, bonds and excluded facet pairs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.fem.contact.obstacles.obstacle import Obstacle

__all__ = ["Bond", "Exclusion", "Pair"]


@dataclass(frozen=True)
class Bond:
    """Tied contact that fails irreversibly, point by point, where the traction exceeds a strength (R101, R102).

    Attributes:
        normal: Tensile strength [Pa].
        shear: Shear strength [Pa].
        parted: Whether it has failed already at each site of the slave surface, shape (s,); empty: nowhere.
    """

    normal: float = np.inf
    shear: float = np.inf
    parted: tuple[bool, ...] = ()

    def __post_init__(self) -> None:
        for name, value in (("normal", self.normal), ("shear", self.shear)):
            if not value > 0.0:
                raise InputError(f"bond: want a {name} strength above 0 Pa, got {value}")


@dataclass(frozen=True, eq=False)
class Exclusion:
    """Facet pairs excluded from contact: neighbouring phalanges, and parts that touch at rest (R127).

    Attributes:
        slave: Label of each slave face, shape (F,).
        master: Label of each master face, shape (G,).
        never: Pairs of labels without contact, shape (L, L).
        joined: Pairs of labels that belong together, shape (L, L): their facets overlap in a bent joint, which is no
            penetration; ``never`` if left out.
        fringe: Weight of contact between faces of labels that belong together, 0 at their common neighbours, shape
            (F,).
    """

    slave: Ints32
    master: Ints32
    never: Mask
    joined: Mask | None = None
    fringe: Array | None = None


@dataclass(frozen=True, eq=False)
class Pair:
    """A contact pair.

    Attributes:
        slave: Face set, or faces (F, 2), of the body that carries the multipliers: the softer or finer side.
        master: Face set or faces of the same (merged) body, or an obstacle. The same set as ``slave`` is self-contact;
            of two labels the lower one is then the slave.
        friction: Coulomb's μ.
        name: Name in messages and results; composed of its two sides if left out.
        exclusion: Facet pairs without contact.
        bond: Bond between the surfaces from the start.
        sites: Collocation against an obstacle: at the slave's ``nodes``, or at the Gauss points of its ``faces``, which
            takes more iterations and resolves obstacles with edges or tips smaller than a face.
        offset: Height of the touching surface above the mesh at every node of the body [m], shape (N,): a glove, or a
            skin finer than the elements. Gaps are measured from there.
        elastic: Whether contact and bonds give way as an elastic layer of 1/200 of an edge would, not rigid ones.
            Where two bonded sides meet a third in a corner, rigid constraints would be redundant, and their tractions
            indeterminate. For solves with inertia: friction keeps nothing from one step to the next.
    """

    slave: str | Ints32
    master: str | Ints32 | Obstacle
    friction: float = 0.0
    name: str = ""
    exclusion: Exclusion | None = None
    bond: Bond | None = None
    sites: str = "nodes"
    offset: Array | None = None
    elastic: bool = False

    def __post_init__(self) -> None:
        if not (self.friction >= 0.0 and np.isfinite(self.friction)):
            raise InputError(f"{self.title}: want a friction of 0 or more, got {self.friction}")

        if self.offset is not None and not (np.ndim(self.offset) == 1 and np.isfinite(self.offset).all()):
            raise InputError(f"{self.title}: offset: want a finite length for each node")
        if self.sites not in {"nodes", "faces"}:
            raise InputError(f"{self.title}: want sites 'nodes' or 'faces', got '{self.sites}'")

    @property
    def title(self) -> str:
        """Name of the pair in messages."""
        return f"contact '{self.label}'"

    @property
    def label(self) -> str:
        """Its name; composed of its two sides if it has none."""
        if self.name:
            return self.name
        sides = [side if isinstance(side, str) else type(side).__name__.lower() for side in (self.slave, self.master)]
        return f"{sides[0]}–{sides[1]}"
