"""Binding of a surface to a skeleton: domains of the operators, then coordinates of every vertex (A §4)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import anchor
from warpjld.covering.covering import Covering
from warpjld.covering.domains import domains_from_geometry, domains_from_skin
from warpjld.covering.operators import fans
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.rigid import domains_of_rigid, part_of_surface
from warpjld.errors import InputError
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig, Skin
from warpjld.skeleton.tree import Skeleton

__all__ = ["bind", "bind_rig"]


def bind(
    skeleton: Skeleton,
    surface: Surface,
    *,
    parameters: Parameters | None = None,
    skin: Skin | None = None,
    rigid: NDArray[np.int32] | None = None,
    domains: Literal["geometry", "skin"] | NDArray[np.float64] = "geometry",
    method: Literal["smooth", "paper"] = "smooth",
) -> Covering:
    """Bind a surface to a skeleton (A §4): find domains, and the coordinates of every vertex on its segments.

    Args:
        skeleton: The rest skeleton.
        surface: The rest surface, in the skeleton's frame.
        parameters: The animator's parameters; by default :func:`default_parameters`.
        skin: Painted weights, needed by ``domains="skin"``.
        rigid: Joint whose bone a rigid vertex follows, -1 for flesh, shape (V,). Rigid faces are left out of bone heat:
            eyes in a head neither hide bones from its skin nor conduct heat.
        domains: "geometry" (bone heat), "skin" (painted weights), or weights of every operator, shape (V, fans).
        method: "smooth" (soft borders, rotations) or "paper" (the operators as published, with hard borders).

    Raises:
        InputError: A skeleton without segments, missing painted weights, or parameters out of range.
    """
    if method not in ("smooth", "paper"):
        raise InputError(f"method: want 'smooth' or 'paper', got {method!r}")
    groups = fans(skeleton)
    if not groups:
        raise InputError("skeleton: want at least one segment, got none")
    chosen = default_parameters(skeleton) if parameters is None else parameters
    chosen.check(skeleton)
    checked = _checked_rigid(rigid, len(surface.vertices), len(skeleton))
    if isinstance(domains, np.ndarray):
        weights = domains
    elif domains not in ("geometry", "skin"):
        raise InputError(f"domains: want 'geometry' or 'skin', got {domains!r}")
    elif domains == "skin" and skin is None:
        raise InputError("domains 'skin': this rig has no painted weights")
    else:
        weights = domains_of_rigid(checked, skeleton, groups)
        if (flesh := np.flatnonzero(checked < 0)).size:
            vertices, faces = part_of_surface(surface.vertices, surface.faces, flesh)
            if domains == "geometry" or skin is None:
                weights[flesh] = domains_from_geometry(vertices, faces, skeleton, groups)
            else:
                painted = Skin(skin.joints[flesh], skin.weights[flesh])
                weights[flesh] = domains_from_skin(vertices, faces, skeleton, groups, painted)
    anchors = anchor(surface.vertices, skeleton, groups, weights, chosen, rigid=checked)
    if method == "paper":
        from warpjld.covering.paper import PaperCovering  # imports SciPy, which a stored binding does not need

        return PaperCovering(skeleton, surface, chosen, groups, weights, anchors)
    return Covering(skeleton, surface, chosen, groups, weights, anchors)


def bind_rig(
    rig: Rig,
    *,
    skeleton: Skeleton | None = None,
    parameters: Parameters | None = None,
    domains: Literal["geometry", "skin"] = "geometry",
    method: Literal["smooth", "paper"] = "smooth",
) -> Covering:
    """Bind a rig's surface to its skeleton (A §4), with the rig's painted weights and rigid vertices.

    Args:
        rig: The rig.
        skeleton: Skeleton to use instead of the rig's own, for example with other limits.
        parameters: The animator's parameters; by default :func:`default_parameters`.
        domains: "geometry" (bone heat), or "skin" for the rig's painted weights.
        method: "smooth" (soft borders, rotations) or "paper" (the operators as published, with hard borders).

    Raises:
        InputError: A skeleton without segments, missing painted weights, or parameters out of range.

    Examples:
        >>> covering = wj.bind(wj.build_hand("left", resolution=1500))
        >>> covering
        Covering(... vertices on 26 joints)
    """
    return bind(
        rig.skeleton if skeleton is None else skeleton,
        rig.surface,
        parameters=parameters,
        skin=rig.skin,
        rigid=rig.rigid,
        domains=domains,
        method=method,
    )


def _checked_rigid(rigid: NDArray[np.int32] | None, vertices: int, joints: int) -> NDArray[np.int32]:
    """``rigid`` as int32, shape (V,), all flesh by default; InputError for a wrong shape or a joint out of range."""
    if rigid is None:
        return np.full(vertices, -1, dtype=np.int32)
    if rigid.shape != (vertices,):
        raise InputError(f"rigid: want a joint for each of {vertices} vertices, got shape {rigid.shape}")
    if rigid.min(initial=-1) < -1 or rigid.max(initial=-1) >= joints:
        raise InputError(f"rigid: joints must lie in -1…{joints - 1}, got {rigid.min()}…{rigid.max()}")
    return np.asarray(rigid, dtype=np.int32)
