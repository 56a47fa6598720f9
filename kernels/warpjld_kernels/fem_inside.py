"""Signed distance of points to a surface, with the sign by winding number, also for surfaces with holes."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def signed_distance(
    # surface
    mesh: wp.uint64,
    reach: float,
    # points
    points: wp.array(dtype=wp.vec3),
    # out
    distance_out: wp.array(dtype=float),
    closest_out: wp.array(dtype=wp.vec3),
    face_out: wp.array(dtype=wp.int32),
):
    """Distance (negative inside), closest point and its face, found within ``reach``."""
    i = wp.tid()
    point = points[i]
    query = wp.mesh_query_point_sign_winding_number(mesh, point, reach)
    if query.result:
        closest = wp.mesh_eval_position(mesh, query.face, query.u, query.v)
        distance_out[i] = query.sign * wp.length(point - closest)
        closest_out[i] = closest
        face_out[i] = query.face
    else:
        distance_out[i] = reach
        closest_out[i] = point
        face_out[i] = -1
