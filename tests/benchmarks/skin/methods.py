"""The methods compared: each prepares a rig, then gives the surface of a pose."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.skin.rigs import BenchRig
from warpjld.covering.baselines import dual_quaternion_skinning, linear_blend_skinning
from warpjld.covering.centres_of_rotation import centre_of_rotation_skinning, centres_of_rotation
from warpjld.covering.delta_mush import delta_mush_moments, direct_delta_mush
from warpjld.skeleton.kinematics import Poses

__all__ = ["METHODS", "Deform"]

Deform = Callable[[Poses], NDArray[np.floating]]
"""Poses → final positions [m], shape (F, V, 3)."""


def _lbs(bench: BenchRig) -> Deform | None:
    rig = bench.rig
    skin = rig.skin
    return None if skin is None else lambda p: linear_blend_skinning(rig.skeleton, rig.surface.vertices, skin, p)


def _dqs(bench: BenchRig) -> Deform | None:
    rig = bench.rig
    skin = rig.skin
    return None if skin is None else lambda p: dual_quaternion_skinning(rig.skeleton, rig.surface.vertices, skin, p)


def _cor(bench: BenchRig) -> Deform | None:
    rig = bench.rig
    skin, rest = rig.skin, rig.surface.vertices
    if skin is None:
        return None
    centres = centres_of_rotation(rest, rig.surface.faces, skin)
    return lambda p: centre_of_rotation_skinning(rig.skeleton, rest, skin, centres, p)


def _ddm(bench: BenchRig) -> Deform | None:
    rig = bench.rig
    skin, rest = rig.skin, rig.surface.vertices
    if skin is None:
        return None
    moments = delta_mush_moments(rest, rig.surface.faces, skin, len(rig.skeleton))
    return lambda p: direct_delta_mush(rig.skeleton, rest, moments, p)


def _ours(bench: BenchRig) -> Deform:
    return bench.covering.deform


def _calibrated(bench: BenchRig) -> Deform:
    from warpjld.covering.calibrate import calibrate

    return bench.covering.with_parameters(calibrate(bench.covering).parameters).deform


METHODS: dict[str, Callable[[BenchRig], Deform | None]] = {
    "lbs": _lbs,
    "dqs": _dqs,
    "cor": _cor,
    "ddm": _ddm,
    "ours": _ours,
    "calibrated": _calibrated,
}
"""Name → preparation; it gives None where the rig has no painted weights."""
