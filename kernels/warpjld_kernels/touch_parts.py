"""The parts of a surface that may meet: their boxes, which of them do in a frame, and the normals of those."""

import warp as wp

wp.set_module_options({"enable_backward": False})

FAR = wp.constant(1.0e30)  # beyond every coordinate [m]: the empty box to begin with
BESIDE = wp.constant(0.03)  # of a mesh's reach from its bones: outside its box by that nothing is inside it


@wp.struct
class Parts:
    """What of the parts does not depend on the pose.

    ``corner`` lists the vertices of every part's mesh from ``first_corner`` on, ``border`` is 0 at corners of its
    faces, three a face from ``first_face`` times three on, that lie on the mesh's border, else 1. ``apart`` is 1 for
    parts that may meet, 2 for parts that are the same or neighbours; ``beside`` lists the latter, filled up with -1.
    ``bone`` holds joints at the ends of every part's segments from ``first_bone`` on, ``around`` how far its mesh is
    from them at most. ``facing`` is 0, or 1 where overlaps count whichever way both surfaces face.
    """

    part: wp.array(dtype=wp.int32)
    mesh: wp.array(dtype=wp.uint64)
    first_corner: wp.array(dtype=wp.int32)
    corner: wp.array(dtype=wp.int32)
    first_face: wp.array(dtype=wp.int32)
    border: wp.array(dtype=float)
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
    """Boxes of the parts."""
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
    # how much of the overlaps of two parts is parted; anything above nought where that is not known
    shown: wp.array2d(dtype=float),
    # out; ``wanted_out`` of parts whose mesh is asked, ``active_out`` of those that take part at all
    count_out: wp.array(dtype=wp.int32),
    other_out: wp.array2d(dtype=wp.int32),
    wanted_out: wp.array(dtype=wp.int32),
    active_out: wp.array(dtype=wp.int32),
):
    """Parts whose boxes overlap a part's and that may meet it."""
    k = wp.tid()
    count = int(0)
    for other in range(parts.mesh.shape[0]):
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
        # neighbours of what meets give way as well
        if count > 0 and parts.beside[k, i] >= 0:
            active_out[parts.beside[k, i]] = 1


@wp.func
def smooth_skin(normal: wp.vec3, area: float) -> float:
    """1 where a vertex has its faces side by side, 0 where they are folded: there is no inside and no outside."""
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
    """Vertex normals, as long as a third of the area of the faces around, and of length 1, and how plain the skin is;
    of active parts only.

    ``around`` holds a face's two other corners, so that none is read twice.
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
