"""Which segment a surface point sees from inside the surface."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.func
def closest_on_segment(point: wp.vec3, start: wp.vec3, end: wp.vec3) -> wp.vec3:
    along = end - start
    t = wp.dot(point - start, along) / wp.max(wp.dot(along, along), 1.0e-20)
    return start + wp.clamp(t, 0.0, 1.0) * along


@wp.kernel
def nearest_visible_segment(
    # surface
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    inset: float,
    # segments
    starts: wp.array(dtype=wp.vec3),
    ends: wp.array(dtype=wp.vec3),
    # out
    nearest_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=float),
):
    """Nearest segment whose closest point is seen without crossing the surface; the nearest of all where none is."""
    tid = wp.tid()
    point = points[tid]
    origin = point - inset * normals[tid]
    passed = float(-1.0)
    first = int(-1)
    first_distance = float(0.0)
    found = int(-1)
    found_distance = float(0.0)
    for _ in range(starts.shape[0]):
        # the nearest among those further than the ones already refused
        best = int(-1)
        best_distance = float(1.0e30)
        for s in range(starts.shape[0]):
            distance = wp.length(point - closest_on_segment(point, starts[s], ends[s]))
            if distance > passed and distance < best_distance:
                best = s
                best_distance = distance
        if best < 0:
            break
        if first < 0:
            first = best
            first_distance = best_distance
        target = closest_on_segment(point, starts[best], ends[best])
        towards = target - origin
        reach = wp.length(towards)
        if reach <= inset:
            found = best
            found_distance = best_distance
            break
        query = wp.mesh_query_ray(mesh, origin, towards / reach, reach * 0.999)
        if not query.result:
            found = best
            found_distance = best_distance
            break
        passed = best_distance
    if found < 0:
        found = first
        found_distance = first_distance
    nearest_out[tid] = found
    distance_out[tid] = found_distance
