"""C++ for convex hulls of points in six dimensions that grow by a point at a time.

Beneath and beyond (Preparata & Shamos 1985, §3.4.2): facets that see a new point go, and each ridge of their horizon
makes a facet with it. Facets are simplices, so points must be in general position.
"""

MOST_POINTS = 4096
"""Points of one hull: their numbers take 12 bits."""

STRIDE = 8
"""Numbers of a facet's plane: normal, distance from the origin, sign of the normal against the minors of its points."""

_ACROSS = """
    // normal of the hyperplane through six points: the minors of their differences, with the sign of the points' order
    auto across = [](const double* points, const int* own, double* normal) {
        double m[5][6], x[6], size = 1.0;
        int column[6] = {0, 1, 2, 3, 4, 5};
        const double* base = points + 6 * own[0];
        for (int i = 0; i < 6; ++i) normal[i] = 0.0;
        for (int r = 0; r < 5; ++r)
            for (int i = 0; i < 6; ++i) m[r][i] = points[6 * own[r + 1] + i] - base[i];
        for (int s = 0; s < 5; ++s) {
            int pr = s, pc = s;
            double most = 0.0;
            for (int r = s; r < 5; ++r)
                for (int c = s; c < 6; ++c)
                    if (fabs(m[r][c]) > most) { most = fabs(m[r][c]); pr = r; pc = c; }
            if (!(most > 0.0)) return false;
            if (pr != s) size = -size;
            if (pc != s) size = -size;
            for (int c = 0; c < 6; ++c) { const double t = m[s][c]; m[s][c] = m[pr][c]; m[pr][c] = t; }
            for (int r = 0; r < 5; ++r) { const double t = m[r][s]; m[r][s] = m[r][pc]; m[r][pc] = t; }
            const int t = column[s]; column[s] = column[pc]; column[pc] = t;
            size *= m[s][s];
            for (int r = s + 1; r < 5; ++r) {
                const double by = m[r][s] / m[s][s];
                for (int c = s; c < 6; ++c) m[r][c] -= by * m[s][c];
            }
        }
        x[5] = size;
        for (int s = 4; s >= 0; --s) {
            double sum = 0.0;
            for (int c = s + 1; c < 6; ++c) sum += m[s][c] * x[c];
            x[s] = -sum / m[s][s];
        }
        for (int c = 0; c < 6; ++c) normal[column[c]] = x[c];
        return true;
    };
"""

_BEGINNING = """
    int facets = 0, simplex[7], pending = 0;
    int waiting[6 * 7];
    double middle[6];
    // a simplex: the first point, and each time the one farthest from the span of those before
    for (int i = 0; i < 6 * count; ++i) rest[i] = p[i] - p[i % 6];
    simplex[0] = 0;
    for (int s = 1; s < 7; ++s) {
        int far = 0;
        double most = 0.0;
        for (int n = 0; n < count; ++n) {
            double squared = 0.0;
            for (int i = 0; i < 6; ++i) squared += rest[6 * n + i] * rest[6 * n + i];
            if (squared > most) { most = squared; far = n; }
        }
        if (!(most > 1e-18)) return -1;
        double along[6];
        for (int i = 0; i < 6; ++i) along[i] = rest[6 * far + i] / sqrt(most);
        for (int n = 0; n < count; ++n) {
            double share = 0.0;
            for (int i = 0; i < 6; ++i) share += rest[6 * n + i] * along[i];
            for (int i = 0; i < 6; ++i) rest[6 * n + i] -= share * along[i];
        }
        int place = s;
        for (; place > 0 && simplex[place - 1] > far; --place) simplex[place] = simplex[place - 1];
        simplex[place] = far;
    }
    for (int i = 0; i < 6; ++i) {
        middle[i] = 0.0;
        for (int s = 0; s < 7; ++s) middle[i] += p[6 * simplex[s] + i] / 7.0;
    }
    for (int left = 0; left < 7; ++left) {
        for (int s = 0, k = 0; s < 7; ++s) if (s != left) waiting[6 * pending + k++] = simplex[s];
        ++pending;
    }
    int added = -1, size = 0;
    while (true) {
        // planes of new facets: those of the simplex, then one through each ridge of the horizon and the new point
        for (int slot = 0; slot < (added < 0 ? pending : size); ++slot) {
            int own[6];
            if (added < 0) {
                for (int k = 0; k < 6; ++k) own[k] = waiting[6 * slot + k];
            } else {
                const wp::uint64 entry = table[slot];
                if ((entry >> 60) != 1) continue;
                int k = 0;
                bool placed = false;
                for (int r = 0; r < 5; ++r) {
                    const int v = (int)(entry >> (12 * r)) & 4095;
                    if (!placed && added < v) { own[k++] = added; placed = true; }
                    own[k++] = v;
                }
                if (!placed) own[5] = added;
            }
            if (facets >= MOST_FACETS) return -1;
            double normal[6];
            if (!across(p, own, normal)) return -1;
            const double* base = p + 6 * own[0];
            double length = 0.0, away = 0.0, centre = 0.0;
            for (int i = 0; i < 6; ++i) length += normal[i] * normal[i];
            length = sqrt(length);
            for (int i = 0; i < 6; ++i) {
                normal[i] /= length;
                away += normal[i] * base[i];
                centre += normal[i] * middle[i];
            }
            const double sign = centre > away ? -1.0 : 1.0;
            double* its = plane + STRIDE * facets;
            for (int i = 0; i < 6; ++i) its[i] = sign * normal[i];
            its[6] = sign * away;
            its[7] = sign;
            for (int k = 0; k < 6; ++k) corner[6 * facets + k] = own[k];
            ++facets;
        }
"""

_END = """
        // facets that see the point go; the horizon are the ridges that only one of them has
        const double* at = p + 6 * added;
        int seen = 0;
        for (int f = 0; f < facets; ++f) {
            double height = -plane[STRIDE * f + 6];
            for (int i = 0; i < 6; ++i) height += plane[STRIDE * f + i] * at[i];
            if (height > 0.0) {  // those to be removed come first
                for (int i = 0; i < STRIDE; ++i) {
                    const double t = plane[STRIDE * f + i];
                    plane[STRIDE * f + i] = plane[STRIDE * seen + i];
                    plane[STRIDE * seen + i] = t;
                }
                for (int k = 0; k < 6; ++k) {
                    const int t = corner[6 * f + k]; corner[6 * f + k] = corner[6 * seen + k]; corner[6 * seen + k] = t;
                }
                ++seen;
            }
        }
        size = 16;
        while (size < 12 * seen) size *= 2;
        if (size > TABLE) return -1;
        for (int slot = 0; slot < size; ++slot) table[slot] = 0;
        for (int f = 0; f < seen; ++f)
            for (int left = 0; left < 6; ++left) {
                wp::uint64 key = 0;
                for (int k = 0, r = 0; k < 6; ++k)
                    if (k != left) key |= (wp::uint64)(corner[6 * f + k]) << (12 * r++);
                int slot = (int)((key * 0x9E3779B97F4A7C15ull) >> 40) & (size - 1);
                while (table[slot] && (table[slot] & 0xFFFFFFFFFFFFFFFull) != key) slot = (slot + 1) & (size - 1);
                const wp::uint64 times = (table[slot] >> 60) + 1;
                if (times > 2) return -1;  // no surface: rounding decided against the order of points
                table[slot] = key | times << 60;
            }
        // the last facets take the places of those that go
        for (int f = 0; f < seen && facets > 0; ++f) {
            --facets;
            if (facets < seen) continue;
            for (int i = 0; i < STRIDE; ++i) plane[STRIDE * f + i] = plane[STRIDE * facets + i];
            for (int k = 0; k < 6; ++k) corner[6 * f + k] = corner[6 * facets + k];
        }
    }
"""


def growing_hull(choose: str, *, facets: int, table: int) -> str:
    """Body of a function that returns -1 where points are not in general position, or there is no room.

    It uses ``p``, the points, and ``count`` of them; ``plane`` and ``corner``, for facets; ``rest``, six numbers a
    point; ``table``, for ridges.

    Args:
        choose: C++ that sets ``added`` to the next point, or returns; ``facets`` of them there are by then.
        facets: Facets for which there is room.
        table: Places of the table of ridges, a power of two.
    """
    body = _ACROSS + _BEGINNING + choose + _END
    for name, value in (("MOST_FACETS", facets), ("TABLE", table), ("STRIDE", STRIDE)):
        body = body.replace(name, str(value))
    return body
