"""Shells (connected components) of a surface: first face hit by rays, and nearest face with matching orientation."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def nearest_weights(p: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3):
    """Barycentric weights of the point of a triangle nearest to ``p`` (Ericson, Real-Time Collision Detection, 5.1)."""
    ab = b - a
    ac = c - a
    d1 = wp.dot(ab, p - a)
    d2 = wp.dot(ac, p - a)
    if d1 <= 0.0 and d2 <= 0.0:
        return wp.vec3(1.0, 0.0, 0.0)
    d3 = wp.dot(ab, p - b)
    d4 = wp.dot(ac, p - b)
    if d3 >= 0.0 and d4 <= d3:
        return wp.vec3(0.0, 1.0, 0.0)
    d5 = wp.dot(ab, p - c)
    d6 = wp.dot(ac, p - c)
    if d6 >= 0.0 and d5 <= d6:
        return wp.vec3(0.0, 0.0, 1.0)
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        t = d1 / (d1 - d3)
        return wp.vec3(1.0 - t, t, 0.0)
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        t = d2 / (d2 - d6)
        return wp.vec3(1.0 - t, 0.0, t)
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return wp.vec3(0.0, 1.0 - t, t)
    total = va + vb + vc
    return wp.vec3(va / total, vb / total, vc / total)


@wp.kernel
def first_face_met(
    mesh: wp.uint64,
    reach: float,
    # rays
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    # out
    face_out: wp.array(dtype=wp.int32),
):
    """First face hit by each ray of unit direction, -1 for none."""
    i = wp.tid()
    query = wp.mesh_query_ray(mesh, origins[i], directions[i], reach)
    face_out[i] = wp.where(query.result, query.face, -1)


@wp.kernel
def nearest_facing(
    # surface
    mesh: wp.uint64,
    reach: float,
    # points
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    further: wp.array(dtype=float),
    # out
    face_out: wp.array(dtype=wp.int32),
    weights_out: wp.array(dtype=wp.vec3),
    distance_out: wp.array(dtype=float),
):
    """Nearest face of each point, barycentric weights of the nearest place on it, and its distance.

    Where the nearest one faces against ``normals`` and another, no more than ``further`` further away, does not, it is
    that one. A normal of zero takes the nearest of all.
    """
    i = wp.tid()
    point = points[i]
    normal = normals[i]
    query = wp.mesh_query_point_no_sign(mesh, point, reach)
    face_out[i] = -1
    if not query.result:
        return
    face = query.face
    weights = wp.vec3(query.u, query.v, 1.0 - query.u - query.v)
    distance = wp.length(point - wp.mesh_eval_position(mesh, face, query.u, query.v))
    if wp.dot(wp.mesh_eval_face_normal(mesh, face), normal) < 0.0:
        best = distance + further[i]
        half = wp.vec3(best, best, best)
        box = wp.mesh_query_aabb(mesh, point - half, point + half)
        other = wp.int32(0)
        while wp.mesh_query_aabb_next(box, other):
            if wp.dot(wp.mesh_eval_face_normal(mesh, other), normal) > 0.0:
                a = wp.mesh_get_point(mesh, 3 * other)
                b = wp.mesh_get_point(mesh, 3 * other + 1)
                c = wp.mesh_get_point(mesh, 3 * other + 2)
                place = nearest_weights(point, a, b, c)
                apart = wp.length(point - (place[0] * a + place[1] * b + place[2] * c))
                if apart < best:
                    best = apart
                    face = other
                    weights = place
                    distance = apart
    face_out[i] = face
    weights_out[i] = weights
    distance_out[i] = distance
