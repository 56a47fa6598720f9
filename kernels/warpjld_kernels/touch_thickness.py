"""Width of the flesh beneath every vertex of a surface, by ray casting."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def measure_width(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    skip: float,
    # out
    width_out: wp.array(dtype=float),
):
    """Distance from a vertex along its inward normal to the exit from the surface [m]; infinite where there is none."""
    v = wp.tid()
    inwards = -normals[v]
    start = points[v] + skip * inwards
    found = wp.mesh_query_ray(mesh, start, inwards, 1.0e10)
    # skip hits from outside, which belong to another piece of surface inside this one
    while found.result and wp.dot(found.normal, inwards) <= 0.0:
        start = start + (found.t + skip) * inwards
        found = wp.mesh_query_ray(mesh, start, inwards, 1.0e10)
    width_out[v] = wp.where(found.result, wp.length(start - points[v]) + found.t, wp.inf)
