"""Coefficients of the JLD operators at every vertex before diffusion, as functions of the animator's parameters."""

import warp as wp

from warpjld_kernels.coefficients import muscle_profile, rotation_weights, rounding
from warpjld_kernels.lanes import VECTORISED

# the same options as the deforming kernels, so that both use one precompiled header, which takes longest to compile
wp.set_module_options({**VECTORISED, "max_unroll": 1})


@wp.func
def operator_coefficients(
    weight: float,
    ratio: float,
    side: float,
    muscular: float,
    proximity: wp.vec2,
    peak: float,
    exponents: wp.vec2,
):
    """Weights of an operator's three rotations, two roundings and muscle at a vertex, for unit amplitudes (R58–R65)."""
    profile = muscle_profile(ratio, peak, exponents[0], exponents[1])
    return (
        weight * rotation_weights(ratio, side, proximity[0], proximity[1]),
        weight * rounding(ratio, side, proximity[0], proximity[1]),
        weight * muscular * (1.0 - side) * profile,
    )


@wp.kernel
def operator_fields(
    # vertices' coordinates on their segments
    ends: wp.array2d(dtype=wp.int32),
    muscular: wp.array(dtype=float),
    segment: wp.array2d(dtype=wp.int32),
    weight: wp.array2d(dtype=float),
    ratio: wp.array2d(dtype=float),
    side: wp.array2d(dtype=float),
    # parameters
    proximity: wp.array2d(dtype=float),
    peak: wp.array(dtype=float),
    exponents: wp.array2d(dtype=float),
    # out
    turn_out: wp.array2d(dtype=wp.vec3),
    rounding_out: wp.array2d(dtype=wp.vec2),
    muscle_out: wp.array2d(dtype=float),
):
    """Coefficients of each vertex and operator. Inputs as in ``warpjld.covering.binding.Anchors``."""
    v, k = wp.tid()
    s = segment[v, k]
    p = ends[s, 0]
    d = ends[s, 1]
    turn, rounded, muscle = operator_coefficients(
        weight[v, k],
        ratio[v, k],
        side[v, k],
        muscular[s],
        wp.vec2(proximity[p, 0], proximity[d, 1]),
        peak[p],
        wp.vec2(exponents[p, 0], exponents[p, 1]),
    )
    turn_out[v, k] = turn
    rounding_out[v, k] = rounded
    muscle_out[v, k] = muscle
