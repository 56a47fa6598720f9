"""Facets of the convex hull of points in six dimensions that are nearest to the origin.

Beneath and beyond (Preparata & Shamos 1985, §3.4.2), towards the origin: as long as a point lies beyond the nearest
facet, the farthest such point is added to the hull; other points are never looked at. Facets are simplices, so points
must be in general position.
"""

import warp as wp

MOST_FACETS = 6144
"""Facets of one hull for which there is room."""

MOST_POINTS = 4096
"""Points of one hull: their numbers take 12 bits."""

TABLE = 16384
"""Places of the table of ridges, a power of two."""

NEAREST = 8
"""Facets that are returned."""

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


@wp.func_native(
    f"""
    const double* p = points.data + 6 * size_t(first);
    double* plane = planes.data + size_t(row) * planes.shape[1];  // normal and distance from the origin
    double* rest = room.data + size_t(row) * room.shape[1];
    int* corner = corners.data + size_t(row) * corners.shape[1];  // in ascending order
    wp::uint64* table = ridges.data + size_t(row) * ridges.shape[1];
    double* out = normals.data + size_t(row) * {6 * NEAREST};
    int facets = 0, simplex[7], pending = 0;
    int waiting[{6 * 7}];
    double middle[6];
    // a simplex: the first point, and each time the one farthest from the span of those before
    for (int i = 0; i < 6 * count; ++i) rest[i] = p[i] - p[i % 6];
    simplex[0] = 0;
    for (int s = 1; s < 7; ++s) {{
        int far = 0;
        double most = 0.0;
        for (int n = 0; n < count; ++n) {{
            double squared = 0.0;
            for (int i = 0; i < 6; ++i) squared += rest[6 * n + i] * rest[6 * n + i];
            if (squared > most) {{ most = squared; far = n; }}
        }}
        if (!(most > 1e-18)) return -1;
        double along[6];
        for (int i = 0; i < 6; ++i) along[i] = rest[6 * far + i] / sqrt(most);
        for (int n = 0; n < count; ++n) {{
            double share = 0.0;
            for (int i = 0; i < 6; ++i) share += rest[6 * n + i] * along[i];
            for (int i = 0; i < 6; ++i) rest[6 * n + i] -= share * along[i];
        }}
        int place = s;
        for (; place > 0 && simplex[place - 1] > far; --place) simplex[place] = simplex[place - 1];
        simplex[place] = far;
    }}
    for (int i = 0; i < 6; ++i) {{
        middle[i] = 0.0;
        for (int s = 0; s < 7; ++s) middle[i] += p[6 * simplex[s] + i] / 7.0;
    }}
    for (int left = 0; left < 7; ++left) {{
        for (int s = 0, k = 0; s < 7; ++s) if (s != left) waiting[6 * pending + k++] = simplex[s];
        ++pending;
    }}
    int added = -1, size = 0;
    while (true) {{
        // planes of new facets: those of the simplex, then one through each ridge of the horizon and the new point
        for (int slot = 0; slot < (added < 0 ? pending : size); ++slot) {{
            int own[6];
            if (added < 0) {{
                for (int k = 0; k < 6; ++k) own[k] = waiting[6 * slot + k];
            }} else {{
                const wp::uint64 entry = table[slot];
                if ((entry >> 60) != 1) continue;
                int k = 0;
                bool placed = false;
                for (int r = 0; r < 5; ++r) {{
                    const int v = (int)(entry >> (12 * r)) & 4095;
                    if (!placed && added < v) {{ own[k++] = added; placed = true; }}
                    own[k++] = v;
                }}
                if (!placed) own[5] = added;
            }}
            if (facets >= {MOST_FACETS}) return -1;
            double m[5][6], normal[6], x[6];
            int column[6] = {{0, 1, 2, 3, 4, 5}};
            const double* base = p + 6 * own[0];
            for (int r = 0; r < 5; ++r)
                for (int i = 0; i < 6; ++i) m[r][i] = p[6 * own[r + 1] + i] - base[i];
            for (int s = 0; s < 5; ++s) {{
                int pr = s, pc = s;
                double most = 0.0;
                for (int r = s; r < 5; ++r)
                    for (int c = s; c < 6; ++c)
                        if (fabs(m[r][c]) > most) {{ most = fabs(m[r][c]); pr = r; pc = c; }}
                if (!(most > 0.0)) return -1;
                for (int c = 0; c < 6; ++c) {{ const double t = m[s][c]; m[s][c] = m[pr][c]; m[pr][c] = t; }}
                for (int r = 0; r < 5; ++r) {{ const double t = m[r][s]; m[r][s] = m[r][pc]; m[r][pc] = t; }}
                const int t = column[s]; column[s] = column[pc]; column[pc] = t;
                for (int r = s + 1; r < 5; ++r) {{
                    const double by = m[r][s] / m[s][s];
                    for (int c = s; c < 6; ++c) m[r][c] -= by * m[s][c];
                }}
            }}
            x[5] = 1.0;
            for (int s = 4; s >= 0; --s) {{
                double sum = 0.0;
                for (int c = s + 1; c < 6; ++c) sum += m[s][c] * x[c];
                x[s] = -sum / m[s][s];
            }}
            double length = 0.0, away = 0.0, centre = 0.0;
            for (int c = 0; c < 6; ++c) {{ normal[column[c]] = x[c]; length += x[c] * x[c]; }}
            length = sqrt(length);
            for (int i = 0; i < 6; ++i) {{
                normal[i] /= length;
                away += normal[i] * base[i];
                centre += normal[i] * middle[i];
            }}
            const double sign = centre > away ? -1.0 : 1.0;
            double* its = plane + 7 * facets;
            for (int i = 0; i < 6; ++i) its[i] = sign * normal[i];
            its[6] = sign * away;
            for (int k = 0; k < 6; ++k) corner[6 * facets + k] = own[k];
            ++facets;
        }}
        int nearest = 0;
        for (int f = 1; f < facets; ++f) if (plane[7 * f + 6] < plane[7 * nearest + 6]) nearest = f;
        // all facets as near as the nearest, but only that one if it goes through the origin
        const double lowest = plane[7 * nearest + 6];
        added = -1;
        for (int turn = -1; turn < facets && added < 0; ++turn) {{
            const int f = turn < 0 ? nearest : turn;
            if (turn >= 0 && (lowest <= slack || plane[7 * f + 6] > lowest + slack)) continue;
            const double* its = plane + 7 * f;
            double most = beyond;
            for (int n = 0; n < count; ++n) {{
                double height = -its[6];
                for (int i = 0; i < 6; ++i) height += its[i] * p[6 * n + i];
                if (height > most) {{ most = height; added = n; }}
            }}
        }}
        if (added < 0) {{
            int found = 0;
            for (int turn = -1; turn < facets && found < {NEAREST}; ++turn) {{
                const int f = turn < 0 ? nearest : turn;
                if (turn >= 0 && (lowest <= slack || f == nearest || plane[7 * f + 6] > lowest + slack)) continue;
                for (int i = 0; i < 6; ++i) out[6 * found + i] = plane[7 * f + i];
                ++found;
            }}
            return found;
        }}
        // facets that see the point go; the horizon are the ridges that only one of them has
        const double* at = p + 6 * added;
        int seen = 0;
        for (int f = 0; f < facets; ++f) {{
            double height = -plane[7 * f + 6];
            for (int i = 0; i < 6; ++i) height += plane[7 * f + i] * at[i];
            if (height > 0.0) {{  // those to be removed come first
                for (int i = 0; i < 7; ++i) {{
                    const double t = plane[7 * f + i]; plane[7 * f + i] = plane[7 * seen + i]; plane[7 * seen + i] = t;
                }}
                for (int k = 0; k < 6; ++k) {{
                    const int t = corner[6 * f + k]; corner[6 * f + k] = corner[6 * seen + k]; corner[6 * seen + k] = t;
                }}
                ++seen;
            }}
        }}
        size = 16;
        while (size < 12 * seen) size *= 2;
        if (size > {TABLE}) return -1;
        for (int slot = 0; slot < size; ++slot) table[slot] = 0;
        for (int f = 0; f < seen; ++f)
            for (int left = 0; left < 6; ++left) {{
                wp::uint64 key = 0;
                for (int k = 0, r = 0; k < 6; ++k)
                    if (k != left) key |= (wp::uint64)(corner[6 * f + k]) << (12 * r++);
                int slot = (int)((key * 0x9E3779B97F4A7C15ull) >> 40) & (size - 1);
                while (table[slot] && (table[slot] & 0xFFFFFFFFFFFFFFFull) != key) slot = (slot + 1) & (size - 1);
                const wp::uint64 times = (table[slot] >> 60) + 1;
                if (times > 2) return -1;  // no surface: rounding decided against the order of points
                table[slot] = key | times << 60;
            }}
        // the last facets take the places of those that go
        for (int f = 0; f < seen && facets > 0; ++f) {{
            --facets;
            if (facets < seen) continue;
            for (int i = 0; i < 7; ++i) plane[7 * f + i] = plane[7 * facets + i];
            for (int k = 0; k < 6; ++k) corner[6 * f + k] = corner[6 * facets + k];
        }}
    }}
"""
)
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
