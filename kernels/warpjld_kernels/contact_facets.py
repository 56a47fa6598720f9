"""Broad phase of mortar contact: pairs of facets whose bounding boxes overlap."""

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
