"""Mortar integrals of pairs of facets that face each other, and their derivatives.

Each pair of a slave and a master quadrilateral is projected onto the slave's plane, clipped (Sutherland–Hodgman) and
integrated over the common polygon, triangle by triangle with 7-point quadrature. The same C++ code is used with plain
numbers, and with dual numbers for derivatives.
"""

import warp as wp

from warpjld_kernels.lanes import EIGHT, VECTORISED

wp.set_module_options(VECTORISED)


_DOUBLE = """
    typedef double Real;
    auto value = [](double x) { return x; };
    auto root = [](double x) { return sqrt(x); };
    auto seed = [](double x, int) { return x; };
"""
"""Arithmetic of plain numbers."""

_DUAL = (
    EIGHT
    + """
    // a number and its derivatives by the 24 coordinates of the corners
    struct Real {
        double v;
        Eight d[3];
        Real() : v(0) { for (int k = 0; k < 3; ++k) d[k] = (Eight)(0.0); }
        Real(double x) : v(x) { for (int k = 0; k < 3; ++k) d[k] = (Eight)(0.0); }
        Real mixed(double at, const Real& o, double by, double with) const {
            Real r(at);
            for (int k = 0; k < 3; ++k) r.d[k] = d[k] * by + o.d[k] * with;
            return r;
        }
        Real scaled(double at, double by) const {
            Real r(at);
            for (int k = 0; k < 3; ++k) r.d[k] = d[k] * by;
            return r;
        }
        Real operator+(const Real& o) const { return mixed(v + o.v, o, 1, 1); }
        Real operator-(const Real& o) const { return mixed(v - o.v, o, 1, -1); }
        Real operator*(const Real& o) const { return mixed(v * o.v, o, o.v, v); }
        Real operator/(const Real& o) const { return mixed(v / o.v, o, 1 / o.v, -v / (o.v * o.v)); }
        Real operator+(double o) const { return scaled(v + o, 1); }
        Real operator*(double o) const { return scaled(v * o, o); }
        Real operator/(double o) const { return scaled(v / o, 1 / o); }
        void operator+=(const Real& o) { *this = *this + o; }
        void operator-=(const Real& o) { *this = *this - o; }
    };
    auto value = [](const Real& x) { return x.v; };
    auto root = [](const Real& x) { return x.scaled(sqrt(x.v), 0.5 / sqrt(x.v)); };
    auto seed = [](double x, int k) {
        Real r(x);
        r.d[k / 8][k % 8] = 1;
        return r;
    };
"""
)
"""Arithmetic of dual numbers: a value with its derivatives by 24 coordinates (forward-mode differentiation)."""

_PAIR = """
    auto shape = [](const Real& s, const Real& t, Real* n) {
        const Real a = s * -1.0 + 1.0, b = s + 1.0, c = t * -1.0 + 1.0, d = t + 1.0;
        n[0] = a * 0.25 * c;
        n[1] = b * 0.25 * c;
        n[2] = b * 0.25 * d;
        n[3] = a * 0.25 * d;
    };
    // shape functions of a plane quadrilateral at a point in it
    auto invert = [&](const Real (*p)[2], const Real& x, const Real& y, Real* out) {
        double s = 0, t = 0, n[4], a = 0, b = 0, c = 0, d = 0, det = 0;
        auto residual = [&](int k) {
            double r = -value(k ? y : x);
            for (int i = 0; i < 4; ++i) r += n[i] * value(p[i][k]);
            return r;
        };
        for (int k = 0; k < 20; ++k) {
            n[0] = 0.25 * (1 - s) * (1 - t);
            n[1] = 0.25 * (1 + s) * (1 - t);
            n[2] = 0.25 * (1 + s) * (1 + t);
            n[3] = 0.25 * (1 - s) * (1 + t);
            const double rx = residual(0), ry = residual(1);
            const double ds[4] = {-0.25 * (1 - t), 0.25 * (1 - t), 0.25 * (1 + t), -0.25 * (1 + t)};
            const double dt[4] = {-0.25 * (1 - s), -0.25 * (1 + s), 0.25 * (1 + s), 0.25 * (1 - s)};
            a = b = c = d = 0;
            for (int i = 0; i < 4; ++i) {
                a += ds[i] * value(p[i][0]);
                b += dt[i] * value(p[i][0]);
                c += ds[i] * value(p[i][1]);
                d += dt[i] * value(p[i][1]);
            }
            det = a * d - b * c;
            if (det == 0) return false;
            const double u = (d * rx - b * ry) / det, v = (a * ry - c * rx) / det;
            s -= u;
            t -= v;
            s = s < -1.5 ? -1.5 : s > 1.5 ? 1.5 : s;
            t = t < -1.5 ? -1.5 : t > 1.5 ? 1.5 : t;
            if (u * u + v * v < 1e-26) break;
        }
        Real where[2] = {Real(s), Real(t)};
        followed(p, x, y, n, a, b, c, d, det, where);
        for (int k = 0; k < 2; ++k) {
            if (value(where[k]) < -1) where[k] = Real(-1.0);
            if (value(where[k]) > 1) where[k] = Real(1.0);
        }
        shape(where[0], where[1], out);
        return true;
    };
    const int* sc = slave.data + 4 * pairs.data[2 * pair];
    const int* mc = master.data + 4 * pairs.data[2 * pair + 1];
    Real out[33], xs[4][3], xm[4][3], c[3];
    for (int i = 0; i < 33; ++i) out[i] = Real(0.0);
    for (int k = 0; k < 3; ++k) c[k] = Real(0.0);
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 3; ++k) {
            xs[i][k] = seed(x.data[3 * sc[i] + k], 3 * i + k);
            xm[i][k] = seed(x.data[3 * mc[i] + k], 12 + 3 * i + k);
            c[k] += xs[i][k] * 0.25;
        }
    Real a[3], b[3], n[3], g[3], h[3], m[3];
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
    const Real size = root(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const Real other = root(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    if (!(value(size) > 0) || !(value(other) > 0)) return;
    for (int k = 0; k < 3; ++k) n[k] = n[k] / size;
    const Real cosine = (n[0] * m[0] + n[1] * m[1] + n[2] * m[2]) / other;
    if (!(value(cosine) < facing)) return;
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};  // heights of the corners above the slave's plane
    for (int i = 0; i < 8; ++i) {
        double height = 0;
        for (int k = 0; k < 3; ++k) height += value(n[k]) * (value(i < 4 ? xs[i][k] : xm[i - 4][k]) - value(c[k]));
        low[i / 4] = height < low[i / 4] ? height : low[i / 4];
        high[i / 4] = height > high[i / 4] ? height : high[i / 4];
    }
    if (low[1] - high[0] >= reach || high[1] - low[0] <= -reach) return;  // then its weight is 0
    const Real along = root(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    Real e[3], f[3];
    for (int k = 0; k < 3; ++k) e[k] = a[k] / along;
    for (int k = 0; k < 3; ++k) f[k] = n[(k + 1) % 3] * e[(k + 2) % 3] - n[(k + 2) % 3] * e[(k + 1) % 3];

    Real ps[4][2], pm[4][2];
    for (int i = 0; i < 4; ++i) {
        ps[i][0] = ps[i][1] = pm[i][0] = pm[i][1] = Real(0.0);
        for (int k = 0; k < 3; ++k) {
            ps[i][0] += (xs[i][k] - c[k]) * e[k];
            ps[i][1] += (xs[i][k] - c[k]) * f[k];
            pm[i][0] += (xm[i][k] - c[k]) * e[k];
            pm[i][1] += (xm[i][k] - c[k]) * f[k];
        }
    }
    Real poly[2][12][2];
    int count = 4, now = 0;
    for (int i = 0; i < 4; ++i) {
        poly[0][i][0] = ps[i][0];
        poly[0][i][1] = ps[i][1];
    }
    for (int edge = 0; edge < 4 && count > 2; ++edge) {  // the master is seen from behind: clockwise
        const Real* p = pm[(4 - edge) % 4];
        const Real* q = pm[3 - edge];
        const Real ex = q[0] - p[0], ey = q[1] - p[1];
        if (value(ex) * value(ex) + value(ey) * value(ey) <= 1e-28 * value(size)) continue;
        int kept = 0;
        for (int i = 0; i < count; ++i) {
            const Real* u = poly[now][i];
            const Real* v = poly[now][(i + 1) % count];
            const Real du = ex * (u[1] - p[1]) - ey * (u[0] - p[0]);
            const Real dv = ex * (v[1] - p[1]) - ey * (v[0] - p[0]);
            const double one = value(du), two = value(dv);
            if (one >= 0) {
                poly[1 - now][kept][0] = u[0];
                poly[1 - now][kept++][1] = u[1];
            }
            if ((one > 0 && two < 0) || (one < 0 && two > 0)) {
                const Real r = du / (du - dv);
                poly[1 - now][kept][0] = u[0] + r * (v[0] - u[0]);
                poly[1 - now][kept++][1] = u[1] + r * (v[1] - u[1]);
            }
            if (kept > 10) break;
        }
        now = 1 - now;
        count = kept;
    }
    if (count < 3) return;
    Real mid[2] = {Real(0.0), Real(0.0)};
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
    Real area = Real(0.0), gap = Real(0.0);
    for (int i = 0; i < count; ++i) {
        const Real* u = poly[now][i];
        const Real* v = poly[now][(i + 1) % count];
        const Real part = ((u[0] - mid[0]) * (v[1] - mid[1]) - (u[1] - mid[1]) * (v[0] - mid[0])) * 0.5;
        if (!(value(part) > 1e-14 * value(size))) continue;
        for (int q = 0; q < 7; ++q) {
            const Real px = mid[0] * bary[q][0] + u[0] * bary[q][1] + v[0] * bary[q][2];
            const Real py = mid[1] * bary[q][0] + u[1] * bary[q][1] + v[1] * bary[q][2];
            const Real w = part * bary[q][3];
            Real ns[4], nm[4];
            if (!invert(ps, px, py, ns) || !invert(pm, px, py, nm)) continue;
            area += w;
            for (int k = 0; k < 3; ++k)
                for (int j = 0; j < 4; ++j) gap += w * n[k] * (nm[j] * xm[j][k] - ns[j] * xs[j][k]);
            for (int s = 0; s < 4; ++s) {
                const Real mine = w * ns[s];
                for (int j = 0; j < 4; ++j) {
                    out[4 * s + j] += mine * ns[j];
                    out[16 + 4 * s + j] += mine * nm[j];
                }
            }
        }
    }
    if (!(value(area) > 0)) return;
    // what turns away, or lies far off, fades: a pair that comes or goes at once would make gaps jump
    auto fade = [&](const Real& t) {
        return value(t) <= 0 ? Real(0.0) : value(t) >= 1 ? Real(1.0) : t * t * (t * -2.0 + 3.0);
    };
    gap = gap / area;
    const Real apart = value(gap) < 0 ? gap * -1.0 : gap;
    const Real weight = fade((cosine * -1.0 + facing) / turn) * fade(apart * -2.0 / reach + 2.0);
    for (int i = 0; i < 32; ++i) out[i] = out[i] * weight;
    out[32] = area * weight;
"""
"""Integrals of a pair with either kind of number. ``followed`` sets the derivatives of reference coordinates found by
Newton's method, by implicit differentiation."""

_STILL = """
    auto followed = [](const Real (*)[2], Real, Real, const double*, double, double, double, double, double, Real*) {};
"""
_FOLLOWING = """
    auto followed = [](const Real (*p)[2], const Real& x, const Real& y, const double* n, double a, double b, double c,
                       double d, double det, Real* where) {
        Real rx = x * -1.0, ry = y * -1.0;
        for (int i = 0; i < 4; ++i) {
            rx += p[i][0] * n[i];
            ry += p[i][1] * n[i];
        }
        for (int k = 0; k < 3; ++k) {
            where[0].d[k] = (ry.d[k] * b - rx.d[k] * d) / det;
            where[1].d[k] = (rx.d[k] * c - ry.d[k] * a) / det;
        }
    };
"""


@wp.func_native(
    "double* to = integrals.data + 33 * size_t(pair);\n    for (int i = 0; i < 33; ++i) to[i] = 0;"
    + _DOUBLE
    + _STILL
    + _PAIR
    + "    for (int i = 0; i < 33; ++i) to[i] = out[i];"
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
    """∫ N_a N_b and ∫ N_a M_b of each pair, (4 × 4) each, then the area, which is zero for facets that do not face each
    other; all are faded out with the angle between the facets (``facing``, ``turn``) and with the gap (``reach``)."""
    integrate_pair(first + wp.tid(), pairs, slave, master, x, facing, turn, reach, integrals)


@wp.func_native(
    "double* to = derivatives.data + 24 * 33 * size_t(pair);\n    for (int i = 0; i < 24 * 33; ++i) to[i] = 0;"
    + _DUAL
    + _FOLLOWING
    + _PAIR
    + """
    for (int k = 0; k < 24; ++k)
        for (int i = 0; i < 33; ++i) to[33 * k + i] = out[i].d[k / 8][k % 8];
    """
)
def differentiate_pair(
    pair: int,
    pairs: wp.array(dtype=wp.int32),
    slave: wp.array(dtype=wp.int32),
    master: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.float64),
    facing: wp.float64,
    turn: wp.float64,
    reach: wp.float64,
    derivatives: wp.array(dtype=wp.float64),
): ...


@wp.kernel
def differentiate(
    first: int,
    pairs: wp.array(dtype=wp.int32),
    slave: wp.array(dtype=wp.int32),
    master: wp.array(dtype=wp.int32),
    x: wp.array(dtype=wp.float64),
    facing: wp.float64,
    turn: wp.float64,
    reach: wp.float64,
    # out
    derivatives: wp.array(dtype=wp.float64),
):
    """Derivatives of the results of ``integrate`` by the 24 coordinates of each pair's corners, the slave's first."""
    differentiate_pair(first + wp.tid(), pairs, slave, master, x, facing, turn, reach, derivatives)
