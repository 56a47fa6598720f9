"""Efforts of muscles, and comparison with their limits (R118, R119).

**Load of a bone**: negative reactions at its nodes, minus those of the flesh without contact in the same pose.
**Force of a digit**: length of the sum of the loads on its phalanges, the bones beyond its base joint.
**Torque of a joint**: moment about the joint of the loads on all bones beyond it, along its flexion axis in the pose;
positive where the load extends the digit and its flexors have to work.
**Limits**: a digit's force limit F is measured with the pad pressing; its joints then bear F times the distance from
the joint to the middle of the last phalanx at rest, and that product is the joint's torque limit.
**Share**: the largest ratio of force or torques to their limits; above 1 muscles cannot hold the pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.bone_loads import BoneLoads
from warpjld.fem.hand.limits import force_limits
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["JOINT_WORDS", "KNUCKLES", "DigitEffort", "Effort", "effort_of", "knuckle_chains"]

KNUCKLES = ("base", "knuckle2", "knuckle3")
"""The three joints of a digit, base first."""
JOINT_WORDS = ("base", "knuckle 2", "knuckle 3")
"""Names of the three joints of a digit in texts."""


@dataclass(frozen=True, eq=False)
class DigitEffort:
    """Effort of one digit's muscles.

    Attributes:
        digit: ``index``, or ``left.index`` where the skeleton has sides.
        load: Sum of the forces on its phalanges [N], shape (3,).
        torques: Of base, knuckle 2 and knuckle 3 [N m], positive where flexors work, shape (3,).
        limit: Largest force [N].
        torque_limits: Largest torques [N m], shape (3,).
        flesh: Length of the sum of the loads of the flesh without contact (its weight and the strain of bent joints) on
            the phalanges in that pose [N]; not included in ``load``; NaN if unknown.
    """

    digit: str
    load: NDArray[np.float64]
    torques: NDArray[np.float64]
    limit: float
    torque_limits: NDArray[np.float64]
    flesh: float = float("nan")

    @property
    def force(self) -> float:
        """Length of ``load`` [N]."""
        return float(np.linalg.norm(self.load))

    @property
    def shares(self) -> NDArray[np.float64]:
        """Force, then torques of base, knuckle 2 and knuckle 3, per limit, shape (4,)."""
        return np.concatenate([[self.force / self.limit], np.abs(self.torques) / self.torque_limits])

    @property
    def share(self) -> float:
        """The largest of ``shares``."""
        return float(self.shares.max())

    @property
    def bound(self) -> str:
        """Quantity with the largest share: ``force``, ``base``, ``knuckle 2`` or ``knuckle 3``."""
        return ("force", *JOINT_WORDS)[int(self.shares.argmax())]

    @property
    def text(self) -> str:
        """``index 41 N of 59 N``, with the joint of the largest share if that is above 1 and exceeds the force's."""
        out = f"{self.digit} {self.force:.3g} N of {self.limit:.3g} N"
        joint = int(self.shares.argmax()) - 1
        if joint >= 0 and self.share > 1.0:
            out += f", {JOINT_WORDS[joint]} {abs(self.torques[joint]):.2g} N m of {self.torque_limits[joint]:.2g} N m"
        return out


@dataclass(frozen=True, eq=False)
class Effort:
    """Efforts of all digits' muscles at one instant.

    Attributes:
        digits: Those of the skeleton.
        palm: Sum of the loads on all other bones [N], shape (3,).
    """

    digits: tuple[DigitEffort, ...]
    palm: NDArray[np.float64]

    def __getitem__(self, digit: str) -> DigitEffort:
        matches = [d for d in self.digits if digit in (d.digit, d.digit.rpartition(".")[2])]
        if len(matches) != 1:
            raise InputError(f"no digit '{digit}' here; there are {', '.join(d.digit for d in self.digits)}")
        return matches[0]

    @property
    def share(self) -> float:
        """The largest share of all digits."""
        return max(d.share for d in self.digits)

    @property
    def realistic(self) -> bool:
        """Whether muscles can hold the pose (R112)."""
        return self.share <= 1.0

    @property
    def text(self) -> str:
        """One line: what exceeds its limit, or what is closest to it."""
        over = [d for d in self.digits if d.share > 1.0]
        if over:
            return "more than muscles can do: " + "; ".join(d.text for d in over)
        most = max(self.digits, key=lambda d: d.share)
        return f"within what muscles can do; most: {most.text} ({100.0 * most.share:.0f} %)"

    def stop(self) -> str | None:
        """The text if muscles cannot hold the pose, otherwise None, as the contact solver's ``watch`` returns."""
        return None if self.realistic else self.text


def effort_of(
    skeleton: Skeleton,
    poses: Poses,
    loads: BoneLoads,
    frame: int = 0,
    limits: Mapping[str, float] | None = None,
    flesh: BoneLoads | None = None,
) -> Effort:
    """Compare the loads on bones with the muscles' limits.

    Args:
        skeleton: The rest skeleton, which gives axes and lever arms.
        poses: Positions and rotations of its joints.
        loads: Force and moment on each bone.
        frame: Frame of the poses.
        limits: Digit → largest force [N], where it differs from the default.
        flesh: Loads of the flesh without contact: reported only.

    Raises:
        InputError: A skeleton without digits, or wrong limits.
    """
    from scipy.spatial.transform import Rotation

    allowed = force_limits(limits)
    chains = knuckle_chains(skeleton)
    if not chains:
        raise InputError("muscles: this skeleton has no digits")
    out = []
    palm = loads.force.sum(axis=0)
    for digit, (joints, tip) in chains.items():
        limit = allowed[digit.rpartition(".")[2]]
        pad = 0.5 * (skeleton.rest[joints[-1]] + skeleton.rest[tip])
        torques, bounds = np.empty(3), np.empty(3)
        load = np.zeros(3)
        for k, joint in enumerate(joints):
            beyond = np.isin(loads.bones, [*joints[k + 1 :], tip])
            force, moment = loads.force[beyond].sum(axis=0), loads.moment[beyond].sum(axis=0)
            if k == 0:
                load = force
            about = moment - np.cross(poses.positions[frame, joint], force)
            # the axis rotates with the parent bone, which this joint's flexion does not move
            before = int(skeleton.parents[joint])
            axis = Rotation.from_quat(poses.rotations[frame, max(before, 0)]).apply(skeleton.axes[joint])
            torques[k] = -float(about @ axis)
            bounds[k] = limit * float(np.linalg.norm(pad - skeleton.rest[joint]))
        palm = palm - load
        own = float("nan")
        if flesh is not None:
            own = float(np.linalg.norm(flesh.force[np.isin(flesh.bones, [*joints[1:], tip])].sum(axis=0)))
        out.append(DigitEffort(digit, load, torques, limit, bounds, own))
    return Effort(tuple(out), palm)


def knuckle_chains(skeleton: Skeleton) -> dict[str, tuple[tuple[int, int, int], int]]:
    """Digits of a skeleton, each with its three flexion joints and its tip."""
    found = {}
    for side in ("left.", "right.", ""):
        for digit in DIGITS:
            names = [f"{side}{digit}.{k}" for k in (*KNUCKLES, "tip")]
            if all(name in skeleton.names for name in names):
                base, second, third, tip = (skeleton.names.index(name) for name in names)
                found[f"{side}{digit}"] = ((base, second, third), tip)
    return found
