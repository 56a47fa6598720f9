"""Body forces, surface loads and point loads as equivalent nodal forces (B eqs. 1–4, R97)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32, cross_matrix
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.mesh.hexmesh import FACES, HexMesh
from warpjld.fem.mesh.shape import POINTS, shape_at, slope_at

__all__ = ["Centrifugal", "Loads", "external_forces", "subtract_pressure_stiffness", "volumes"]

_QUAD = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
"""Reference coordinates of a quadrilateral's corners."""


@dataclass(frozen=True)
class Centrifugal:
    """Steady rotation of a body: each element is driven outwards by ρ ω² × its distance from the axis.

    Attributes:
        axis: Direction of the axis, of any length above zero.
        point: A point on it [m].
        speed: Angular speed [rad/s].
        region: Region of the mesh that turns; all of it if left out.
    """

    axis: tuple[float, float, float]
    speed: float
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    region: str | None = None


@dataclass(frozen=True)
class Loads:
    """All loads on a body at full strength; load increments scale them (R99).

    Attributes:
        gravity: Acceleration [m/s²].
        centrifugal: A steady rotation, several of different regions, or None.
        pressure: Pressure on named faces [Pa], against their outward normal; a follower load, normal to the deformed
            surface, for large-strain laws.
        traction: Force per rest area on named faces [Pa], of constant direction.
        forces: Point load [N], distributed equally over the nodes of a set.
        nodal: Nodal forces [N], shape (N, 3), or None.
        drag: Viscosity of a medium around the nodes, force over speed [N per m and unit of time], shape (N,), or None.
            It opposes motion since the start of a load step, and leaves no force once nothing moves; ``press`` alone
            knows it.
    """

    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    centrifugal: Centrifugal | tuple[Centrifugal, ...] | None = None
    pressure: Mapping[str, float] = field(default_factory=dict)
    traction: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    forces: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    nodal: Array | None = None
    drag: Array | None = None

    @property
    def follows(self) -> bool:
        """Whether they depend on where the body is; dead loads do not."""
        return self.centrifugal is not None or bool(self.pressure)

    @property
    def turns(self) -> tuple[Centrifugal, ...]:
        """Steady turns."""
        turn = self.centrifugal
        return turn if isinstance(turn, tuple) else () if turn is None else (turn,)

    def scaled(self, share: float) -> Loads:
        """A share of the loads; the rotation is slowed down such that its forces are scaled, too."""
        slower = tuple(replace(turn, speed=turn.speed * float(np.sqrt(share))) for turn in self.turns)
        return Loads(
            gravity=_scaled(self.gravity, share),
            centrifugal=slower or None,
            pressure={name: share * p for name, p in self.pressure.items()},
            traction={name: _scaled(t, share) for name, t in self.traction.items()},
            forces={name: _scaled(f, share) for name, f in self.forces.items()},
            nodal=None if self.nodal is None else share * self.nodal,
            drag=self.drag,
        )


def external_forces(body: Body, loads: Loads, displacement: Array | None = None) -> Array:
    """Nodal forces of the loads [N], shape (3N,); pressure and centrifugal force in the displaced configuration.

    Raises:
        InputError: A load on unknown faces or nodes, or one that is not finite.
    """
    mesh = body.mesh
    now = mesh.nodes if displacement is None else mesh.nodes + displacement.reshape(-1, 3)
    out = np.zeros((len(mesh.nodes), 3))
    gravity = _vector(loads.gravity, "gravity")
    if gravity.any() or loads.turns:
        shape = shape_at(POINTS)
        weight = volumes(mesh) * body.density[:, None]
        if gravity.any():
            share = weight @ shape
            _scatter(out, mesh.elements, share[:, :, None] * gravity)
        for turn in loads.turns:
            _add_turn(out, mesh, weight, turn, now)
    for name, pressure in loads.pressure.items():
        corners = mesh.quads(_faces(mesh, name, "pressure"))
        value = float(_vector(pressure, f"pressure on {name}"))
        _scatter(out, corners, -value * _area_vectors(now[corners]))
    for name, traction in loads.traction.items():
        corners = mesh.quads(_faces(mesh, name, "traction"))
        x = mesh.nodes[corners]
        area = np.zeros(corners.shape)
        for n, along, across in _quad_points():
            size = np.linalg.norm(np.cross(along @ x, across @ x), axis=1)
            area += size[:, None] * n
        _scatter(out, corners, area[:, :, None] * _vector(traction, f"traction on {name}"))
    for name, force in loads.forces.items():
        nodes = mesh.node_set(name)
        out[nodes] += _vector(force, f"force on {name}") / len(nodes)
    if loads.nodal is not None:
        if loads.nodal.shape != out.shape or not np.isfinite(loads.nodal).all():
            raise InputError(f"loads: nodal forces want shape {out.shape} and finite values")
        out += loads.nodal
    return out.reshape(-1)


def _add_turn(out: Array, mesh: HexMesh, weight: Array, turn: Centrifugal, now: Array) -> None:
    """Add the centrifugal forces of a turn, with the weight of integration points (E, 8) [kg] and nodes at ``now``."""
    axis = _vector(turn.axis, "centrifugal axis")
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise InputError("loads: the centrifugal axis has no direction")
    axis /= length
    mine = np.ones(len(mesh.elements), dtype=bool) if turn.region is None else mesh.region(turn.region)
    elements, shape = mesh.elements[mine], shape_at(POINTS)
    at = shape @ now[elements] - _vector(turn.point, "centrifugal point")
    at -= (at @ axis)[:, :, None] * axis
    pull = (turn.speed**2 * weight[mine])[:, :, None] * at
    _scatter(out, elements, np.einsum("qa,eqi->eai", shape, pull))


def subtract_pressure_stiffness(
    stiffness: BlockMatrix, body: Body, loads: Loads, displacement: Array, factor: float = 1.0
) -> None:
    """Subtract the load stiffness of follower pressure, its symmetric part, in place.

    Over a closed surface, or one with a fixed rim, skew parts of neighbouring faces cancel, so that nothing is lost.
    """
    mesh = body.mesh
    now = mesh.nodes + displacement.reshape(-1, 3)
    for name, pressure in loads.pressure.items():
        faces = _faces(mesh, name, "pressure")
        corners = mesh.quads(faces)
        x = now[corners]
        tangent = np.zeros((len(corners), 4, 4, 3, 3))
        for n, along, across in _quad_points():
            first, second = cross_matrix(along @ x), cross_matrix(across @ x)
            for a in range(4):
                for b in range(4):
                    tangent[:, a, b] -= factor * pressure * n[a] * (across[b] * first - along[b] * second)
        tangent = 0.5 * (tangent + tangent.transpose(0, 2, 1, 4, 3))
        local = FACES[faces[:, 1]]
        slot = body.pattern.slots[faces[:, 0][:, None, None], 8 * local[:, :, None] + local[:, None, :]]
        np.subtract.at(stiffness.values, slot.reshape(-1), tangent.reshape(-1, 3, 3))


def volumes(mesh: HexMesh) -> Array:
    """Rest volume of each of the eight integration points [m³], shape (E, 8)."""
    jacobian = np.einsum("eai,qaj->eqij", mesh.nodes[mesh.elements], slope_at(POINTS))
    out: Array = np.linalg.det(jacobian)
    return out


def _quad_points() -> list[tuple[Array, Array, Array]]:
    """Shape functions and their two derivatives at the 2 × 2 Gauss points of a face."""
    out = []
    for s, t in _QUAD / np.sqrt(3.0):
        u, v = 1.0 + _QUAD[:, 0] * s, 1.0 + _QUAD[:, 1] * t
        out.append((u * v / 4.0, _QUAD[:, 0] * v / 4.0, _QUAD[:, 1] * u / 4.0))
    return out


def _area_vectors(x: Array) -> Array:
    out = np.zeros(x.shape)
    for n, along, across in _quad_points():
        out += n[:, None] * np.cross(along @ x, across @ x)[:, None, :]
    return out


def _scatter(out: Array, corners: Ints32, values: Array) -> None:
    for axis in range(3):
        out[:, axis] += np.bincount(corners.ravel(), weights=values[:, :, axis].ravel(), minlength=len(out))


def _faces(mesh: HexMesh, name: str, kind: str) -> Ints32:
    try:
        faces = mesh.face_set(name)
    except InputError as error:
        raise InputError(f"loads: {kind} on a missing face set: {error.message}") from error
    if len(faces) == 0:
        raise InputError(f"loads: {kind} on face set '{name}', which is empty")
    return faces


def _scaled(vector: tuple[float, float, float], share: float) -> tuple[float, float, float]:
    x, y, z = (share * float(v) for v in vector)
    return x, y, z


def _vector(value: ArrayLike, name: str) -> Array:
    out = np.array(value, dtype=np.float64)
    if out.shape not in {(), (3,)} or not np.isfinite(out).all():
        raise InputError(f"loads: {name}: want finite numbers, got {out}")
    return out
