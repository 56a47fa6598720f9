"""Bounds on signed distances to a solid from a grid of exact ones, so that few points have to be measured.

Distances are 1-Lipschitz: for any node c, d(p) ≥ d(c) − |p − c| and |d(p)| ≤ |d(c)| + |p − c|. Nodes are measured on
first use.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.surface_distance import Hit, Solids, nearest

wp.set_module_options({**VECTORISED, "max_unroll": 1})

UNKNOWN = wp.constant(1.0e30)  # distance [m] at nodes whose cell is not sampled


@wp.struct
class SignedGrid:
    """Nodes ``step`` apart, x slowest, from ``low`` on, round one object in its own frame.

    ``count`` is zero for surfaces that are no solids: there signs jump at holes. ``lowest`` and ``highest`` are the
    object's bounding box.
    """

    object: int
    lowest: wp.vec3d
    highest: wp.vec3d
    low: wp.vec3d
    step: wp.float64
    count: wp.vec3i
    values: wp.array(dtype=wp.float64)


@wp.func
def node_distance(solids: Solids, grid: SignedGrid, i: int, j: int, k: int) -> wp.float64:
    """Signed distance at a node."""
    n = (i * grid.count[1] + j) * grid.count[2] + k
    value = grid.values[n]
    if value >= wp.float64(UNKNOWN):
        at = grid.low + grid.step * wp.vec3d(wp.float64(i), wp.float64(j), wp.float64(k))
        hit = nearest(solids, grid.object, at, wp.float64(1.0e10))
        value = wp.float64(hit.distance)
        grid.values[n] = value
    return value


@wp.func
def distance_bounds(solids: Solids, grid: SignedGrid, p: wp.vec3d) -> wp.vec2d:
    """Lower bound of a point's signed distance, and upper bound of its distance [m]."""
    zero = wp.float64(0.0)
    away = wp.max(wp.max(grid.lowest - p, p - grid.highest), wp.vec3d(zero))
    least = wp.length(away)
    most = wp.length(wp.max(wp.abs(grid.lowest - p), wp.abs(p - grid.highest)))
    if grid.count[0] > 0:
        inside = (p - grid.low) / grid.step
        i = int(wp.floor(inside[0]))
        j = int(wp.floor(inside[1]))
        k = int(wp.floor(inside[2]))
        within = i >= 0 and j >= 0 and k >= 0
        if within and i + 1 < grid.count[0] and j + 1 < grid.count[1] and k + 1 < grid.count[2]:
            if least <= zero:
                least = -wp.float64(UNKNOWN)
            for corner in range(8):
                a = i + (corner >> 2)
                b = j + ((corner >> 1) & 1)
                c = k + (corner & 1)
                value = node_distance(solids, grid, a, b, c)
                at = grid.low + grid.step * wp.vec3d(wp.float64(a), wp.float64(b), wp.float64(c))
                apart = wp.length(p - at)
                least = wp.max(least, value - apart)
                most = wp.min(most, wp.abs(value) + apart)
        return wp.vec2d(least - wp.float64(1.0e-6), most * wp.float64(1.0001) + wp.float64(1.0e-6))
    if least <= zero:
        least = -wp.float64(UNKNOWN)
    return wp.vec2d(least - wp.float64(1.0e-6), most * wp.float64(1.0001) + wp.float64(1.0e-6))


@wp.func
def bounded(solids: Solids, grid: SignedGrid, p: wp.vec3d, most: wp.float64) -> Hit:
    """Signed distance of a point that is no farther than ``most``."""
    return nearest(solids, grid.object, p, most)


@wp.kernel
def least_by_part(
    solids: Solids,
    grid: SignedGrid,
    # poses, in the object's frame
    points: wp.array2d(dtype=wp.vec3),
    chosen: wp.array(dtype=wp.int32),
    part_of: wp.array(dtype=wp.int32),
    # scratch
    bounds: wp.array2d(dtype=wp.vec2d),
    nearest_of: wp.array2d(dtype=wp.int32),
    # in and out
    gaps: wp.array2d(dtype=wp.float64),
):
    """Smallest signed distance of each part's points to an object, exact; only candidates by the bounds are
    measured."""
    pose = wp.tid()
    count = chosen.shape[0]
    for n in range(count):
        part = part_of[n]
        two = distance_bounds(solids, grid, wp.vec3d(points[pose, chosen[n]]))
        bounds[pose, n] = two
        first = nearest_of[pose, part]
        if first < 0 or two[0] < bounds[pose, first][0]:
            nearest_of[pose, part] = n
    for part in range(gaps.shape[1]):
        first = nearest_of[pose, part]
        if first >= 0 and bounds[pose, first][0] < gaps[pose, part]:
            hit = bounded(solids, grid, wp.vec3d(points[pose, chosen[first]]), bounds[pose, first][1])
            gaps[pose, part] = wp.min(gaps[pose, part], wp.float64(hit.distance))
    for n in range(count):
        part = part_of[n]
        if bounds[pose, n][0] < gaps[pose, part] and n != nearest_of[pose, part]:
            hit = bounded(solids, grid, wp.vec3d(points[pose, chosen[n]]), bounds[pose, n][1])
            gaps[pose, part] = wp.min(gaps[pose, part], wp.float64(hit.distance))


@wp.kernel
def measure_near(
    solids: Solids,
    grid: SignedGrid,
    # points in the object's frame
    points: wp.array(dtype=wp.vec3d),
    limit: wp.float64,
    # out
    distance_out: wp.array(dtype=float),
    face_out: wp.array(dtype=wp.int32),
    point_out: wp.array(dtype=wp.vec3),
):
    """Signed distances, nearest triangles and points; none for points farther outside than ``limit`` by the bounds."""
    n = wp.tid()
    two = distance_bounds(solids, grid, points[n])
    face_out[n] = -1
    distance_out[n] = float(UNKNOWN)
    if two[0] <= limit:
        hit = bounded(solids, grid, points[n], two[1])
        distance_out[n] = hit.distance
        face_out[n] = hit.face
        point_out[n] = hit.point


@wp.kernel
def least_distances(
    grid: SignedGrid,
    solids: Solids,
    # poses of a skin, in the object's frame
    points: wp.array2d(dtype=wp.vec3),
    # neighbours of every vertex, those of a vertex one after another
    first_of: wp.array(dtype=wp.int32),
    others: wp.array(dtype=wp.int32),
    # out
    least_out: wp.array2d(dtype=float),
):
    """Lower bounds of the signed distances of everything on the edges at a vertex [m]."""
    pose, n = wp.tid()
    at = points[pose, n]
    two = distance_bounds(solids, grid, wp.vec3d(at))
    longest = float(0.0)
    for k in range(first_of[n], first_of[n + 1]):
        longest = wp.max(longest, wp.length(points[pose, others[k]] - at))
    least_out[pose, n] = float(two[0]) - longest
