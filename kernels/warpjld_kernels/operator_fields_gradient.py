"""Differentiable coefficients of the JLD operators, in a module of their own that is compiled only where needed."""

import warp as wp

from warpjld_kernels.operator_fields import operator_coefficients

wp.set_module_options({"max_unroll": 1, "enable_backward": True})


@wp.kernel
def operator_fields_with_gradient(
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
    """As ``operator_fields``, differentiable in the parameters."""
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
