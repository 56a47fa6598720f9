"""Assembly of a rig from a file's raw content: units, recognition, completion, axes, weights."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.lengths import check_reach, check_size
from warpjld.geometry.spread import spread
from warpjld.geometry.surface import Surface, weld_surface
from warpjld.io.agreement import elsewhere, outside_out
from warpjld.io.placement import place
from warpjld.io.rigid_parts import rigid_parts
from warpjld.io.source import SourceRig
from warpjld.limits import check_limit
from warpjld.rig import Rig, Skin
from warpjld.skeleton.initial import with_initial
from warpjld.skeleton.recognise.canonical import Canonical, canonical_skeleton
from warpjld.skeleton.recognise.flesh import flesh_shares
from warpjld.skeleton.recognise.painted import Painted
from warpjld.skeleton.recognise.recognise import recognise

__all__ = ["assemble_rig"]

_SAME_PLACE = 1e-3  # distance at which joints coincide, per size of the skeleton
_NO_WEIGHT = 1e-6  # sum of painted weights up to which a vertex counts as unweighted


def assemble_rig(
    source: SourceRig,
    *,
    side: str | None = None,
    unit: str | None = None,
    scale: float | None = None,
    up: str | None = None,
    joint_map: Mapping[str, Any] | None = None,
) -> Rig:
    """Recognise the content of ``source`` and convert it to the canonical form; arguments as in ``load_rig``.

    ``joint_map`` is the content of a joint map file.

    Raises:
        InputError: The content cannot be used; names the file.
    """
    try:
        return _assemble(source, side, unit, scale, up, joint_map)
    except InputError as error:
        if error.path is not None:
            raise
        raise InputError(error.message, path=source.path) from None


def _assemble(
    source: SourceRig,
    side: str | None,
    unit: str | None,
    scale: float | None,
    up: str | None,
    joint_map: Mapping[str, Any] | None,
) -> Rig:
    check_limit("vertices", len(source.vertices))
    check_limit("faces", len(source.faces))
    check_limit("joints", len(source.tree))
    check_reach(source.vertices, "vertices")
    check_reach(source.tree.frames, "joints")
    file_tree = source.tree
    shares = flesh_shares(len(source.tree), source.joints, source.weights, source.rigid)
    roles = recognise(source.tree, shares, _stated(source, joint_map or {}), by_shape=not source.stated)
    source = outside_out(place(source, roles, unit=unit, scale=scale, up=up))
    check_size(source.vertices[source.faces.ravel()], "the surface", "--unit or --scale")
    check_size(source.tree.positions, "the skeleton", "--unit or --scale", least=0.0)
    surface = weld_surface(
        source.vertices,
        source.faces,
        uv=source.uv,
        corner_uv=source.corner_uv,
        parts=source.parts,
        polygons=source.polygons,
        joins=None if source.rigid is None else source.rigid < 0,
    )
    painted = None
    if source.joints is not None and source.weights is not None:
        painted = Painted(source.vertices, source.joints, source.weights)
    found = canonical_skeleton(
        source.tree,
        surface.vertices,
        surface.faces,
        roles=roles,
        shares=shares,
        painted=painted,
        side=side,
        axes=source.axes,
        limits=source.limits,
        placed=source.placed,
    )
    number = {joint: j for j, joint in enumerate(found.sources) if joint >= 0}
    stated = {number[joint]: angles for joint, angles in source.initial.items() if joint in number}
    skeleton, bent = with_initial(found.skeleton, stated)
    skin, bare = None, 0
    if source.joints is not None and source.weights is not None:
        skin, bare = _skin(source.joints, source.weights, found.owner, len(found.skeleton), surface)
    rigid, rigid_notes = rigid_parts(surface, found.skeleton, skin, _rigid(source, found.owner, surface))
    return Rig(
        name=source.path.stem.encode("utf-8", "replace").decode(),  # file names may be no valid text
        skeleton=skeleton,
        surface=surface,
        skin=skin,
        path=source.path,
        source=file_tree,
        sources=found.sources,
        owner=_movers(source, found),
        placing=source.placing,
        rigid=rigid,
        notes=(*source.notes, *_joined(surface), *found.notes, *bent, *_bare(bare, skin), *rigid_notes),
        suspicious=(*source.suspicious, *elsewhere(source), *found.suspicious),
    )


def _movers(source: SourceRig, found: Canonical) -> NDArray[np.int64]:
    """Joint of the skeleton that each joint of the file moves with, shape (N,).

    -1 for joints above all recognised ones that own no skin, unless they coincide with a recognised joint, or legs and
    spine branch off there: such a root is a pelvis.
    """
    tree = source.tree
    carries = np.zeros(len(tree), dtype=bool)
    if source.joints is not None and source.weights is not None:
        carries[source.joints[source.weights > 0]] = True
    if source.rigid is not None:
        carries[source.rigid[source.rigid >= 0]] = True
    recognised = set(found.sources)
    hangs = [not recognised.isdisjoint((j, *tree.ancestors(j))) for j in range(len(tree))]
    away = np.linalg.norm(tree.positions - found.skeleton.rest[found.owner], axis=1)
    shares = away < _SAME_PLACE * np.linalg.norm(np.ptp(found.skeleton.rest, axis=0))
    leads = {k for j in recognised if j >= 0 for k in (j, *tree.ancestors(j))}
    parts = [sum(c in leads for c in tree.children[j]) > 1 for j in range(len(tree))]
    return np.where(carries | hangs | shares | np.array(parts), found.owner, -1)


def _stated(source: SourceRig, by_hand: Mapping[str, Any]) -> dict[str, Any]:
    """Stated joints: those of the joint map, and others that the file itself states, as VRM does."""
    taken = {*by_hand.get("ignore", ()), *(name for name in by_hand.values() if isinstance(name, str))}
    own = {name: joint for name, joint in source.stated_names().items() if joint not in taken}
    return own | dict(by_hand)


def _skin(
    joints: NDArray[np.int64], weights: NDArray[np.float64], owner: NDArray[np.int64], count: int, surface: Surface
) -> tuple[Skin | None, int]:
    """Painted weights over welded vertices and canonical joints, and the number of unweighted vertices.

    Vertices that are welded into one get the mean; unweighted ones get those of their neighbours. None where no vertex
    has any weight.
    """
    dense = np.zeros((len(surface.vertices), count))
    np.add.at(dense, (surface.weld[:, None], owner[joints]), weights)
    total = dense.sum(axis=1)
    known = total > _NO_WEIGHT
    bare = int((~known).sum())
    if bare == len(known):
        return None, bare
    dense[known] /= total[known, None]
    dense = spread(dense, known, surface.vertices, surface.faces)
    width = int((dense > 0).sum(axis=1).max())
    strongest = np.argsort(-dense, axis=1, kind="stable")[:, :width]
    chosen = np.take_along_axis(dense, strongest, axis=1)
    return Skin(np.where(chosen > 0, strongest, strongest[:, :1]).astype(np.int32), chosen), bare


def _bare(count: int, skin: Skin | None) -> tuple[str, ...]:
    if skin is None and count:
        return ("no vertex has any painted weight: the weights were left out",)
    return (f"{count} vertices without painted weight take their neighbours'",) if count else ()


def _joined(surface: Surface) -> tuple[str, ...]:
    """Note on meshes that were joined at common borders."""
    own = sum(len(np.unique(surface.weld[part.vertices])) for part in surface.parts)
    shared = own - len(surface.vertices)
    return (f"meshes joined where their borders coincide, at {shared} vertices",) if shared > 0 else ()


def _rigid(source: SourceRig, owner: NDArray[np.int64], surface: Surface) -> NDArray[np.int32] | None:
    """Joint that each welded vertex follows rigidly, -1 for others; None if there is none."""
    if source.rigid is None or not (source.rigid >= 0).any():
        return None
    out = np.full(len(surface.vertices), -1, dtype=np.int32)
    out[surface.weld] = np.where(source.rigid >= 0, owner[source.rigid], -1)
    return out
