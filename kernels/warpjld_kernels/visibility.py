"""Nearest segment that is visible from a surface point inside the surface."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

# the same options as the deforming kernels, so that both use one precompiled header, which takes longest to compile
wp.set_module_options(VECTORISED)

# share of the way to a segment that must be unobstructed, so that the visibility of a segment that ends on the surface,
# as at a wrist, does not depend on rounding
SHORT_OF = wp.constant(0.98)


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
    tie: float,
    # segments
    starts: wp.array(dtype=wp.vec3),
    ends: wp.array(dtype=wp.vec3),
    # scratch
    distances: wp.array2d(dtype=float),
    # out
    nearest_out: wp.array(dtype=wp.int32),
    distance_out: wp.array(dtype=float),
):
    """Nearest segment whose closest point is visible without crossing the surface; the nearest of all where none is.

    Of segments whose distances differ by less than ``tie`` the first one counts as nearest: at a joint two are equally
    near, and rounding must not decide. ``distances`` has a row of scratch for each point, since segments are tried in
    order of distance until one is visible.
    """
    tid = wp.tid()
    point = points[tid]
    origin = point - inset * normals[tid]
    for s in range(starts.shape[0]):
        distances[tid, s] = wp.length(point - closest_on_segment(point, starts[s], ends[s]))
    first = int(-1)
    first_distance = float(0.0)
    found = int(-1)
    found_distance = float(0.0)
    level = float(-1.0e30)  # distance of the segments that are tried now, up to ties
    last = int(starts.shape[0])  # the last of them that was not visible
    for _ in range(2 * starts.shape[0]):
        best = int(-1)
        best_distance = float(0.0)
        for s in range(last + 1, starts.shape[0]):
            distance = distances[tid, s]
            if best < 0 and distance >= level and distance <= level + tie:
                best = s
                best_distance = distance
        if best < 0:  # none of them is visible: go on to the nearest of those further away
            further = float(1.0e30)
            for s in range(starts.shape[0]):
                distance = distances[tid, s]
                if distance > level + tie and distance < further:
                    further = distance
            if further == 1.0e30:
                break
            level = further
            last = -1
            continue
        last = best
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
        if not wp.mesh_query_ray_anyhit(mesh, origin, towards / reach, reach * SHORT_OF):
            found = best
            found_distance = best_distance
            break
    if found < 0:
        found = wp.max(first, 0)
        found_distance = first_distance
    nearest_out[tid] = found
    distance_out[tid] = found_distance
