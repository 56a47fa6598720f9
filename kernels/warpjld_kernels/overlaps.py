"""Pairs of faces whose boxes overlap: the broad phase of self-intersection."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def shared_corners(a: wp.vec3i, b: wp.vec3i) -> int:
    shared = int(0)
    for i in range(3):
        for j in range(3):
            if a[i] == b[j]:
                shared += 1
    return shared


@wp.kernel
def overlapping_boxes(
    # faces
    bvh: wp.uint64,
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    corners: wp.array(dtype=wp.vec3i),
    # where each face's pairs begin; empty in the counting pass
    first: wp.array(dtype=wp.int32),
    # out
    count_out: wp.array(dtype=wp.int32),
    other_out: wp.array(dtype=wp.int32),
):
    """Count, or list, the faces of higher index whose boxes overlap a face's and that share at most one corner."""
    face = wp.tid()
    count = int(0)
    query = wp.bvh_query_aabb(bvh, lower[face], upper[face])
    other = int(0)
    while wp.bvh_query_next(query, other):
        if other > face and shared_corners(corners[face], corners[other]) < 2:
            if first.shape[0] > 0:
                other_out[first[face] + count] = other
            count += 1
    count_out[face] = count
