"""The two sides of a bent joint parted at the plane in which they meet."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def part_creases(
    # of every vertex that a joint may press: its number and its first entry; one more at the end
    vertex: wp.array(dtype=wp.int32),
    first: wp.array(dtype=wp.int32),
    # entries: which joint, distance from its plane at rest, how much it counts; what is opposite: three vertices and
    # their shares
    joint: wp.array(dtype=wp.int32),
    height: wp.array(dtype=float),
    weight: wp.array(dtype=float),
    opposite: wp.array(dtype=wp.vec3i),
    share: wp.array(dtype=wp.vec3),
    # joints: how thick the flesh is; normals of their planes in every frame
    size: wp.array(dtype=float),
    normal: wp.array2d(dtype=wp.vec3),
    kept: float,
    points: wp.array2d(dtype=wp.vec3),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """Every vertex keeps at least a share of its rest distance from what is opposite to it, each giving way by half."""
    frame, row = wp.tid()
    v = vertex[row]
    p = points[frame, v]
    shift = wp.vec3(0.0, 0.0, 0.0)
    for entry in range(first[row], first[row + 1]):
        j = joint[entry]
        n = normal[frame, j]
        across = wp.vec3(0.0, 0.0, 0.0)
        for k in range(3):
            across += share[entry][k] * points[frame, opposite[entry][k]]
        r = p - across
        apart = wp.dot(r, n)
        n = wp.sign(height[entry]) * n
        missing = 2.0 * kept * wp.abs(height[entry]) - wp.dot(r + shift, n)
        if missing > 0.0:
            # they have passed through one another only where they are still beside one another
            beside = wp.length(r - apart * normal[frame, j]) / size[j]
            shift += 0.5 * weight[entry] * wp.clamp(2.0 - 2.0 * beside, 0.0, 1.0) * missing * n
    points_out[frame, v] = p + shift
