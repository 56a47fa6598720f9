"""How far the corners of facets are from other facets."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def to_triangle(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.float64:
    """Squared distance of a point from a triangle (Ericson, Real-Time Collision Detection, §5.1.5)."""
    zero = wp.float64(0.0)
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = wp.dot(ab, ap), wp.dot(ac, ap)
    if d1 <= zero and d2 <= zero:
        return wp.dot(ap, ap)
    bp = p - b
    d3, d4 = wp.dot(ab, bp), wp.dot(ac, bp)
    if d3 >= zero and d4 <= d3:
        return wp.dot(bp, bp)
    vc = d1 * d4 - d3 * d2
    if vc <= zero and d1 >= zero and d3 <= zero:
        q = ap - ab * (d1 / wp.max(d1 - d3, wp.float64(1e-300)))
        return wp.dot(q, q)
    cp = p - c
    d5, d6 = wp.dot(ab, cp), wp.dot(ac, cp)
    if d6 >= zero and d5 <= d6:
        return wp.dot(cp, cp)
    vb = d5 * d2 - d1 * d6
    if vb <= zero and d2 >= zero and d6 <= zero:
        q = ap - ac * (d2 / wp.max(d2 - d6, wp.float64(1e-300)))
        return wp.dot(q, q)
    va = d3 * d6 - d5 * d4
    if va <= zero and d4 >= d3 and d5 >= d6:
        q = bp - (c - b) * ((d4 - d3) / wp.max((d4 - d3) + (d5 - d6), wp.float64(1e-300)))
        return wp.dot(q, q)
    n = wp.cross(ab, ac)
    off = wp.dot(n, ap)
    return off * off / wp.max(wp.dot(n, n), wp.float64(1e-300))


@wp.kernel
def corner_distances(
    first: int,
    pairs: wp.array2d(dtype=wp.int32),
    slave: wp.array2d(dtype=wp.int32),
    master: wp.array2d(dtype=wp.int32),
    x: wp.array(dtype=wp.vec3d),
    # out
    distance: wp.array2d(dtype=wp.float64),
):
    """Of each corner of the slave facet of each pair from the two triangles of its master facet."""
    i = first + wp.tid()
    other = pairs[i, 1]
    a = x[master[other, 0]]
    b = x[master[other, 1]]
    c = x[master[other, 2]]
    d = x[master[other, 3]]
    for k in range(4):
        p = x[slave[pairs[i, 0], k]]
        distance[i, k] = wp.sqrt(wp.min(to_triangle(p, a, b, c), to_triangle(p, a, c, d)))
