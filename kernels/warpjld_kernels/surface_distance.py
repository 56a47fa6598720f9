"""Signed distance to the nearest point of rigid surfaces (C19)."""

import warp as wp

wp.set_module_options({"max_unroll": 1, "enable_backward": False})

FAR = wp.constant(1.0e10)
# half-width of the band round 1/2 in which a winding number by far-field expansion is not trusted
_DOUBT = wp.constant(0.15)
_ACCURACY = wp.constant(2.0)
# barycentric coordinate below which a nearest point lies on the opposite edge
_ON_EDGE = wp.constant(1.0e-6)
CHUNK = wp.constant(64)
"""Points one thread measures one after another: each gives the next an upper bound of its distance."""


@wp.struct
class Solids:
    """Surfaces of objects, each in its own frame.

    ``features`` are seven normals a triangle: the face's own, those of its edges opposite to corner 0, 1 and 2, and
    those of its corners; edges take the sum of their faces' normals, corners the sum weighted by angle.
    """

    mesh: wp.array(dtype=wp.uint64)
    first_face: wp.array(dtype=wp.int32)
    solid: wp.array(dtype=wp.int32)
    features: wp.array2d(dtype=wp.vec3)


@wp.struct
class Hit:
    """Nearest point of a surface; ``face`` is -1 where nothing lies within the limit."""

    distance: float
    face: int
    point: wp.vec3


@wp.func_native("return wp::mesh_query_winding_number(mesh, point, accuracy);")
def expanded_winding_number(mesh: wp.uint64, point: wp.vec3, accuracy: float) -> float: ...


@wp.func
def summed_winding_number(mesh: wp.uint64, point: wp.vec3) -> float:
    """Every triangle's solid angle by the tangent formula of van Oosterom and Strackee."""
    surface = wp.mesh_get(mesh)
    total = wp.float64(0.0)
    for t in range(surface.indices.shape[0] // 3):
        a = surface.points[surface.indices[3 * t]] - point
        b = surface.points[surface.indices[3 * t + 1]] - point
        c = surface.points[surface.indices[3 * t + 2]] - point
        la = wp.length(a)
        lb = wp.length(b)
        lc = wp.length(c)
        bottom = la * lb * lc + wp.dot(a, b) * lc + wp.dot(b, c) * la + wp.dot(c, a) * lb
        total += wp.float64(wp.atan2(wp.dot(a, wp.cross(b, c)), bottom))
    return float(total) / (2.0 * wp.pi)


@wp.func
def winds_round(mesh: wp.uint64, point: wp.vec3) -> bool:
    """Whether the surface goes round a point more than half a time."""
    number = expanded_winding_number(mesh, point, _ACCURACY)
    if wp.abs(number - 0.5) < _DOUBT:
        number = summed_winding_number(mesh, point)
    return number > 0.5


@wp.func
def feature_of(u: float, v: float) -> int:
    """Column of ``features`` for a nearest point with these weights of corners 0 and 1."""
    w = 1.0 - u - v
    at_edge = int(0)
    count = int(0)
    corner = int(0)
    if u < _ON_EDGE:
        at_edge = 1
        count += 1
    else:
        corner = 0
    if v < _ON_EDGE:
        at_edge = 2
        count += 1
    else:
        corner = 1
    if w < _ON_EDGE:
        at_edge = 3
        count += 1
    else:
        corner = 2
    if count == 2:
        return 4 + corner
    if count == 1:
        return at_edge
    return 0


@wp.func
def nearest(solids: Solids, o: int, point: wp.vec3, limit: float) -> Hit:
    """Signed distance of a point in an object's frame, negative inside.

    On the border of a solid the side of the nearest feature's normal tells inside from outside (Bærentzen and Aanæs
    2005); elsewhere the winding number does.
    """
    hit = Hit()
    hit.distance = FAR
    hit.face = int(-1)
    mesh = solids.mesh[o]
    query = wp.mesh_query_point_no_sign(mesh, point, limit)
    if query.result:
        hit.face = query.face
        hit.point = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
        away = point - hit.point
        hit.distance = wp.length(away)
        if solids.solid[o] == 1:
            normal = solids.features[solids.first_face[o] + query.face, feature_of(query.u, query.v)]
            if wp.dot(away, normal) < 0.0:
                hit.distance = -hit.distance
        elif winds_round(mesh, point):
            hit.distance = -hit.distance
    return hit


@wp.kernel
def measure(
    # objects
    solids: Solids,
    # rows
    object_of: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.quat),
    set_of: wp.array(dtype=wp.int32),
    # points
    points: wp.array2d(dtype=wp.vec3),
    limit: float,
    first_chunk: int,
    # out
    distance_out: wp.array2d(dtype=float),
    face_out: wp.array2d(dtype=wp.int32),
    point_out: wp.array2d(dtype=wp.vec3),
):
    """Distances of every row's set of points to its object at its place; nearest points are on the stage.

    ``point_out`` may be empty.
    """
    row, part = wp.tid()
    o = object_of[row]
    turn = rotation[row]
    origin = position[row]
    start = (first_chunk + part) * CHUNK
    end = wp.min(start + CHUNK, points.shape[1])
    bound = limit
    last = wp.vec3(0.0)
    for i in range(start, end):
        local = wp.quat_rotate_inv(turn, points[set_of[row], i] - origin)
        if i > start:
            bound = limit
            if last[0] < FAR:
                # the last point's nearest one is on the surface as well; the margin covers rounding
                bound = wp.min(limit, 1.0001 * wp.length(local - last) + 1.0e-6)
        hit = nearest(solids, o, local, bound)
        distance_out[row, i] = hit.distance
        face_out[row, i] = hit.face
        last = wp.vec3(FAR, 0.0, 0.0)
        if hit.face >= 0:
            last = hit.point
            if point_out.shape[0] > 0:
                point_out[row, i] = wp.quat_rotate(turn, hit.point) + origin
