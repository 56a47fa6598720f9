"""Depth of facet corners inside the body of other facets, by signed distances to triangles."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)


@wp.func
def to_triangle(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec3d:
    """Vector from the closest point of a triangle to a point (Ericson, Real-Time Collision Detection, §5.1.5)."""
    zero = wp.float64(0.0)
    least = wp.float64(1e-300)
    ab = b - a
    ac = c - a
    ap = p - a
    d1 = wp.dot(ab, ap)
    d2 = wp.dot(ac, ap)
    if d1 <= zero and d2 <= zero:
        return ap
    bp = p - b
    d3 = wp.dot(ab, bp)
    d4 = wp.dot(ac, bp)
    if d3 >= zero and d4 <= d3:
        return bp
    if d1 * d4 - d3 * d2 <= zero and d1 >= zero and d3 <= zero:
        return ap - ab * (d1 / wp.max(d1 - d3, least))
    cp = p - c
    d5 = wp.dot(ab, cp)
    d6 = wp.dot(ac, cp)
    if d6 >= zero and d5 <= d6:
        return cp
    if d5 * d2 - d1 * d6 <= zero and d2 >= zero and d6 <= zero:
        return ap - ac * (d2 / wp.max(d2 - d6, least))
    if d3 * d6 - d5 * d4 <= zero and d4 >= d3 and d5 >= d6:
        return bp - (c - b) * ((d4 - d3) / wp.max((d4 - d3) + (d5 - d6), least))
    n = wp.cross(ab, ac)
    return n * (wp.dot(n, ap) / wp.max(wp.dot(n, n), least))


@wp.func
def signed(p: wp.vec3d, a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.float64:
    """Signed distance from a triangle, negative behind it."""
    away = to_triangle(p, a, b, c)
    side = wp.dot(away, wp.cross(b - a, c - a))
    return wp.where(side < wp.float64(0.0), -wp.length(away), wp.length(away))


@wp.kernel
def depths(
    first: int,
    bvh: wp.uint64,
    origin: wp.vec3d,
    mine: wp.array2d(dtype=wp.int32),
    my_label: wp.array(dtype=wp.int32),
    others: wp.array2d(dtype=wp.int32),
    label: wp.array(dtype=wp.int32),
    joined: wp.array2d(dtype=wp.uint8),
    x: wp.array(dtype=wp.vec3d),
    facets: wp.array(dtype=wp.int32),
    reach: wp.float64,
    # out
    depth: wp.array2d(dtype=wp.float64),
):
    """Depth of each corner of the listed facets of ``mine`` below the closest of the other facets, within ``reach``,
    whose labels are not joined; 0 outside."""
    i = first + wp.tid()
    facet = facets[i]
    margin = wp.vec3(float(reach), float(reach), float(reach))
    for k in range(4):
        p = x[mine[facet, k]]
        here = wp.vec3(p - origin)
        query = wp.bvh_query_aabb(bvh, here - margin, here + margin)
        other = wp.int32(0)
        nearest = reach
        while wp.bvh_query_next(query, other):
            if joined[my_label[facet], label[other]] == wp.uint8(0):
                a = x[others[other, 0]]
                c = x[others[other, 2]]
                one = signed(p, a, x[others[other, 1]], c)
                two = signed(p, a, c, x[others[other, 3]])
                if wp.abs(one) < wp.abs(nearest):
                    nearest = one
                if wp.abs(two) < wp.abs(nearest):
                    nearest = two
        depth[i, k] = wp.max(-nearest, wp.float64(0.0))
