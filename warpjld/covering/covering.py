"""A surface bound to a skeleton, and its deformation over batches of frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering.binding import Anchors, anchor
from warpjld.covering.blocks import frames_at_once
from warpjld.covering.device import checked_device
from warpjld.covering.diffusion import Diffusion
from warpjld.covering.drivers import drive
from warpjld.covering.fields import Fields, joint_of_column, operator_fields
from warpjld.covering.following import Following, following
from warpjld.covering.launch import lane_of, launch_gathered, launch_runs
from warpjld.covering.operators import Fan
from warpjld.covering.parameters import Parameters
from warpjld.covering.rigid import part_of_surface, without_rigid
from warpjld.covering.rows import Rows, pose_on, rows_of, rows_on
from warpjld.covering.runs import Columns, Runs, pack_runs, palette
from warpjld.covering.swelling import volume_keeping
from warpjld.covering.thickness import mean_thickness, thickness
from warpjld.covering.thinning import thinned
from warpjld.errors import InputError
from warpjld.geometry.surface import Surface
from warpjld.runtime.threads import threads_for
from warpjld.skeleton.digits import is_digit
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

if TYPE_CHECKING:
    from warpjld.page.view import SurfaceView

__all__ = ["Covering"]

_STIFF = 0.75  # share by which the diffusion length is reduced on a skull
_SPLIT_BELOW = 200_000  # smallest number of vertices × frames worth a thread of its own

# what does not depend on the parameters' amplitudes
_OF_SHAPES = {"diffusion", "following", "spread", "fields", "swelling", "thickening", "_volume", "_kept"}


class Covering:
    """The operators of one surface on one skeleton; made by :func:`bind`, and immutable from then on.

    Attributes:
        skeleton: The rest skeleton.
        surface: The rest surface.
        parameters: The animator's parameters in use.
        fans: The operators.
        domains: Weight of every operator at every vertex, shape (V, fans); rigid vertices have those of the part they
            belong to.
        anchors: Coordinates of the vertices on their segments.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering = wj.bind(hand)
        >>> motion = wj.Motion()
        >>> motion.set_key("index.base.flexion", 0, 0.0)
        >>> motion.set_key("index.base.flexion", 10, 1.2)  # rad
        >>> covering.deform(motion.poses(hand.skeleton)).shape
        (11, ..., 3)
    """

    def __init__(
        self,
        skeleton: Skeleton,
        surface: Surface,
        parameters: Parameters,
        groups: tuple[Fan, ...],
        domains: NDArray[np.float64],
        anchors: Anchors,
    ) -> None:
        self.skeleton = skeleton
        self.surface = surface
        self.parameters = parameters
        self.fans = groups
        self.domains = domains
        self.anchors = anchors
        self._resident: dict[str, list[Any]] = {}
        self._kept: Callable[[], Fields] | None = None

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self.surface.vertices)} vertices on {len(self.skeleton)} joints)"

    def keeping(
        self,
        runs: Runs,
        fields: Callable[[], Fields],
        swelling: NDArray[np.float64],
        thickening: NDArray[np.float64],
    ) -> Covering:
        """This covering with results computed before: runs, what keeps the volume, and fields, read on demand."""
        self.runs, self._kept, self.swelling, self.thickening = runs, fields, swelling, thickening
        return self

    def with_parameters(self, parameters: Parameters) -> Covering:
        """The same binding with other parameters; domains are kept, and fields too where only amplitudes change."""
        parameters.check(self.skeleton)
        anchors, same = self.anchors, _OF_SHAPES
        if not parameters.shapes_like(self.parameters):
            rigid = anchors.rigid
            anchors = anchor(self.surface.vertices, self.skeleton, self.fans, self.domains, parameters, rigid=rigid)
            same = {"following"}
        other = type(self)(self.skeleton, self.surface, parameters, self.fans, self.domains, anchors)
        other.__dict__.update({name: self.__dict__[name] for name in same & self.__dict__.keys()})
        return other

    @cached_property
    def diffusion(self) -> Diffusion:
        """Diffusion of fields over the flesh, with its thickness as the length scale."""
        flesh = np.flatnonzero(self.anchors.rigid < 0)
        vertices, faces = part_of_surface(self.surface.vertices, self.surface.faces, flesh)
        return Diffusion(vertices, faces, self._reach(vertices, faces, flesh), flesh)

    def _reach(
        self, vertices: NDArray[np.float64], faces: NDArray[np.int32], flesh: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Length scale of the diffusion at every vertex of the flesh [m], shape (n,).

        Outside hands at least the mean thickness around: skin close to a bone, as on top of a shoulder, would else
        fold. Knuckles, which are close to bones too, may show, and digits keep more of their volume so.
        """
        own = thickness(self.anchors, self.skeleton.rest)[flesh]
        hands, stiff = (
            self.domains[flesh] @ np.array([kind(fan) for fan in self.fans], dtype=np.float64)
            for kind in (lambda fan: is_digit(fan.name) or len(fan.segments) > 1, lambda fan: fan.stiff)
        )
        reach = own + (1.0 - hands) * np.maximum(mean_thickness(vertices, faces, own) - own, 0.0)
        # a skull does not bend, so it needs less smoothing, and lids must stay on the eyes
        return np.asarray(reach * (1.0 - _STIFF * stiff))

    @cached_property
    def following(self) -> Following | None:
        """Map of fields from the skin to shells that lie on it; None where the flesh is a single shell."""
        lines = self.skeleton.rest[self.anchors.ends]
        return following(self.surface.vertices, self.surface.faces, lines, self.anchors.rigid)

    @cached_property
    def spread(self) -> Fields:
        """The operators' coefficients after diffusion."""
        return self.diffused(operator_fields(self.anchors, self.parameters))

    def diffused(self, fields: Fields) -> Fields:
        """Fields of this surface after diffusion; shells that lie on others get those of the skin beneath."""
        owner = joint_of_column(self.anchors, len(self.skeleton))
        skin = fields.like(self.diffusion.spread(fields.stacked(), owner))
        return skin if self.following is None else self.following.of(skin)

    def before_diffusion(self, slopes: Fields, fields: Fields) -> Fields:
        """Adjoint of :meth:`diffused`: derivatives of a number by ``fields``, from those by ``diffused(fields)``."""
        skin = slopes if self.following is None else self.following.adjoint(slopes)
        owner = joint_of_column(self.anchors, len(self.skeleton))
        before = self.diffusion.adjoint(skin.stacked().toarray(), fields.stacked(), owner)
        return slopes.like(before)

    @cached_property
    def fields(self) -> Fields:
        """The coefficients in use: diffused, and without negligible entries."""
        return thinned(self.spread) if self._kept is None else self._kept()

    @cached_property
    def rows(self) -> Rows:
        """The coefficients with the amplitudes of the parameters."""
        return rows_of(self.fields, self.skeleton, self.anchors, self.parameters, self.swelling, self.thickening)

    @cached_property
    def swelling(self) -> NDArray[np.float64]:
        """Swelling amplitude of every joint at full flexion that preserves volume, shape (J,). It does not depend on
        the amplitudes among the parameters."""
        return self._volume[0]

    @cached_property
    def thickening(self) -> NDArray[np.float64]:
        """Factor of every palm pair's thickening, 1 and more, that restores what swelling cannot, shape (N,)."""
        return self._volume[1]

    @cached_property
    def _volume(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return volume_keeping(self)

    @cached_property
    def flesh(self) -> Surface:
        """The rest surface without rigid faces, whose volume is measured. Vertices keep their indices."""
        return without_rigid(self.surface, self.anchors.rigid)

    @cached_property
    def runs(self) -> Runs:
        """The operators packed for the kernel."""
        from warpjld_kernels.covering_runs import CPU_LANES

        columns = Columns(len(self.skeleton), len(self.anchors.ends), len(self.anchors.pairs))
        return pack_runs(self.rows, columns, CPU_LANES)

    @cached_property
    def run_surface(self) -> Surface:
        """The rest surface with its vertices in the order of the runs, as ``order="runs"`` returns them."""
        return self.surface.renumbered(self.runs.order[: len(self.surface.vertices)])

    def deform(
        self,
        poses: Poses,
        *,
        device: str = "cpu",
        threads: int | None = None,
        out: NDArray[np.float32] | None = None,
        order: Literal["surface", "runs"] = "surface",
    ) -> NDArray[np.float32]:
        """Final positions of all vertices [m], shape (F, V, 3).

        Args:
            poses: F poses of the skeleton.
            device: Warp device.
            threads: CPU threads to split the frames over; by default all cores where the batch is worth it.
            out: Array to fill; allocating a new one costs more than the deformation.
            order: "surface" numbers vertices as ``surface`` does; "runs" as ``run_surface`` does, which is faster
                since results are not scattered.

        Raises:
            InputError: Poses of another skeleton, not finite poses, an unknown device, or ``out`` of a wrong shape.
        """
        import warp as wp

        where = checked_device(device)
        rows = self._palette(poses)
        shape = (len(poses), len(self.surface.vertices), 3)
        if out is None:
            out = np.empty(shape, dtype=np.float32)
        elif out.shape != shape or out.dtype != np.float32 or not out.flags.c_contiguous:
            raise InputError(f"out: want contiguous float32 of shape {shape}, got {out.dtype} {out.shape}")
        if where.is_cpu:
            if threads is None:
                threads = threads_for(shape[0] * shape[1], _SPLIT_BELOW)
            self._launch(rows, wp.array(out, dtype=wp.vec3, device=where, copy=False), where, threads, order)
        else:
            points = wp.empty(shape[:2], dtype=wp.vec3, device=where)
            self._launch(rows, points, where, 1, order)
            out[...] = points.numpy()
        return out

    def blocks(
        self,
        poses: Poses,
        *,
        frames: int | None = None,
        device: str = "cpu",
        threads: int | None = None,
        order: Literal["surface", "runs"] = "surface",
    ) -> Iterator[tuple[int, NDArray[np.float32]]]:
        """Deform a sequence block by block; yields the first frame and the positions [m] (n, V, 3) of each block.

        Every block is a view of one buffer that the next block overwrites, so memory does not grow with the sequence.
        A block has ``frames`` frames; by default 16, or more of a small surface.
        """
        frames = frames_at_once(len(self.surface.vertices)) if frames is None else frames
        buffer = np.empty((min(frames, len(poses)), len(self.surface.vertices), 3), dtype=np.float32)
        for start in range(0, len(poses), frames):
            block = poses[start : start + frames]
            yield start, self.deform(block, device=device, threads=threads, out=buffer[: len(block)], order=order)

    def show(self, poses: Poses | None = None, *, rate: float = 25.0) -> SurfaceView:
        """Interactive view of the surface in poses, by default at rest, for notebooks (extra ``studio``).

        Raises:
            InputError: Poses of another skeleton, or no pose.
            MissingExtraError: viser is not installed.
        """
        from warpjld.page.view import SurfaceView, ViewedSurface
        from warpjld.skeleton.kinematics import rest_poses

        frames = self.deform(rest_poses(self.skeleton) if poses is None else poses)
        return SurfaceView([[ViewedSurface("surface", one, self.surface.faces)] for one in frames], rate=rate)

    def points(self, poses: Poses, vertices: ArrayLike, *, device: str = "cpu") -> NDArray[np.float32]:
        """Final positions of chosen vertices only [m], shape (F, n, 3) (R74)."""
        import warp as wp
        from warpjld_kernels.rows import deform_rows

        where = checked_device(device)
        chosen = self.chosen(vertices)
        self.check(poses)
        out = wp.empty((len(poses), len(chosen)), dtype=wp.vec3, device=where)
        model = self._on(where, "rows", lambda device: [rows_on(device, self.rows)])
        pose = pose_on(where, self.anchors, self.parameters, drive(self.skeleton, self.anchors, poses))
        picked = wp.array(chosen, dtype=wp.int32, device=where)
        wp.launch(deform_rows, dim=out.shape, inputs=[*model, picked, *pose], outputs=[out], device=where)
        result: NDArray[np.float32] = out.numpy()
        return result

    def chosen(self, vertices: ArrayLike) -> NDArray[np.int32]:
        """Vertex indices as an array, shape (n,); InputError where one is out of range."""
        chosen = np.asarray(vertices, dtype=np.int32)
        if chosen.size and (chosen.min() < 0 or chosen.max() >= len(self.surface.vertices)):
            raise InputError(f"vertices: indices must lie in 0…{len(self.surface.vertices) - 1}")
        return chosen

    def _palette(self, poses: Poses) -> Any:
        """Pose inputs of every frame in the layout that the packed kernel reads."""
        self.check(poses)
        drivers = drive(self.skeleton, self.anchors, poses)
        return palette(self.runs.columns, self.anchors, self.parameters, drivers)

    def check(self, poses: Poses) -> None:
        """Raise InputError where poses do not fit the skeleton or are not finite."""
        if poses.positions.shape[1:] != (len(self.skeleton), 3):
            raise InputError(f"poses: want {len(self.skeleton)} joints, got {poses.positions.shape[1]}")
        finite = np.isfinite(poses.positions).all(axis=2) & np.isfinite(poses.rotations).all(axis=2)
        finite &= np.isfinite(poses.flexion)
        if not finite.all():
            frame, joint = np.argwhere(~finite)[0]
            raise InputError(f"poses: joint '{self.skeleton.names[joint]}' is not finite at frame {frame}")

    def _launch(self, rows: Any, points: Any, device: Any, threads: int, order: str) -> None:
        """Launch the kernels for all frames of the palette ``rows``, into the device array ``points``."""
        import warp as wp

        *model, lane = self._on(device, "runs", self._packed)
        pose = wp.array(rows, dtype=float, device=device, copy=False)
        # a surface smaller than one tile is one run in its own order, padded with lanes that have no row in ``points``
        placed = order == "surface" or len(self.runs.order) > points.shape[1]
        if placed and device.is_cpu:
            launch_gathered(model, lane, pose, points, device, threads)
        else:
            launch_runs(model, pose, points, device, threads, scatter=placed)

    def _on(self, device: Any, name: str, make: Any) -> list[Any]:
        """Kernel arguments that stay on a device between calls, made when first needed."""
        key = f"{device}/{name}"
        if key not in self._resident:
            self._resident[key] = make(device)
        return self._resident[key]

    def _packed(self, device: Any) -> list[Any]:
        """The runs as Warp arrays: tiles, runs, slots, coefficients, order, and lane of each vertex."""
        import warp as wp

        r = self.runs
        tiles = r.tiles if device.is_cpu else r.lanes()
        lane = lane_of(r.order, len(self.surface.vertices))
        kinds = ((tiles, wp.int32), (r.runs, wp.int32), (r.slots, wp.int32), (r.coefficients, float))
        return [wp.array(a, dtype=k, device=device) for a, k in (*kinds, (r.order, wp.int32), (lane, wp.int32))]
