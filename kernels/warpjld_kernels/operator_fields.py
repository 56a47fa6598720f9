"""Coefficients of the JLD operators at every vertex, before diffusion: they depend on parameters, not on the pose."""

import warp as wp

from warpjld_kernels.coefficients import muscle_profile, rotation_weights, rounding

wp.set_module_options({"max_unroll": 1, "enable_backward": True})


@wp.kernel
def operator_fields(
    # places
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
    """Per operator of a vertex: weights of its three rotations, its two roundings and its muscle, for amplitudes of one
    (R58–R65). See ``warpjld.covering.binding.Anchors`` for the places."""
    v, k = wp.tid()
    s = segment[v, k]
    p = ends[s, 0]
    d = ends[s, 1]
    w = weight[v, k]
    turn_out[v, k] = w * rotation_weights(ratio[v, k], side[v, k], proximity[p, 0], proximity[d, 1])
    rounding_out[v, k] = w * rounding(ratio[v, k], side[v, k], proximity[p, 0], proximity[d, 1])
    profile = muscle_profile(ratio[v, k], peak[p], exponents[p, 0], exponents[p, 1])
    muscle_out[v, k] = w * muscular[s] * (1.0 - side[v, k]) * profile
