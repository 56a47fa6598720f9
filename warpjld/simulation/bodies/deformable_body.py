"""Interface of deformable bodies to the contact solver: a hand with bones, or an object."""

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

__all__ = ["DeformableBody", "History", "Surroundings"]


@dataclass(frozen=True, eq=False)
class History:
    """Facts about earlier equilibria that predictors depend on.

    Attributes:
        carried: Object → hand that presses most on it, for objects in contact with hands only; the predictor moves them
            along with that hand.
    """

    carried: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Context for predicting the displacement of a body.

    Attributes:
        carry: Rigid motion of points (n, 3) [m] with the hand that holds the body; None if no hand alone holds it.
        history: Facts about the equilibria so far.
    """

    carry: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None
    history: History


@dataclass(frozen=True, eq=False, kw_only=True)
class DeformableBody(ABC):
    """A volume mesh of N nodes and E elements with Dirichlet conditions and an embedded visible surface.

    Times are in frames from the reference configuration (time 0); displacements are relative to it.

    Attributes:
        name: Name of the actor or object.
        mesh: Mesh in the reference configuration.
        faces: Face set of its outer surface, which takes part in contact.
        laws: Constitutive laws by region of the mesh.
        modulus: Young's modulus below its surface [Pa]; the softer body of a pair is the slave.
        stress: Initial stress [Pa], shape (E, 6).
        surface: Its visible surface at time 0 [m], shape (V, 3).
        triangles: Triangles of that surface, shape (T, 3).
        embedding: Embedding of the visible vertices in the mesh.
        embedded: Mask of the vertices that the mesh carries, shape (V,); the others lie where the flesh is cut off.
        pressure_inside: Face set of its inner surface, and the gauge pressure there [Pa]; None without pressure.
        self_contact: Pairs of facets excluded from self-contact; None without self-contact.
        parts: Parts of its surface that may overlap one another; None if it has none.
        pressing: Mask of vertices whose overlap with other parts is resolved by contact, shape (V,); None: all.
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
        """Visible surface [m], shape (V, 3), under a displacement (N, 3).

        ``covered`` is the skin as the covering alone deforms it [m], shape (V, 3); None for objects.
        """

    @abstractmethod
    def prescribed(self, time: float, history: History) -> Prescribed:
        """Dirichlet conditions at a time."""

    @abstractmethod
    def guess(
        self, before: float, time: float, displacement: NDArray[np.float64], around: Surroundings
    ) -> NDArray[np.float64]:
        """Predictor: displacement at ``time`` estimated from that at ``before`` [m], shape (N, 3)."""

    @abstractmethod
    def path(
        self, times: Sequence[float], displacement: NDArray[np.float64], nodes: NDArray[np.integer]
    ) -> list[NDArray[np.float64]]:
        """Positions of nodes (n,) at the first time and predicted ones at the others [m], each of shape (n, 3)."""

    @abstractmethod
    def timed(self, clock: Callable[[float], float]) -> Self:
        """A copy whose boundary conditions at ``time`` are those of this body at ``clock(time)``."""
