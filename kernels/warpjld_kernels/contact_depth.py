"""How thick a body is under its surface."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def thickness(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    inward: wp.array(dtype=wp.vec3),
    farthest: float,
    # out
    distance: wp.array(dtype=float),
):
    """Way from points along unit directions to where they leave the surface; ``farthest`` where they do not."""
    i = wp.tid()
    query = wp.mesh_query_ray(mesh, points[i], inward[i], farthest)
    distance[i] = farthest
    if query.result:
        distance[i] = query.t
