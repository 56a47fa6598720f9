"""Cauchy stresses of a solution, in elements and averaged at nodes."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.material.materials import NEO_HOOKE
from warpjld.fem.mesh.shape import CENTRE_GRADIENT, POINTS, slope_at

__all__ = ["at_nodes", "cauchy", "mises"]


def cauchy(body: Body, displacement: Array) -> Array:
    """Cauchy stress at the centre of each element [Pa], xx yy zz xy yz zx, shape (E, 6).

    The pressure is that of the formulation, κ (θ − 1) or κ tr ε of the element's mean dilatation, which does not
    oscillate within the element. The divergence at the centre differs, and κ magnifies the difference near ν = ½.
    """
    u = displacement.reshape(-1, 3)[body.mesh.elements]
    x = body.mesh.nodes[body.mesh.elements]
    jacobian = np.einsum("eai,aj->eij", x, CENTRE_GRADIENT)
    slope = np.einsum("eai,aj->eij", u, CENTRE_GRADIENT) @ np.linalg.inv(jacobian)
    c10, c01, bulk, stiffening = body.constants.T
    identity = np.eye(3)
    strain = 0.5 * (slope + slope.transpose(0, 2, 1))
    spread = np.einsum("eii->e", strain)
    linear = 4.0 * (c10 + c01)[:, None, None] * (strain - spread[:, None, None] / 3.0 * identity)
    linear += (bulk * _mean_divergence(x, u))[:, None, None] * identity
    stress = linear + _matrix(body.initial_stress)
    large = body.kinds >= NEO_HOOKE
    if large.any():
        f = identity + slope[large]
        volume = np.linalg.det(f)
        b = f @ f.transpose(0, 2, 1) * (volume ** (-2.0 / 3.0))[:, None, None]
        first = np.einsum("eii->e", b)[:, None, None]
        slope = c10[large, None, None] * np.exp(stiffening[large, None, None] * (first - 3.0))
        tau = 2.0 * slope * b + 2.0 * c01[large, None, None] * (first * b - b @ b)
        tau -= np.einsum("eii->e", tau)[:, None, None] / 3.0 * identity
        tau += f @ _matrix(body.initial_stress[large]) @ f.transpose(0, 2, 1)
        pressure = body.at(displacement, stiffness=False).pressures[large]
        stress[large] = tau / volume[:, None, None] + pressure[:, None, None] * identity
    return np.stack([stress[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))], axis=1)


def _mean_divergence(x: Array, u: Array) -> Array:
    """Mean of ∇·u over elements with corners x and displacements u (E, 8, 3), as in B-bar elements, shape (E,)."""
    total, volume = np.zeros(len(x)), np.zeros(len(x))
    for local in slope_at(POINTS):
        jacobian = np.einsum("eai,aj->eij", x, local)
        weight = np.linalg.det(jacobian)
        slope = np.einsum("eai,aj->eij", u, local)
        total += weight * np.einsum("eij,eji->e", slope, np.linalg.inv(jacobian))
        volume += weight
    return np.asarray(total / volume)


def mises(stress: Array) -> Array:
    """Von Mises equivalent stress of stresses (…, 6)."""
    xx, yy, zz, xy, yz, zx = np.moveaxis(stress, -1, 0)
    squared = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + zx**2)
    out: Array = np.sqrt(squared)
    return out


def at_nodes(body: Body, values: Array) -> Array:
    """Element values averaged over the elements at each node, weighted by their volume, shape (N, …)."""
    from warpjld.fem.load.loads import volumes

    weight = volumes(body.mesh).sum(axis=1)
    flat = values.reshape(len(values), -1)
    corners = body.mesh.elements.ravel()
    count = len(body.mesh.nodes)
    total = np.bincount(corners, weights=np.repeat(weight, 8), minlength=count)
    out = np.empty((count, flat.shape[1]))
    for k in range(flat.shape[1]):
        out[:, k] = np.bincount(corners, weights=np.repeat(weight * flat[:, k], 8), minlength=count) / total
    return out.reshape(count, *values.shape[1:])


def _matrix(voigt: Array) -> Array:
    return voigt[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
