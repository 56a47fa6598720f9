"""Closing motion of a batch of hands: flex joints until the first touch, reopen where skin swelled into the object.

The searches run in the kernels ``first_touch`` and ``least_opening``.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.covering.device import array_on
from warpjld.grasp.moving_skin import skin_beyond, skin_that_moves
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.objects import Places
from warpjld.grasp.packing import Chains, drives_arrays, fill_drives, fill_posture, posture_arrays, skin_on
from warpjld.grasp.search_result import SearchStatus
from warpjld.grasp.struct_arrays import StructArrays
from warpjld.skeleton import Poses, poses_from_angles
from warpjld.skeleton.channels import FLEXION

__all__ = ["ClosingHands", "MovedSkin"]

_MOST_JOINTS = 4  # of a chain in the kernels
_WIDEST = 0.35  # largest angle by which a base joint opens again because of swelling skin [rad]
_CUTS, _PIECES = 3, 8  # the interval is cut 3 times into 8 pieces: the opening is found to 1/512 of _WIDEST


class MovedSkin:
    """The skin of one hand prepared for the search kernels, with the vertices that each joint moves.

    Args:
        covering: The hand, smooth method.
    """

    def __init__(self, covering: Covering) -> None:
        self.covering = covering
        self._packed: dict[str, Any] = {}
        self._beyond: dict[int, NDArray[np.int32]] = {}
        self._moving: dict[tuple[int, ...], NDArray[np.int32]] = {}
        self._searched: dict[tuple[tuple[int, ...], int, str], tuple[Any, Any, int]] = {}

    def packed(self, device: Any) -> Any:
        """``warpjld_kernels.closing_chain.Skin`` on a device."""
        if str(device) not in self._packed:
            self._packed[str(device)] = skin_on(device, [self.covering])
        return self._packed[str(device)]

    def beyond(self, joint: int) -> NDArray[np.int32]:
        """Vertices at or beyond a joint, see ``skin_beyond``."""
        if joint not in self._beyond:
            self._beyond[joint] = skin_beyond(self.covering, joint)
        return self._beyond[joint]

    def moving(self, joints: tuple[int, ...]) -> NDArray[np.int32]:
        """Vertices that move when joints bend, see ``skin_that_moves``."""
        if joints not in self._moving:
            self._moving[joints] = skin_that_moves(self.covering, joints)
        return self._moving[joints]

    def searched(self, joints: tuple[int, ...], every: int, device: Any) -> tuple[Any, Any, int]:
        """Every so manieth vertex beyond each of these joints, on a device.

        Returns:
            Warp arrays of these vertices, one joint's after another, and of where each joint's begin; and the number
            of those of the joint with most.
        """
        import warp as wp

        key = joints, every, str(device)
        if key not in self._searched:
            vertices = [self.beyond(joint)[::every] for joint in joints]
            first = np.cumsum([0, *map(len, vertices)])
            arrays = (array_on(device, a, wp.int32) for a in (np.concatenate(vertices), first))
            self._searched[key] = (*arrays, max(map(len, vertices)))
        return self._searched[key]


class ClosingHands:
    """State of G hands that close on one object. The result of a hand does not depend on the others in the batch.

    Args:
        skin: The hand's skin.
        poses: G open postures to start from.
        angles: Their joint angles [rad], shape (G, J, 4).
        near: The object; the searches run on its device.
        places: Its placement for every hand.
        every: Stride: only every ``every``-th vertex is searched.
        tolerance: Distance that counts as a touch [m].

    Attributes:
        angles: Present joint angles [rad], shape (G, J, 4).

    Raises:
        InputError: Postures of another skeleton.
    """

    def __init__(
        self,
        skin: MovedSkin,
        poses: Poses,
        angles: NDArray[np.float64],
        near: NearObject,
        places: Places,
        *,
        every: int,
        tolerance: float,
    ) -> None:
        skin.covering.check(poses)
        self.angles = angles.copy()
        self._skin, self._open, self._near, self._places = skin, angles, near, places
        self._skeleton = skin.covering.skeleton
        self._every, self._tolerance, self._device = every, tolerance, near.device
        self._floor: NDArray[np.float64] | None = None
        rest = poses_from_angles(self._skeleton, angles)
        turn = Rotation.from_quat(poses.rotations[:, 0]) * Rotation.from_quat(rest.rotations[:, 0]).inv()
        self._turn = turn.as_quat()
        self._shift = poses.positions[:, 0] - self._skeleton.rest[0]

    def __len__(self) -> int:
        return len(self.angles)

    def poses_of(self, hands: NDArray[np.int64], angles: NDArray[np.float64]) -> Poses:
        """Poses with angles (n, J, 4) of n hands, each placed as it was at the start."""
        return poses_from_angles(
            self._skeleton, angles, root_position=self._shift[hands], root_rotation=self._turn[hands]
        )

    def skins_of(self, hands: NDArray[np.int64], angles: NDArray[np.float64]) -> NDArray[np.float32]:
        """Deformed skins with angles (n, J, 4) of n hands [m], shape (n, V, 3)."""
        return self._skin.covering.deform(self.poses_of(hands, angles), device=str(self._device), threads=1)

    def skin_gaps(self, bases: list[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distances from the skin's vertices to the object; edges of the object inside the skin are not detected.

        Args:
            bases: First joints of D digits.

        Returns:
            Smallest signed distance of every digit [m], shape (G, D), and depth of all skin that moves, shape (G,).
        """
        hands = np.arange(len(self))
        skins = self.skins_of(hands, self.angles)
        groups = [*map(self._skin.beyond, bases), self._skin.moving(tuple(bases))]
        owner = np.repeat(np.arange(len(groups), dtype=np.int32), [len(group) for group in groups])
        gaps = np.full((len(self), len(groups)), np.inf)
        gaps[:, -1] = 0.0
        self._near.least_by_part(self._seen(hands, skins), np.concatenate(groups), owner, gaps)
        return gaps[:, :-1], -gaps[:, -1]

    def bend(
        self, hands: NDArray[np.int64], joints: NDArray[np.int64], rates: NDArray[np.float64]
    ) -> NDArray[np.int32]:
        """Flex the joints of every digit (D, k) of n hands at these relative rates (k,) until the first touch.

        Returns:
            ``SearchStatus`` of every digit, shape (n, D).
        """
        import warp as wp
        from warpjld_kernels.first_touch import first_touch

        count, moving = len(hands), rates != 0.0
        vertices, first, most = self._skin.searched(tuple(joints[:, 0].tolist()), self._every, self._device)
        frames, used = np.repeat(np.arange(count), len(joints)), np.tile(joints[:, moving], (count, 1))
        packed = self._on_object(hands, frames, used, rates[moving])
        chains = count * len(joints)
        scratch = [wp.empty((chains, most), dtype=float, device=self._device) for _ in range(2)]
        inputs = [vertices, first, self._tolerance, self._tolerance, *scratch]
        outs = [wp.empty(chains, dtype=kind, device=self._device) for kind in (wp.int32, float)]
        wp.launch(first_touch, chains, inputs=[packed, *inputs], outputs=outs, device=self._device)
        status, closing = (out.numpy().reshape(count, len(joints)) for out in outs)
        touched = status != int(SearchStatus.NO_CONTACT)
        by = closing.astype(np.float64)
        for d, chain in enumerate(joints):
            for joint, rate in zip(chain[moving], rates[moving], strict=True):
                low, high = self._skeleton.limits[joint, FLEXION]
                now = self.angles[hands, joint, FLEXION]
                far = np.where(touched[:, d], now + rate * by[:, d], high)
                self.angles[hands, joint, FLEXION] = np.maximum(now, np.clip(far, low, high))
        return status

    def settle(self, hands: NDArray[np.int64], bases: list[int]) -> NDArray[np.bool_]:
        """Open base joints of n hands where swelling skin has entered the object.

        A vertex that was inside already when the hand was open need not come out farther than it was then. Where two
        digits move the same skin, such as the fold between two fingers, the one whose opening moves it most is opened.

        Returns:
            Mask of the hands with skin in the object, shape (n,).
        """
        vertices = self._skin.moving(tuple(bases))
        if self._floor is None:
            opened = self._depths(np.arange(len(self)), vertices, self._open)
            self._floor = np.minimum(-2.0 * self._tolerance, opened - 1e-6)
        now = self._depths(hands, vertices, self.angles[hands])
        rows, columns = np.nonzero(now < self._floor[hands])
        if not len(rows):
            return np.zeros(len(hands), dtype=bool)
        pressed, deep, allowed = vertices[columns], now[rows, columns], self._floor[hands][rows, columns]
        at_widest = self._opened_distances(hands, bases, rows, pressed)
        # of the digits, the one whose opening moves the vertex out most
        gain = at_widest - deep
        responsible = np.where(gain.max(axis=0) > 1e-6, gain.argmax(axis=0), -1)
        for d, base in enumerate(bases):
            own = responsible == d
            if own.any():
                floor = np.minimum(allowed[own], at_widest[d, own] - 1e-7)
                self._open_enough(hands, base, rows[own], pressed[own], floor)
        return np.asarray(np.bincount(rows, minlength=len(hands)) > 0)

    def _open_enough(
        self,
        hands: NDArray[np.int64],
        base: int,
        rows: NDArray[np.int64],
        vertices: NDArray[np.int32],
        floor: NDArray[np.float64],
    ) -> None:
        """Open a base joint until vertices (n,) of hands ``rows`` (n,) reach the distances ``floor`` (n,) [m]."""
        import warp as wp
        from warpjld_kernels.first_touch import least_opening

        affected, first = np.unique(rows, return_index=True)
        packed = self._opening(hands[affected], [base])
        by = wp.zeros(len(affected), dtype=float, device=self._device)
        inputs = [
            array_on(self._device, vertices, wp.int32),
            array_on(self._device, floor, float),
            array_on(self._device, np.append(first, len(rows)), wp.int32),
            _WIDEST,
            _CUTS,
            _PIECES,
        ]
        wp.launch(least_opening, len(affected), inputs=[packed, *inputs], outputs=[by], device=self._device)
        now, start = self.angles[hands[affected], base, FLEXION], self._open[hands[affected], base, FLEXION]
        self.angles[hands[affected], base, FLEXION] = np.maximum(now - by.numpy(), np.minimum(start, now))

    def _opened_distances(
        self, hands: NDArray[np.int64], bases: list[int], rows: NDArray[np.int64], vertices: NDArray[np.int32]
    ) -> NDArray[np.float64]:
        """Signed distances of vertices (n,) of hands (n,) with each base joint opened by ``_WIDEST`` [m], (D, n)."""
        import warp as wp
        from warpjld_kernels.first_touch import distances_at

        affected, row = np.unique(rows, return_inverse=True)
        packed = self._opening(hands[affected], bases)
        chain = np.arange(len(bases))[:, None] * len(affected) + row
        out = wp.empty(chain.size, dtype=float, device=self._device)
        inputs = [
            array_on(self._device, chain.ravel(), wp.int32),
            array_on(self._device, np.tile(vertices, len(bases)), wp.int32),
            _WIDEST,
        ]
        wp.launch(distances_at, chain.size, inputs=[packed, *inputs], outputs=[out], device=self._device)
        return np.asarray(out.numpy().reshape(chain.shape).astype(np.float64))

    def _opening(self, hands: NDArray[np.int64], bases: list[int]) -> Any:
        """Kernel input for opening base joints: row d · n + i is joint d of hand i, which stops at its open angle."""
        count = len(hands)
        frames, joints = np.tile(np.arange(count), len(bases)), np.repeat(bases, count)
        own = hands[frames], joints, FLEXION
        stops = np.minimum(self._open[own], self.angles[own])
        return self._on_object(hands, frames, joints[:, None], np.array([-1.0]), stops[:, None])

    def _on_object(
        self,
        hands: NDArray[np.int64],
        frames: NDArray[np.int64],
        joints: NDArray[np.int64],
        rates: NDArray[np.float64],
        stops: NDArray[np.float64] | None = None,
    ) -> Any:
        """``warpjld_kernels.first_touch.Hands``: R chains of k joints, each in one of the frames of n hands."""
        import warp as wp

        angles, skeleton = self.angles[hands], self._skeleton
        starts = angles[frames[:, None], joints, FLEXION]
        if stops is None:  # a joint that begins beyond its limit stays where it is
            stops = np.maximum(skeleton.limits[joints, FLEXION, 1], starts)
        fill = ((0, 0), (0, _MOST_JOINTS - joints.shape[1]))
        chains = Chains(
            frames.astype(np.int32),
            np.pad(joints, fill, constant_values=-1).astype(np.int32),
            np.pad(np.broadcast_to(rates, joints.shape), fill),
            np.pad(stops, fill),
            np.pad(starts, fill),
        )
        poses = self.poses_of(hands, angles)
        origin = poses.positions[:, 0]
        posture, drives, out = self._arrays
        fill_posture(posture, skeleton, poses, origin)
        fill_drives(drives, skeleton, poses, angles, chains)
        out.fill("position", self._places.position[hands] - origin, wp.vec3)
        out.fill("rotation", self._places.rotation[hands], wp.quat)
        # structs are copied where they are set: their arrays may have been made anew
        out.struct.posture, out.struct.drives = posture.struct, drives.struct
        return out.struct

    @cached_property
    def _arrays(self) -> tuple[StructArrays, StructArrays, StructArrays]:
        """Posture, drives and what holds them, ``warpjld_kernels.first_touch.Hands``, filled anew for each launch."""
        from warpjld_kernels.first_touch import Hands

        hands, device = Hands(), self._device
        hands.solids, hands.grid, hands.skin = (
            self._near.objects.solids,
            self._near.grid,
            self._skin.packed(device),
        )
        return posture_arrays(device), drives_arrays(device), StructArrays(hands, device)

    def _depths(
        self, hands: NDArray[np.int64], vertices: NDArray[np.int32], angles: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Signed distances of vertices of n hands to the object [m], +inf where surely outside, shape (n, vertices)."""
        points = self._skin.covering.points(self.poses_of(hands, angles), vertices)
        local = np.stack([self._places[h].to_local(own)[0] for h, own in zip(hands, points, strict=True)])
        found = self._near.near(local.reshape(-1, 3), 0.0)
        return found.distance.reshape(local.shape[:2]).astype(np.float64)

    def _seen(self, hands: NDArray[np.int64], skins: NDArray[np.float32]) -> Any:
        """Skins of n hands in the object's frame, ``wp.array`` of vec3 (n, V)."""
        import warp as wp

        local = [self._places[h].to_local(own)[0] for h, own in zip(hands, skins, strict=True)]
        return wp.array(np.array(local, dtype=np.float32), dtype=wp.vec3, device=self._device)
