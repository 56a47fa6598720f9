"""Convex hulls of points in six dimensions: their facets that are nearest to the origin, and their volumes.

Where only the nearest facets are wanted, the hull grows towards the origin (``growing_hull``): as long as a point lies
beyond the nearest facet, the farthest such point is added to the hull; other points are never looked at.
"""

import warp as wp

from warpjld_kernels.growing_hull import growing_hull

MOST_FACETS = 6144
"""Facets of one hull for which there is room."""

TABLE = 16384
"""Places of the table of ridges, a power of two."""

NEAREST = 8
"""Facets that are returned."""

MOST_OF_WHOLE = 24576
"""Facets of one whole hull for which there is room."""

TABLE_OF_WHOLE = 65536
"""Places of its table of ridges, a power of two."""

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


_ROOM = """
    const double* p = points.data + 6 * size_t(first);
    double* plane = planes.data + size_t(row) * planes.shape[1];  // normal and distance from the origin
    double* rest = room.data + size_t(row) * room.shape[1];
    int* corner = corners.data + size_t(row) * corners.shape[1];  // in ascending order
    wp::uint64* table = ridges.data + size_t(row) * ridges.shape[1];
    double* out = normals.data + size_t(row) * normals.shape[1];
"""

_LOWEST = """
        int nearest = 0;
        for (int f = 1; f < facets; ++f) if (plane[STRIDE * f + 6] < plane[STRIDE * nearest + 6]) nearest = f;
        // all facets as near as the nearest, but only that one if it goes through the origin
        const double lowest = plane[STRIDE * nearest + 6];
"""

_ANSWER = """
            int found = 0;
            for (int turn = -1; turn < facets && 6 * found < normals.shape[1]; ++turn) {
                const int f = turn < 0 ? nearest : turn;
                if (turn >= 0 && (lowest <= slack || f == nearest || plane[STRIDE * f + 6] > lowest + slack)) continue;
                for (int i = 0; i < 6; ++i) out[6 * found + i] = plane[STRIDE * f + i];
                ++found;
            }
            return found;
"""

_TOWARDS_ORIGIN = (
    _LOWEST
    + """
        added = -1;
        for (int turn = -1; turn < facets && added < 0; ++turn) {
            const int f = turn < 0 ? nearest : turn;
            if (turn >= 0 && (lowest <= slack || plane[STRIDE * f + 6] > lowest + slack)) continue;
            const double* its = plane + STRIDE * f;
            double most = beyond;
            for (int n = 0; n < count; ++n) {
                double height = -its[6];
                for (int i = 0; i < 6; ++i) height += its[i] * p[6 * n + i];
                if (height > most) { most = height; added = n; }
            }
        }
        if (added < 0) {
"""
    + _ANSWER
    + "        }\n"
)

_EVERY_POINT = (
    """
        // the farthest first; points inside are passed over
        if (added < 0) {
            for (int n = 0; n < count; ++n) {
                double squared = 0.0;
                for (int i = 0; i < 6; ++i) squared += (p[6 * n + i] - middle[i]) * (p[6 * n + i] - middle[i]);
                rest[6 * n] = squared;
            }
            for (int s = 0; s < 7; ++s) rest[6 * simplex[s]] = -1.0;
        }
        added = -1;
        while (added < 0) {
            int far = -1;
            double most = 0.0;
            for (int n = 0; n < count; ++n) if (rest[6 * n] > most) { most = rest[6 * n]; far = n; }
            if (far < 0) break;
            rest[6 * far] = -1.0;
            for (int f = 0; f < facets && added < 0; ++f) {
                double height = -plane[STRIDE * f + 6];
                for (int i = 0; i < 6; ++i) height += plane[STRIDE * f + i] * p[6 * far + i];
                if (height > beyond) added = far;
            }
        }
        if (added < 0) {
            // cones from a point inside to the facets between the unperturbed points
            const double* given = exact.data + 6 * size_t(first);
            double sum[6] = {0.0}, from[6] = {0.0}, area = 0.0, volume = 0.0, open = 0.0;
            for (int s = 0; s < 7; ++s) for (int i = 0; i < 6; ++i) from[i] += given[6 * simplex[s] + i] / 7.0;
            for (int f = 0; f < facets; ++f) {
                double normal[6], squared = 0.0;
                across(given, corner + 6 * f, normal);
                const double sign = plane[STRIDE * f + 7];
                for (int i = 0; i < 6; ++i) {
                    sum[i] += sign * normal[i];
                    volume += sign * normal[i] * (given[6 * corner[6 * f] + i] - from[i]) / 720.0;
                    squared += normal[i] * normal[i];
                }
                area += sqrt(squared);
            }
            for (int i = 0; i < 6; ++i) open += sum[i] * sum[i];
            if (sqrt(open) > 1e-9 * area) return -1;  // the normals of a closed surface sum to zero
            volumes.data[row] = volume;
"""
    + _LOWEST
    + _ANSWER
    + "        }\n"
)


@wp.func_native(_ROOM + growing_hull(_TOWARDS_ORIGIN, facets=MOST_FACETS, table=TABLE))
def facets_near_origin(
    points: wp.array(dtype=wp.float64),
    first: int,
    count: int,
    beyond: wp.float64,
    slack: wp.float64,
    row: int,
    planes: wp.array2d(dtype=wp.float64),
    room: wp.array2d(dtype=wp.float64),
    corners: wp.array2d(dtype=wp.int32),
    ridges: wp.array2d(dtype=wp.uint64),
    normals: wp.array2d(dtype=wp.float64),
) -> int:
    """Number of normals, the nearest facet first, or alone if it goes through the origin.

    −1 where points are not in general position, or there is no room.
    """


@wp.kernel
def nearest_facets(
    # points of all hulls, six numbers each, those of a hull one after another
    points: wp.array(dtype=wp.float64),
    first_of: wp.array(dtype=wp.int32),
    # height beyond a facet from which a point is outside, and distance from the nearest facet of those returned
    beyond: wp.array(dtype=wp.float64),
    slack: wp.array(dtype=wp.float64),
    # scratch, a row a hull
    planes: wp.array2d(dtype=wp.float64),
    room: wp.array2d(dtype=wp.float64),
    corners: wp.array2d(dtype=wp.int32),
    ridges: wp.array2d(dtype=wp.uint64),
    # out
    normals_out: wp.array2d(dtype=wp.float64),
    count_out: wp.array(dtype=wp.int32),
):
    """Unit normals of the facets nearest to the origin, one hull a thread."""
    row = wp.tid()
    count_out[row] = facets_near_origin(
        points,
        first_of[row],
        first_of[row + 1] - first_of[row],
        beyond[row],
        slack[row],
        row,
        planes,
        room,
        corners,
        ridges,
        normals_out,
    )


@wp.func_native(_ROOM + growing_hull(_EVERY_POINT, facets=MOST_OF_WHOLE, table=TABLE_OF_WHOLE))
def whole_hull(
    points: wp.array(dtype=wp.float64),
    exact: wp.array(dtype=wp.float64),
    first: int,
    count: int,
    beyond: wp.float64,
    slack: wp.float64,
    row: int,
    planes: wp.array2d(dtype=wp.float64),
    room: wp.array2d(dtype=wp.float64),
    corners: wp.array2d(dtype=wp.int32),
    ridges: wp.array2d(dtype=wp.uint64),
    normals: wp.array2d(dtype=wp.float64),
    volumes: wp.array(dtype=wp.float64),
) -> int:
    """As ``facets_near_origin``, by way of all facets; −1 also where these do not close."""


@wp.kernel
def whole_hulls(
    # points of all hulls, six numbers each, perturbed and as they are; those of a hull one after another
    points: wp.array(dtype=wp.float64),
    exact: wp.array(dtype=wp.float64),
    first_of: wp.array(dtype=wp.int32),
    # as of ``nearest_facets``
    beyond: wp.array(dtype=wp.float64),
    slack: wp.array(dtype=wp.float64),
    planes: wp.array2d(dtype=wp.float64),
    room: wp.array2d(dtype=wp.float64),
    corners: wp.array2d(dtype=wp.int32),
    ridges: wp.array2d(dtype=wp.uint64),
    # out
    normals_out: wp.array2d(dtype=wp.float64),
    count_out: wp.array(dtype=wp.int32),
    volume_out: wp.array(dtype=wp.float64),
):
    """Unit normals of the facets nearest to the origin, and the volume between the unperturbed points."""
    row = wp.tid()
    count_out[row] = whole_hull(
        points,
        exact,
        first_of[row],
        first_of[row + 1] - first_of[row],
        beyond[row],
        slack[row],
        row,
        planes,
        room,
        corners,
        ridges,
        normals_out,
        volume_out,
    )
