"""The paper's operators as published, with hard borders, as a reference: normals and cross products instead of
quaternions, and one segment or one palm pair per vertex."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering.covering import Covering
from warpjld.covering.device import array_on, checked_device, parameters_on
from warpjld.covering.drivers import flexion_ratio, initial_ratio
from warpjld.covering.paper_places import PaperPlaces, paper_places
from warpjld.covering.segment_table import SegmentTable
from warpjld.geometry.rotations import unit
from warpjld.geometry.surface import Surface
from warpjld.runtime.threads import in_threads
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["Normals", "PaperCovering", "PaperPose", "paper_normals"]


@dataclass(frozen=True, eq=False)
class Normals:
    """Normals of joints and segments in F frames.

    Attributes:
        original: N_o of every segment at its proximal and distal joint, with that joint straight, shape (F, S, 2, 3):
            segment × flexion axis, both carried by the segment (R20, Fig. 3b).
        modified: N_m of every joint, the bisector that the segments meeting there share, shape (F, J, 3) (C22, C23).
    """

    original: NDArray[np.float64]
    modified: NDArray[np.float64]


def paper_normals(skeleton: Skeleton, ends: NDArray[np.int32], rotations: NDArray[np.float64]) -> Normals:
    """Normals of every joint and segment: the rest ones, turned by the bones that carry them (A §4 Fig. 3, R31, R32).

    Args:
        skeleton: The rest skeleton.
        ends: Proximal and distal joint of every segment, shape (S, 2).
        rotations: Rotations of the bones from rest, quaternions x, y, z, w, shape (F, J, 4).
    """
    matrices = Rotation.from_quat(rotations.reshape(-1, 4)).as_matrix().reshape(*rotations.shape[:2], 3, 3)
    table = SegmentTable.build(skeleton, ends)
    original = np.einsum("fsij,skj->fski", matrices[:, ends[:, 0]], table.normals)

    # normals at a joint that are fixed to the segment that ends there, and to the bone that begins there
    after = np.cross(skeleton.directions, skeleton.axes)
    clear = np.linalg.norm(after, axis=1) > 1e-3
    before = after.copy()
    before[ends[:, 1]] = table.normals[:, 1]
    after = np.where(clear[:, None], after, before)
    parents = np.where(skeleton.parents < 0, np.arange(len(skeleton)), skeleton.parents)
    total = np.einsum("fjik,jk->fji", matrices[:, parents], unit(before))
    total += np.einsum("fjik,jk->fji", matrices, unit(after))
    return Normals(original, unit(total))


class PaperCovering(Covering):
    """A surface bound by the paper's hard-edged operators; made by ``bind(…, method="paper")``.

    The surface tears and folds where domains and areas meet; it serves as a reference. Methods are those of
    :class:`~warpjld.covering.covering.Covering`.
    """

    @cached_property
    def places(self) -> PaperPlaces:
        """Coordinates of the vertices on their segment or palm pair, and their areas."""
        where = (self.surface.vertices, self.skeleton, self.fans, self.domains, self.parameters)
        found = paper_places(*where, self.anchors.rigid)
        if self.following is None:
            return found
        return found.taken_from(_followed(self.following.follow), self.following.whole)

    def points(self, poses: Poses, vertices: ArrayLike, *, device: str = "cpu") -> NDArray[np.float32]:
        """Final positions of chosen vertices only [m], shape (F, n, 3) (R74)."""
        import warp as wp

        where = checked_device(device)
        chosen = self.chosen(vertices)
        out = wp.empty((len(poses), len(chosen)), dtype=wp.vec3, device=where)
        self._emit(self._palette(poses), chosen, out, where, 1)
        result: NDArray[np.float32] = out.numpy()
        return result

    def _palette(self, poses: Poses) -> Any:
        self.check(poses)
        normals = paper_normals(self.skeleton, self.places.ends, poses.rotations)
        ratio = flexion_ratio(self.skeleton, poses.flexion)
        return PaperPose(poses.positions, normals.original, normals.modified, ratio, poses.rotations)

    @property
    def run_surface(self) -> Surface:
        """The surface itself, since these operators are not packed into runs."""
        return self.surface

    def _launch(self, rows: Any, points: Any, device: Any, threads: int, order: str) -> None:
        self._emit(rows, np.arange(len(self.surface.vertices), dtype=np.int32), points, device, threads)

    def _emit(self, pose: PaperPose, chosen: NDArray[np.int32], points: Any, device: Any, threads: int) -> None:
        """Deform chosen vertices in all frames into the device array ``points``, shape (F, n)."""
        import warp as wp
        from warpjld_kernels.paper import deform_paper

        model = self._on(device, "paper", self._expressed)
        picked = wp.array(chosen, dtype=wp.int32, device=device)
        inputs = pose.on(device)

        def span(begin: int, end: int) -> None:
            wp.launch(
                deform_paper,
                dim=(end - begin, len(chosen)),
                inputs=[*model, picked, *(a[begin:end] for a in inputs)],
                outputs=[points[begin:end]],
                device=device,
            )

        in_threads(span, points.shape[0], threads, deform_paper, device)

    def _expressed(self, device: Any) -> list[Any]:
        """Kernel arguments on a device: places, parameters, and coordinates of the vertices in their initial bases."""
        import warp as wp
        from warpjld_kernels import paper

        places = paper.Places()
        for field in fields(self.places):
            kind = float if field.name in ("muscle", "ratio", "across") else wp.int32
            setattr(places, field.name, array_on(device, getattr(self.places, field.name), kind))
        parameters = parameters_on(device, self.parameters)
        still = np.tile([0.0, 0.0, 0.0, 1.0], (1, len(self.skeleton), 1))
        normals = paper_normals(self.skeleton, self.places.ends, still)
        count = len(self.surface.vertices)
        outputs = [wp.empty(count, dtype=wp.vec3, device=device), wp.empty(count, dtype=float, device=device)]
        ratio = initial_ratio(self.skeleton)[None]
        pose = PaperPose(self.skeleton.rest[None], normals.original, normals.modified, ratio, still)
        rest = array_on(device, self.surface.vertices, wp.vec3)
        wp.launch(
            paper.express,
            dim=count,
            inputs=[places, parameters, rest, *pose.on(device)[:4]],
            outputs=outputs,
            device=device,
        )
        return [places, parameters, *outputs]


def _followed(follow: sp.csr_array) -> NDArray[np.int64]:
    """Column of the largest entry of every row of ``follow``, the first of several; a row's own index where it has no
    entries. Shape (V,)."""
    out = np.arange(follow.shape[0])
    # rounded, so that ties of barycentric weights do not depend on the last digits
    order = np.lexsort((follow.indices, -follow.data.round(6), np.repeat(out, np.diff(follow.indptr))))
    filled = np.diff(follow.indptr) > 0
    out[filled] = follow.indices[order][follow.indptr[:-1][filled]]
    return out


@dataclass(frozen=True, eq=False)
class PaperPose:
    """Pose inputs of the paper's operators in F frames.

    Attributes:
        positions: Joint positions [m], shape (F, J, 3).
        original, modified: As in :class:`Normals`.
        flexion_ratio: FR of every joint, shape (F, J).
        rotations: Rotations of the bones, x y z w, shape (F, J, 4), used by rigid vertices only.
    """

    positions: NDArray[np.float64]
    original: NDArray[np.float64]
    modified: NDArray[np.float64]
    flexion_ratio: NDArray[np.float64]
    rotations: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.positions)

    def on(self, device: Any) -> list[Any]:
        """Pose arguments of the kernel, in its order."""
        import warp as wp

        vectors = (self.positions, self.original, self.modified)
        return [
            *(array_on(device, a, wp.vec3) for a in vectors),
            array_on(device, self.flexion_ratio, float),
            array_on(device, self.rotations, wp.quat),
        ]
