"""Facets that may touch, and the mortar integrals of those that do.

Each pair of a slave and a master quadrilateral is projected onto the slave's plane, cut (Sutherland and Hodgman) and
integrated over the common polygon, triangle by triangle: what passes through non-matching meshes is then exact.
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "cpu_compiler_flags": "-march=native -ffp-contract=fast"})


@wp.kernel
def facet_pairs(
    bvh: wp.uint64,
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    label: wp.array(dtype=wp.int32),
    other_label: wp.array(dtype=wp.int32),
    excluded: wp.array2d(dtype=wp.uint8),
    starts: wp.array(dtype=wp.int32),
    fill: wp.bool,
    # out
    counts: wp.array(dtype=wp.int32),
    found: wp.array(dtype=wp.int32),
):
    """Master facets whose boxes meet that of each slave facet, counted, or written from ``starts`` on."""
    facet = wp.tid()
    mine = label[facet]
    query = wp.bvh_query_aabb(bvh, lower[facet], upper[facet])
    other = wp.int32(0)
    count = wp.int32(0)
    while wp.bvh_query_next(query, other):
        if excluded[mine, other_label[other]] == wp.uint8(0):
            if fill:
                found[starts[facet] + count] = other
            count += 1
    if not fill:
        counts[facet] = count


@wp.func_native(
    """
    auto shape = [](double s, double t, double* n) {
        n[0] = 0.25 * (1 - s) * (1 - t);
        n[1] = 0.25 * (1 + s) * (1 - t);
        n[2] = 0.25 * (1 + s) * (1 + t);
        n[3] = 0.25 * (1 - s) * (1 + t);
    };
    // shape functions of a plane quadrilateral at a point in it
    auto invert = [&shape](const double (*p)[2], double x, double y, double* n) {
        double s = 0, t = 0;
        for (int k = 0; k < 20; ++k) {
            shape(s, t, n);
            double rx = -x, ry = -y;
            for (int i = 0; i < 4; ++i) {
                rx += n[i] * p[i][0];
                ry += n[i] * p[i][1];
            }
            const double ds[4] = {-0.25 * (1 - t), 0.25 * (1 - t), 0.25 * (1 + t), -0.25 * (1 + t)};
            const double dt[4] = {-0.25 * (1 - s), -0.25 * (1 + s), 0.25 * (1 + s), 0.25 * (1 - s)};
            double a = 0, b = 0, c = 0, d = 0;
            for (int i = 0; i < 4; ++i) {
                a += ds[i] * p[i][0];
                b += dt[i] * p[i][0];
                c += ds[i] * p[i][1];
                d += dt[i] * p[i][1];
            }
            const double det = a * d - b * c;
            if (det == 0) return false;
            const double u = (d * rx - b * ry) / det, v = (a * ry - c * rx) / det;
            s -= u;
            t -= v;
            s = s < -1.5 ? -1.5 : s > 1.5 ? 1.5 : s;
            t = t < -1.5 ? -1.5 : t > 1.5 ? 1.5 : t;
            if (u * u + v * v < 1e-26) break;
        }
        shape(s < -1 ? -1 : s > 1 ? 1 : s, t < -1 ? -1 : t > 1 ? 1 : t, n);
        return true;
    };
    const int* sc = slave.data + 4 * pairs.data[2 * pair];
    const int* mc = master.data + 4 * pairs.data[2 * pair + 1];
    double* out = integrals.data + 33 * size_t(pair);
    for (int i = 0; i < 33; ++i) out[i] = 0;
    double xs[4][3], xm[4][3], c[3] = {0, 0, 0};
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 3; ++k) {
            xs[i][k] = x.data[3 * sc[i] + k];
            xm[i][k] = x.data[3 * mc[i] + k];
            c[k] += 0.25 * xs[i][k];
        }
    double a[3], b[3], n[3], g[3], h[3], m[3];
    for (int k = 0; k < 3; ++k) {
        a[k] = xs[2][k] - xs[0][k];
        b[k] = xs[3][k] - xs[1][k];
        g[k] = xm[2][k] - xm[0][k];
        h[k] = xm[3][k] - xm[1][k];
    }
    for (int k = 0; k < 3; ++k) {
        n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        m[k] = g[(k + 1) % 3] * h[(k + 2) % 3] - g[(k + 2) % 3] * h[(k + 1) % 3];
    }
    const double size = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const double other = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    if (!(size > 0) || !(other > 0)) return;
    for (int k = 0; k < 3; ++k) n[k] /= size;
    const double cosine = (n[0] * m[0] + n[1] * m[1] + n[2] * m[2]) / other;
    if (!(cosine < facing)) return;
    const double along = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    double e[3], f[3];
    for (int k = 0; k < 3; ++k) e[k] = a[k] / along;
    for (int k = 0; k < 3; ++k) f[k] = n[(k + 1) % 3] * e[(k + 2) % 3] - n[(k + 2) % 3] * e[(k + 1) % 3];

    double ps[4][2], pm[4][2];
    for (int i = 0; i < 4; ++i) {
        ps[i][0] = ps[i][1] = pm[i][0] = pm[i][1] = 0;
        for (int k = 0; k < 3; ++k) {
            ps[i][0] += (xs[i][k] - c[k]) * e[k];
            ps[i][1] += (xs[i][k] - c[k]) * f[k];
            pm[i][0] += (xm[i][k] - c[k]) * e[k];
            pm[i][1] += (xm[i][k] - c[k]) * f[k];
        }
    }
    double poly[2][12][2];
    int count = 4, now = 0;
    for (int i = 0; i < 4; ++i) {
        poly[0][i][0] = ps[i][0];
        poly[0][i][1] = ps[i][1];
    }
    for (int edge = 0; edge < 4 && count > 2; ++edge) {  // the master is seen from behind: clockwise
        const double* p = pm[(4 - edge) % 4];
        const double* q = pm[3 - edge];
        const double ex = q[0] - p[0], ey = q[1] - p[1];
        if (ex * ex + ey * ey <= 1e-28 * size) continue;
        int kept = 0;
        for (int i = 0; i < count; ++i) {
            const double* u = poly[now][i];
            const double* v = poly[now][(i + 1) % count];
            const double du = ex * (u[1] - p[1]) - ey * (u[0] - p[0]);
            const double dv = ex * (v[1] - p[1]) - ey * (v[0] - p[0]);
            if (du >= 0) {
                poly[1 - now][kept][0] = u[0];
                poly[1 - now][kept++][1] = u[1];
            }
            if ((du > 0 && dv < 0) || (du < 0 && dv > 0)) {
                const double r = du / (du - dv);
                poly[1 - now][kept][0] = u[0] + r * (v[0] - u[0]);
                poly[1 - now][kept++][1] = u[1] + r * (v[1] - u[1]);
            }
            if (kept > 10) break;
        }
        now = 1 - now;
        count = kept;
    }
    if (count < 3) return;
    double mid[2] = {0, 0};
    for (int i = 0; i < count; ++i) {
        mid[0] += poly[now][i][0] / count;
        mid[1] += poly[now][i][1] / count;
    }
    const double bary[7][4] = {
        {1.0 / 3, 1.0 / 3, 1.0 / 3, 0.225},
        {0.059715871789770, 0.470142064105115, 0.470142064105115, 0.132394152788506},
        {0.470142064105115, 0.059715871789770, 0.470142064105115, 0.132394152788506},
        {0.470142064105115, 0.470142064105115, 0.059715871789770, 0.132394152788506},
        {0.797426985353087, 0.101286507323456, 0.101286507323456, 0.125939180544827},
        {0.101286507323456, 0.797426985353087, 0.101286507323456, 0.125939180544827},
        {0.101286507323456, 0.101286507323456, 0.797426985353087, 0.125939180544827}};
    double area = 0, gap = 0;
    for (int i = 0; i < count; ++i) {
        const double* u = poly[now][i];
        const double* v = poly[now][(i + 1) % count];
        const double part = 0.5 * ((u[0] - mid[0]) * (v[1] - mid[1]) - (u[1] - mid[1]) * (v[0] - mid[0]));
        if (!(part > 1e-14 * size)) continue;
        for (int q = 0; q < 7; ++q) {
            const double px = bary[q][0] * mid[0] + bary[q][1] * u[0] + bary[q][2] * v[0];
            const double py = bary[q][0] * mid[1] + bary[q][1] * u[1] + bary[q][2] * v[1];
            const double w = part * bary[q][3];
            double ns[4], nm[4];
            if (!invert(ps, px, py, ns) || !invert(pm, px, py, nm)) continue;
            area += w;
            for (int k = 0; k < 3; ++k)
                for (int j = 0; j < 4; ++j) gap += w * n[k] * (nm[j] * xm[j][k] - ns[j] * xs[j][k]);
            for (int s = 0; s < 4; ++s)
                for (int j = 0; j < 4; ++j) {
                    out[4 * s + j] += w * ns[s] * ns[j];
                    out[16 + 4 * s + j] += w * ns[s] * nm[j];
                }
        }
    }
    if (!(area > 0)) return;
    // what turns away, or lies far off, fades: a pair that comes or goes at once would make gaps jump
    auto fade = [](double t) { return t <= 0 ? 0.0 : t >= 1 ? 1.0 : t * t * (3 - 2 * t); };
    gap /= area;
    const double weight = fade((facing - cosine) / turn) * fade(2 - 2 * fabs(gap) / reach);
    for (int i = 0; i < 32; ++i) out[i] *= weight;
    out[32] = area * weight;
"""
)
def integrate_pair(
    pair: int,
    pairs: wp.array(dtype=wp.int32),
    slave: wp.array(dtype=wp.int32),
    master: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.float64),
    facing: wp.float64,
    turn: wp.float64,
    reach: wp.float64,
    integrals: wp.array(dtype=wp.float64),
): ...


@wp.kernel
def integrate(
    first: int,
    pairs: wp.array(dtype=wp.int32),
    slave: wp.array(dtype=wp.int32),
    master: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.float64),
    facing: wp.float64,
    turn: wp.float64,
    reach: wp.float64,
    # out
    integrals: wp.array(dtype=wp.float64),
):
    """∫ N_a N_b and ∫ N_a M_b of each pair, (4 × 4) each, then the area; the area is zero where they do not face."""
    integrate_pair(first + wp.tid(), pairs, slave, master, x, facing, turn, reach, integrals)
