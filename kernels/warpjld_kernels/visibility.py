"""Nearest segment that is visible from a surface point inside the surface."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude

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


LANES = 8
"""Distances compared at once; rows of them are padded to a multiple of it."""

NOWHERE = wp.constant(1.0e30)  # distance of padding, beyond all others


@wp.func_native(
    prelude(LANES)
    + """
    const float* own = distances.data + size_t(row) * distances.shape[1];
    for (int base = (last + 1) / N * N; base < distances.shape[1]; base += N) {
        const Floats away = *(const Stored*)(own + base);
        unsigned int near = LANES_OF(away >= level) & LANES_OF(away <= level + tie);
        if (base <= last) near &= ~0u << (last + 1 - base);
        if (near) return base + FIRST_OF(near);
    }
    return -1;
"""
)
def next_of(distances: wp.array2d(dtype=float), row: int, last: int, level: float, tie: float) -> int:
    """First segment after ``last`` whose distance is ``level`` or up to ``tie`` more; -1 for none."""


@wp.func_native(
    prelude(LANES)
    + """
    const float* own = distances.data + size_t(row) * distances.shape[1];
    Floats least = Floats(1e30f);
    for (int base = 0; base < distances.shape[1]; base += N) {
        const Floats away = *(const Stored*)(own + base);
        least = LOWEST(least, away > beyond ? away : Floats(1e30f));
    }
    float out = 1e30f;
    for (int l = 0; l < N; ++l) out = PICK(least, l) < out ? PICK(least, l) : out;
    return out;
"""
)
def least_beyond(distances: wp.array2d(dtype=float), row: int, beyond: float) -> float:
    """Least distance greater than ``beyond``; ``NOWHERE`` for none."""


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
    near, and rounding must not decide. ``distances`` has a row of scratch for each point, of the number of segments
    rounded up to a multiple of ``LANES``, since segments are tried in order of distance until one is visible.
    """
    tid = wp.tid()
    point = points[tid]
    origin = point - inset * normals[tid]
    for s in range(starts.shape[0]):
        distances[tid, s] = wp.length(point - closest_on_segment(point, starts[s], ends[s]))
    for s in range(starts.shape[0], distances.shape[1]):
        distances[tid, s] = NOWHERE
    first = int(-1)
    first_distance = float(0.0)
    found = int(-1)
    found_distance = float(0.0)
    level = float(-1.0e30)  # distance of the segments that are tried now, up to ties
    last = int(starts.shape[0])  # the last of them that was not visible
    for _ in range(2 * starts.shape[0]):
        best = next_of(distances, tid, last, level, tie)
        if best < 0:  # none of them is visible: go on to the nearest of those further away
            level = least_beyond(distances, tid, level + tie)
            if level == NOWHERE:
                break
            last = -1
            continue
        best_distance = distances[tid, best]
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
