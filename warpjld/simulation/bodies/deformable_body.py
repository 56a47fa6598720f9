"""What every deformable body of a simulation is to the solver, whatever drives it: a hand with bones, or an object."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from warpjld.fem import HexMesh, Material, Prescribed
from warpjld.fem.contact.interface.pairs import Exclusion
from warpjld.fem.mesh.embedding import Embedding
from warpjld.simulation.bodies.skin_parts import SkinParts

__all__ = ["Bearing", "DeformableBody", "History", "Surroundings"]


@dataclass(frozen=True, eq=False)
class Bearing:
    """What an object's support bears at the moment it begins to let go.

    Attributes:
        forces: Of the points the object stands on [N], shape (N, 3).
        height: Displacement of the object's handle along the weight's axis [m].
    """

    forces: NDArray[np.float64]
    height: float


@dataclass(frozen=True, eq=False)
class History:
    """What is known of the equilibria so far, on which first guesses and fading supports build.

    Attributes:
        carried: Objects that only hands hold, by the hand that holds most: they go along with it in first guesses.
        bearing: What supports bore when they began to let go, by object.
    """

    carried: Mapping[str, str] = field(default_factory=dict)
    bearing: Mapping[str, Bearing] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What is around a body when its displacement is guessed.

    Attributes:
        carry: Where the hand that alone holds it takes points (n, 3) [m]; None where none does.
        history: What is known of the equilibria so far.
    """

    carry: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None
    history: History


@dataclass(frozen=True, eq=False, kw_only=True)
class DeformableBody(ABC):
    """A volume mesh of N nodes and E elements that carries a visible surface, with what is prescribed of it.

    Times are in frames from the moment at which the body rests; displacements count from there.

    Attributes:
        name: Of the actor or object.
        mesh: As it rests.
        faces: Face set of its outside, which may touch others.
        laws: Constitutive laws by region of the mesh.
        modulus: Young's modulus under its surface [Pa]: the softer of two gives way more.
        stress: At rest [Pa], shape (E, 6).
        surface: Its visible surface at rest [m], shape (V, 3).
        triangles: Of that surface, shape (T, 3).
        embedding: How the mesh carries its vertices.
        embedded: Those that it carries, shape (V,): where flesh is cut off, the others are not.
        pressure_inside: Face set of its inside, and the pressure there above that outside [Pa].
        self_contact: What of its surface never meets, where it may touch itself.
        parts: Of its surface, that may overlap one another.
        pressing: Vertices whose overlap with other parts contact knows of, shape (V,); None: all.
    """

    name: str
    mesh: HexMesh
    faces: str
    laws: Mapping[str, Material]
    modulus: float
    stress: NDArray[np.float64]
    surface: NDArray[np.float64]
    triangles: NDArray[np.int32]
    embedding: Embedding
    embedded: NDArray[np.bool_]
    pressure_inside: tuple[str, float] | None = None
    self_contact: Exclusion | None = None
    parts: SkinParts | None = None
    pressing: NDArray[np.bool_] | None = None

    @abstractmethod
    def deformed(self, displacement: NDArray[np.float64], covered: NDArray[np.floating] | None) -> NDArray[np.float64]:
        """Its visible surface [m], shape (V, 3), under a displacement (N, 3); ``covered`` is a skin without contact."""

    @abstractmethod
    def prescribed(self, time: float, history: History) -> Prescribed:
        """Known displacements at a time."""

    @abstractmethod
    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: Surroundings
    ) -> NDArray[np.float64]:
        """First guess of its displacement at a time from that at an earlier one [m], shape (N, 3)."""

    @abstractmethod
    def way(
        self, times: Sequence[float], displacement: NDArray[np.float64], nodes: NDArray[np.integer]
    ) -> list[NDArray[np.float64]]:
        """Where some of its nodes (n,) are at the first of some times, and are expected at the others [m]."""

    @abstractmethod
    def timed(self, clock: Callable[[float], float]) -> Self:
        """The same body, driven as it is at ``clock(time)``."""
