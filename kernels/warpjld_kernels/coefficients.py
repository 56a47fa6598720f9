"""Pose-independent coefficients of the JLD operators at a vertex, as functions of the parameters.

Shared by the kernel that packs them for the tiled deformation and by the one that deforms points directly.
"""

import warp as wp

POWER_OFFSET = wp.constant(0.05)
"""Offset of the argument a of the functions a^b, whose slope at a = 0 is infinite for b < 1."""


@wp.func
def rotation_weights(ratio: float, side: float, proximal: float, distal: float) -> wp.vec3:
    """Weights of the proximal joint's, the segment's and the distal joint's rotation (A §5.3 Figs 8 and 9, Fig. 10)."""
    t = wp.clamp(ratio, 0.0, 1.0)
    at_proximal = wp.max(1.0 - t / wp.max(proximal, 1.0e-6), 0.0)
    at_distal = wp.max(1.0 - (1.0 - t) / wp.max(distal, 1.0e-6), 0.0)
    external = wp.vec3(at_proximal, 1.0 - at_proximal - at_distal, at_distal)
    internal = wp.vec3(1.0 - t, 0.0, t)
    return side * external + (1.0 - side) * internal


@wp.func
def rounding(ratio: float, side: float, proximal: float, distal: float) -> wp.vec2:
    """Weights of the rounding at the proximal and the distal joint (A §6.1, R58–R62): 1 at the joint, 0 where its
    area ends, with a slope of zero at both, so that no ridge shows there."""
    t = wp.clamp(ratio, 0.0, 1.0)
    at_proximal = wp.max(1.0 - t / wp.max(proximal, 1.0e-6), 0.0)
    at_distal = wp.max(1.0 - (1.0 - t) / wp.max(distal, 1.0e-6), 0.0)
    smooth_proximal = at_proximal * at_proximal * (3.0 - 2.0 * at_proximal)
    smooth_distal = at_distal * at_distal * (3.0 - 2.0 * at_distal)
    return side * wp.vec2(smooth_proximal, smooth_distal)


@wp.func
def muscle_profile(ratio: float, peak: float, before: float, beyond: float) -> float:
    """Two functions a^b joined at the peak, 0 at both joints and 1 at the peak (A §6.2 Fig. 11, R64, R65).

    a is rounded to a (2 − a), which takes the cusp at the peak away.
    """
    t = wp.clamp(ratio, 0.0, 1.0)
    a = t / peak
    b = before
    if t > peak:
        a = (1.0 - t) / (1.0 - peak)
        b = beyond
    a = a * (2.0 - a)
    start = wp.pow(POWER_OFFSET, b)
    return (wp.pow(a + POWER_OFFSET, b) - start) / (wp.pow(1.0 + POWER_OFFSET, b) - start)
