"""Broad phase of mortar contact: facets whose bounding boxes overlap, and pairs of them that may face each other."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def facet_pairs(
    bvh: wp.uint64,
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    label: wp.array(dtype=wp.int32),
    other_label: wp.array(dtype=wp.int32),
    excluded: wp.array2d(dtype=wp.uint8),
    starts: wp.array(dtype=wp.int32),
    fill: wp.bool,
    # out
    counts: wp.array(dtype=wp.int32),
    found: wp.array(dtype=wp.int32),
):
    """Master facets whose boxes overlap that of each slave facet: counted, or with ``fill`` written from ``starts``
    on."""
    facet = wp.tid()
    mine = label[facet]
    query = wp.bvh_query_aabb(bvh, lower[facet], upper[facet])
    other = wp.int32(0)
    count = wp.int32(0)
    while wp.bvh_query_next(query, other):
        if excluded[mine, other_label[other]] == wp.uint8(0):
            if fill:
                found[starts[facet] + count] = other
            count += 1
    if not fill:
        counts[facet] = count


@wp.kernel
def near_and_facing(
    first: int,
    pairs: wp.array2d(dtype=wp.int32),
    centre: wp.array(dtype=wp.vec3d),
    radius: wp.array(dtype=wp.float64),
    normal: wp.array(dtype=wp.vec3d),
    other_centre: wp.array(dtype=wp.vec3d),
    other_radius: wp.array(dtype=wp.float64),
    other_normal: wp.array(dtype=wp.vec3d),
    reach: wp.float64,
    facing: wp.float64,
    # out
    found: wp.array(dtype=wp.uint8),
):
    """1 for pairs that may be within ``reach`` of each other and overlap in projection along the first one's normal,
    by the spheres around them, and whose unit normals have a cosine below ``facing``; else 0."""
    row = first + wp.tid()
    i = pairs[row, 0]
    j = pairs[row, 1]
    between = other_centre[j] - centre[i]
    size = radius[i] + other_radius[j]
    height = wp.dot(between, normal[i])
    beside = wp.dot(between, between) - height * height
    near = wp.abs(height) <= reach + size and beside <= size * size
    found[row] = wp.uint8(near and wp.dot(normal[i], other_normal[j]) < facing)
