"""Where parts of a surface lie inside one another: one frame, its vertices against the meshes of other parts."""

import warp as wp

wp.set_module_options({"enable_backward": False})

FAR = wp.constant(1.0e30)


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


@wp.struct
class Samples:
    """Vertices that lie inside another part.

    Of each: its number, its part and the other; a point of the surface in which both are to meet and that surface's
    normal, towards the vertex's own part; how deep it lies, how much it counts, the radius over which it does, and its
    depth in parts of what skin can give.
    """

    count: wp.array(dtype=wp.int32)
    vertex: wp.array(dtype=wp.int32)
    own: wp.array(dtype=wp.int32)
    other: wp.array(dtype=wp.int32)
    point: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)
    depth: wp.array(dtype=float)
    counts: wp.array(dtype=float)
    radius: wp.array(dtype=float)
    ratio: wp.array(dtype=float)


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
    # overlaps found before in this frame, or anything above nought for all that may be
    before: wp.array2d(dtype=float),
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
        if parts.apart[k, other] == 1 and wp.max(before[k, other], before[other, k]) > 0.0:
            low = wp.max(lower[k], lower[other])
            high = wp.min(upper[k], upper[other])
            if low[0] < high[0] and low[1] < high[1] and low[2] < high[2]:
                other_out[k, count] = other
                wanted_out[other] = 1
                count += 1
    count_out[k] = count
    for i in range(parts.beside.shape[1]):
        # neighbours of what meets give way as well
        if count > 0 and parts.beside[k, i] >= 0:
            active_out[parts.beside[k, i]] = 1


@wp.kernel
def find_normals(
    points: wp.array(dtype=wp.vec3),
    part: wp.array(dtype=wp.int32),
    active: wp.array(dtype=wp.int32),
    # faces of every vertex
    first: wp.array(dtype=wp.int32),
    around: wp.array(dtype=wp.vec2i),
    # out
    normal_out: wp.array(dtype=wp.vec3),
):
    """Vertex normals, as long as a third of the area of the faces around; of active parts only.

    ``around`` holds a face's two other corners, so that none is read twice.
    """
    v = wp.tid()
    if active[part[v]] == 1:
        p = points[v]
        total = wp.vec3(0.0, 0.0, 0.0)
        for i in range(first[v], first[v + 1]):
            total += wp.cross(points[around[i][0]] - p, points[around[i][1]] - p)
        normal_out[v] = total / 6.0


@wp.func
def may_be_inside(joints: wp.array(dtype=wp.vec3), parts: Parts, k: int, p: wp.vec3, normal: wp.vec3) -> bool:
    """Whether a point is as near to a part's bones as its mesh reaches, on skin that does not look away from all of
    those; always where a part has none."""
    first = parts.first_bone[k]
    last = parts.first_bone[k + 1]
    reach = parts.around[k] * parts.around[k]
    near = first == last
    for i in range(first, last):
        if not near:
            a = joints[parts.bone[i][0]]
            along = joints[parts.bone[i][1]] - a
            r = p - a
            t = wp.clamp(wp.dot(r, along) / wp.max(wp.length_sq(along), 1.0e-30), 0.0, 1.0)
            r = r - t * along
            # written so that joints that are not known, not numbers, rule out nothing
            near = not (wp.length_sq(r) >= reach)
    return near


@wp.func
def smooth_skin(normal: wp.vec3, area: float) -> float:
    """1 where a vertex has its faces side by side, 0 where they are folded: there is no inside and no outside."""
    return wp.clamp(4.0 * wp.length(normal) / wp.max(area, 1.0e-30) - 0.6, 0.0, 1.0)


@wp.kernel
def find_samples(
    # frame
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    count: wp.array(dtype=wp.int32),
    others: wp.array2d(dtype=wp.int32),
    joints: wp.array(dtype=wp.vec3),
    # boxes outside which vertices of every part are not asked
    within_lower: wp.array(dtype=wp.vec3),
    within_upper: wp.array(dtype=wp.vec3),
    # surface
    parts: Parts,
    share: float,
    soft: float,
    # out
    deepest_out: wp.array2d(dtype=float),
    samples: Samples,
):
    """Inside is behind the interpolated normal at the nearest point of the other part's mesh.

    Surfaces that face the same way do not press on one another, nor does what is nearest to the border of a mesh,
    where it is open.
    """
    v = wp.tid()
    p = points[v]
    own = parts.part[v]
    asked = count[own]
    if asked > 0:
        low = within_lower[own]
        high = within_upper[own]
        if p[0] < low[0] or p[1] < low[1] or p[2] < low[2] or p[0] > high[0] or p[1] > high[1] or p[2] > high[2]:
            asked = 0
    looks = wp.normalize(normals[v])
    for i in range(asked):
        k = others[own, i]
        low = lower[k]
        high = upper[k]
        outside = p[0] < low[0] or p[1] < low[1] or p[2] < low[2] or p[0] > high[0] or p[1] > high[1] or p[2] > high[2]
        if not outside and may_be_inside(joints, parts, k, p, looks):
            found = wp.mesh_query_point_no_sign(parts.mesh[k], p, wp.max(2.0 * parts.thickness[v], parts.around[k]))
            if found.result:
                mesh = wp.mesh_get(parts.mesh[k])
                a = mesh.indices[3 * found.face]
                b = mesh.indices[3 * found.face + 1]
                c = mesh.indices[3 * found.face + 2]
                w = 1.0 - found.u - found.v
                foot = found.u * points[a] + found.v * points[b] + w * points[c]
                n = (
                    found.u * wp.normalize(normals[a])
                    + found.v * wp.normalize(normals[b])
                    + w * wp.normalize(normals[c])
                )
                n = wp.normalize(n)
                behind = -wp.dot(p - foot, n)
                if behind > 0.0:
                    at = 3 * (parts.first_face[k] + found.face)
                    border = found.u * parts.border[at] + found.v * parts.border[at + 1] + w * parts.border[at + 2]
                    facing = wp.clamp(-2.0 * wp.dot(n, looks), parts.facing, 1.0)
                    plain = smooth_skin(normals[v], parts.area[v])
                    plain = wp.min(plain, smooth_skin(normals[a], parts.area[a]))
                    plain = wp.min(plain, smooth_skin(normals[b], parts.area[b]))
                    plain = wp.min(plain, smooth_skin(normals[c], parts.area[c]))
                    inside = behind * plain * wp.min(2.0 * border, 1.0)
                    depth = inside * facing - parts.at_rest[v]
                    thick = found.u * parts.thickness[a] + found.v * parts.thickness[b] + w * parts.thickness[c]
                    thick = wp.min(thick, parts.thickness[v])
                    limit = share * thick
                    # whichever way the surfaces face: that changes at a leap where the nearest point does, deep inside
                    if inside > parts.at_rest[v]:
                        wp.atomic_max(deepest_out, own, k, (inside - parts.at_rest[v]) / limit)
                    if depth > 0.0:
                        yields = parts.give[v] / wp.max(parts.give[v] + parts.give_of[k], 1.0e-12)
                        at = wp.atomic_add(samples.count, 0, 1)
                        if at < samples.vertex.shape[0]:
                            samples.vertex[at] = v
                            samples.own[at] = own
                            samples.other[at] = k
                            samples.point[at] = p + yields * depth * n
                            samples.normal[at] = n
                            samples.depth[at] = depth
                            samples.counts[at] = wp.min(depth / (soft * limit), 1.0)
                            samples.radius[at] = wp.max(thick, 1.2 * parts.edge[v])
                            samples.ratio[at] = depth / limit
