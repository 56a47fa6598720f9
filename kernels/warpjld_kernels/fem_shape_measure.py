"""Shape measure of hexahedra and its derivative with respect to their corners."""

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


SIZE = wp.constant(wp.float64(0.05))
"""Weight w of an element's size."""


@wp.func
def edge_corner(corner: int, k: int):
    """Corner at the other end of the k-th edge from a corner; the three edges are right-handed."""
    layer = corner // 4
    around = corner % 4
    following = 4 * layer + (around + 1) % 4
    preceding = 4 * layer + (around + 3) % 4
    other = (corner + 4) % 8
    if k == 2:
        return other
    # below, one goes round anticlockwise; above, clockwise
    if (k == 0) == (layer == 0):
        return following
    return preceding


@wp.kernel
def measure(
    # mesh
    first: int,
    elements: wp.array2d(dtype=wp.int32),
    softness: wp.float64,
    # positions, in units of the edge length wanted
    nodes: wp.array(dtype=wp.vec3d),
    # out
    cost_out: wp.array(dtype=wp.float64),
    slope_out: wp.array2d(dtype=wp.vec3d),
):
    """Σ over corners of (|A|³ / (3√3 χ))² + w (χ − 1/χ)², χ = (d + √(d² + s²)) / 2, d = det A, and its slope.

    The second term keeps sizes alike; without it shrinking a tangle to a point would cost nothing.
    """
    element = first + wp.tid()
    half = wp.float64(0.5)
    one = wp.float64(1.0)
    two = wp.float64(2.0)
    three = wp.float64(3.0)
    for c in range(8):
        slope_out[element, c] = wp.vec3d(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    total = wp.float64(0.0)
    for c in range(8):
        at = nodes[elements[element, c]]
        i = edge_corner(c, 0)
        j = edge_corner(c, 1)
        k = edge_corner(c, 2)
        a = nodes[elements[element, i]] - at
        b = nodes[elements[element, j]] - at
        d = nodes[elements[element, k]] - at
        ca = wp.cross(b, d)
        cb = wp.cross(d, a)
        cd = wp.cross(a, b)
        det = wp.dot(a, ca)
        squared = wp.dot(a, a) + wp.dot(b, b) + wp.dot(d, d)
        root = wp.sqrt(det * det + softness * softness)
        safe = half * (det + root)
        shape = squared * wp.sqrt(squared) / (three * wp.sqrt(three) * safe)
        size = safe - one / safe
        total += shape * shape + SIZE * size * size
        factor = two * shape * shape
        stretch = factor * three / squared
        rising = half * (one + det / root)
        turn = factor * rising / safe - two * SIZE * size * (one + one / (safe * safe)) * rising
        ga = stretch * a - turn * ca
        gb = stretch * b - turn * cb
        gd = stretch * d - turn * cd
        slope_out[element, i] = slope_out[element, i] + ga
        slope_out[element, j] = slope_out[element, j] + gb
        slope_out[element, k] = slope_out[element, k] + gd
        slope_out[element, c] = slope_out[element, c] - (ga + gb + gd)
    cost_out[element] = total
