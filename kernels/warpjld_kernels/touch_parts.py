"""Broad phase of skin contact: bounding boxes of the parts, pairs that may overlap, and vertex normals of those."""

import warp as wp

wp.set_module_options({"enable_backward": False})

FAR = wp.constant(1.0e30)  # larger than any coordinate [m], for empty boxes
BESIDE = wp.constant(0.03)  # margin of a mesh's box, relative to the mesh's largest distance from its bones


@wp.struct
class Parts:
    """Pose-independent data of the parts.

    ``corner`` lists the vertices of every part's mesh from ``first_corner`` on. ``apart`` is 1 for pairs of parts that
    may touch, 2 for the same part and neighbours, else 0; ``beside`` lists the latter, padded with -1. ``bone`` holds
    the joints at the ends of every part's segments from ``first_bone`` on, ``around`` the largest distance of its mesh
    from them [m]. ``facing`` is 1 where overlaps count regardless of the orientation of both surfaces, else 0. By
    vertex: ``thickness`` of the flesh [m], compliance ``give``, depth of the overlap ``at_rest`` [m], ``area`` [m²] and
    mean ``edge`` length [m]; ``give_of`` is the mean compliance by part.
    """

    part: wp.array(dtype=wp.int32)
    first_corner: wp.array(dtype=wp.int32)
    corner: wp.array(dtype=wp.int32)
    apart: wp.array2d(dtype=wp.int32)
    beside: wp.array2d(dtype=wp.int32)
    thickness: wp.array(dtype=float)
    give: wp.array(dtype=float)
    give_of: wp.array(dtype=float)
    at_rest: wp.array(dtype=float)
    area: wp.array(dtype=float)
    facing: float
    first_bone: wp.array(dtype=wp.int32)
    bone: wp.array(dtype=wp.vec2i)
    around: wp.array(dtype=float)
    edge: wp.array(dtype=float)


@wp.kernel
def find_boxes(
    points: wp.array(dtype=wp.vec3),
    parts: Parts,
    # out
    lower_out: wp.array(dtype=wp.vec3),
    upper_out: wp.array(dtype=wp.vec3),
):
    """Axis-aligned bounding boxes of the parts."""
    k = wp.tid()
    low = wp.vec3(FAR, FAR, FAR)
    high = -low
    for i in range(parts.first_corner[k], parts.first_corner[k + 1]):
        p = points[parts.corner[i]]
        low = wp.min(low, p)
        high = wp.max(high, p)
    lower_out[k] = low
    upper_out[k] = high


@wp.kernel
def find_pairs(
    parts: Parts,
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    # share of the overlap of two parts that is separated; any positive value before it is known
    shown: wp.array2d(dtype=float),
    # out; ``wanted_out`` marks parts whose mesh is queried, ``active_out`` those that may be displaced
    count_out: wp.array(dtype=wp.int32),
    other_out: wp.array2d(dtype=wp.int32),
    wanted_out: wp.array(dtype=wp.int32),
    active_out: wp.array(dtype=wp.int32),
):
    """Parts that may touch a part and whose boxes overlap its own."""
    k = wp.tid()
    count = int(0)
    for other in range(parts.apart.shape[0]):
        if parts.apart[k, other] == 1 and shown[k, other] > 0.0:
            margin = BESIDE * parts.around[other] * wp.vec3(1.0, 1.0, 1.0)
            low = wp.max(lower[k], lower[other] - margin)
            high = wp.min(upper[k], upper[other] + margin)
            if low[0] < high[0] and low[1] < high[1] and low[2] < high[2]:
                other_out[k, count] = other
                wanted_out[other] = 1
                count += 1
    count_out[k] = count
    for i in range(parts.beside.shape[1]):
        # neighbours of parts that may touch are displaced as well
        if count > 0 and parts.beside[k, i] >= 0:
            active_out[parts.beside[k, i]] = 1


@wp.func
def smooth_skin(normal: wp.vec3, area: float) -> float:
    """1 where the faces at a vertex are nearly coplanar, 0 where they are folded, so that inside is not defined there.

    Args:
        normal: Area-weighted normal [m²].
        area: Its length at rest [m²].
    """
    return wp.clamp(4.0 * wp.length(normal) / wp.max(area, 1.0e-30) - 0.6, 0.0, 1.0)


@wp.kernel
def find_normals(
    points: wp.array(dtype=wp.vec3),
    part: wp.array(dtype=wp.int32),
    active: wp.array(dtype=wp.int32),
    # faces of every vertex
    first: wp.array(dtype=wp.int32),
    around: wp.array(dtype=wp.vec2i),
    area: wp.array(dtype=float),
    # out
    normal_out: wp.array(dtype=wp.vec3),
    unit_out: wp.array(dtype=wp.vec3),
    plain_out: wp.array(dtype=float),
):
    """Vertex normals of active parts, of the length of a third of the adjacent faces' area and of length 1, and
    :func:`smooth_skin`.

    ``around`` holds the two other corners of each adjacent face.
    """
    v = wp.tid()
    if active[part[v]] == 1:
        p = points[v]
        total = wp.vec3(0.0, 0.0, 0.0)
        for i in range(first[v], first[v + 1]):
            total += wp.cross(points[around[i][0]] - p, points[around[i][1]] - p)
        normal = total / 6.0
        normal_out[v] = normal
        unit_out[v] = wp.normalize(normal)
        plain_out[v] = smooth_skin(normal, area[v])
