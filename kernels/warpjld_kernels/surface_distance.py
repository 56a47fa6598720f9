"""Signed distance to the nearest point of rigid surfaces (C19)."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.triangle_tree import SLIVER, Tree, nearest_triangle

wp.set_module_options({**VECTORISED, "max_unroll": 1})

FAR = wp.constant(1.0e10)  # distance [m] where no surface is within the limit
# half-width of the band round 1/2 in which a winding number by far-field expansion is not trusted
_DOUBT = wp.constant(0.15)
_ACCURACY = wp.constant(2.0)  # of Warp's far-field expansion: its own default, farther clusters are summed as one


@wp.struct
class Solids:
    """Surfaces of objects, each in its own frame; ``mesh`` serves winding numbers, ``tree`` nearest points.

    ``features`` are seven normals a triangle: the face's own, those of its edges opposite to corner 0, 1 and 2, and
    those of its corners; edges take the sum of their faces' normals, corners the sum weighted by angle.
    """

    mesh: wp.array(dtype=wp.uint64)
    first_face: wp.array(dtype=wp.int32)
    solid: wp.array(dtype=wp.int32)
    features: wp.array2d(dtype=wp.vec3)
    tree: Tree


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
    """Exact winding number: sum of the triangles' solid angles (van Oosterom and Strackee)."""
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
    """Whether a point is inside: winding number above one half."""
    number = expanded_winding_number(mesh, point, _ACCURACY)
    if wp.abs(number - 0.5) < _DOUBT:
        number = summed_winding_number(mesh, point)
    return number > 0.5


@wp.func
def nearest_on_edge(a: wp.vec3d, b: wp.vec3d) -> wp.vec4d:
    """Point of the segment from a to b nearest to the origin, and its parameter: 0 at a, 1 at b."""
    edge = b - a
    t = -wp.dot(a, edge) / wp.max(wp.dot(edge, edge), wp.float64(1.0e-300))
    t = wp.clamp(t, wp.float64(0.0), wp.float64(1.0))
    x = a + t * edge
    return wp.vec4d(x[0], x[1], x[2], t)


@wp.func
def nearest_on_triangle(a: wp.vec3d, b: wp.vec3d, c: wp.vec3d) -> wp.vec4d:
    """Point of a triangle nearest to the origin, and the column of ``features`` of its face, edge or corner."""
    zero = wp.float64(0.0)
    normal = wp.cross(b - a, c - a)
    over = wp.min(wp.dot(wp.cross(a, b), normal), wp.dot(wp.cross(b, c), normal))
    over = wp.min(over, wp.dot(wp.cross(c, a), normal))
    wide = wp.dot(normal, normal)
    lengths = wp.dot(b - a, b - a) + wp.dot(c - b, c - b) + wp.dot(a - c, a - c)
    if over >= zero and wide > wp.float64(SLIVER) * lengths * lengths:
        foot = (wp.dot(a, normal) / wide) * normal
        return wp.vec4d(foot[0], foot[1], foot[2], zero)
    best = wp.vec4d(zero)
    least = wp.float64(FAR) * wp.float64(FAR)
    for k in range(3):
        start = b
        end = c
        if k == 1:
            start = c
            end = a
        if k == 2:
            start = a
            end = b
        found = nearest_on_edge(start, end)
        away = wp.vec3d(found[0], found[1], found[2])
        if wp.dot(away, away) < least:
            least = wp.dot(away, away)
            feature = 1 + k
            if found[3] <= zero:
                feature = 4 + (k + 1) % 3
            if found[3] >= wp.float64(1.0):
                feature = 4 + (k + 2) % 3
            best = wp.vec4d(found[0], found[1], found[2], wp.float64(feature))
    return best


@wp.func
def nearest(solids: Solids, o: int, point: wp.vec3d, limit: wp.float64) -> Hit:
    """Signed distance of a point in an object's frame, negative inside; within ``limit``.

    On the border of a solid the side of the nearest feature's normal tells inside from outside (Bærentzen and Aanæs
    2005); elsewhere the winding number does.
    """
    hit = Hit()
    hit.distance = FAR
    hit.face = nearest_triangle(solids.tree, o, point, limit)
    if hit.face >= 0:
        surface = wp.mesh_get(solids.mesh[o])
        a = wp.vec3d(surface.points[surface.indices[3 * hit.face]]) - point
        b = wp.vec3d(surface.points[surface.indices[3 * hit.face + 1]]) - point
        c = wp.vec3d(surface.points[surface.indices[3 * hit.face + 2]]) - point
        found = nearest_on_triangle(a, b, c)
        to_it = wp.vec3d(found[0], found[1], found[2])
        hit.point = wp.vec3(to_it + point)
        hit.distance = float(wp.length(to_it))
        if solids.solid[o] == 1:
            normal = wp.vec3d(solids.features[solids.first_face[o] + hit.face, int(found[3])])
            if wp.dot(to_it, normal) > wp.float64(0.0):
                hit.distance = -hit.distance
        elif winds_round(solids.mesh[o], wp.vec3(point)):
            hit.distance = -hit.distance
    return hit


@wp.kernel
def measure(
    # objects
    solids: Solids,
    # rows
    object_of: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3d),
    rotation: wp.array(dtype=wp.quatd),
    set_of: wp.array(dtype=wp.int32),
    # points
    points: wp.array2d(dtype=wp.vec3),
    limit: wp.float64,
    # order in which they are measured, or none; of these points first to end, in runs of so many
    order: wp.array(dtype=wp.int32),
    first: int,
    end: int,
    run: int,
    # out
    distance_out: wp.array2d(dtype=float),
    face_out: wp.array2d(dtype=wp.int32),
    point_out: wp.array2d(dtype=wp.vec3),
):
    """Distances of every row's set of points to its object at its place; nearest points are on the stage.

    A run's points are measured one after another, within the distance to what is nearest to the one before: of points
    side by side most lie near. ``point_out`` may be empty.
    """
    row, part = wp.tid()
    turn = rotation[row]
    origin = position[row]
    last = wp.vec3d(wp.float64(0.0))
    known = bool(False)
    for k in range(first + part * run, wp.min(first + (part + 1) * run, end)):
        i = k
        if order.shape[0] > 0:
            i = order[k]
        local = wp.quat_rotate_inv(turn, wp.vec3d(points[set_of[row], i]) - origin)
        within = limit
        if known:
            within = wp.min(limit, wp.length(local - last) * wp.float64(1.0001) + wp.float64(1.0e-6))
        hit = nearest(solids, object_of[row], local, within)
        distance_out[row, i] = hit.distance
        face_out[row, i] = hit.face
        if hit.face >= 0:
            known = True
            last = wp.vec3d(hit.point)
            if point_out.shape[0] > 0:
                point_out[row, i] = wp.vec3(wp.quat_rotate(turn, wp.vec3d(hit.point)) + origin)
