"""Multifrontal Cholesky factorisation of sparse matrices of 3×3 blocks (Duff & Reid 1983), and solves.

Nodes are eliminated in a fill-reducing order; consecutive ones with similar columns form a *front*. A front is a dense
lower triangle of its own columns and of all rows that they touch: entries of the matrix and the update matrices of its
children are summed up; its own columns are factorised, and the update matrix of the rest is passed to its parent. The
order of summation is fixed, so that the result does not depend on the distribution of fronts over threads.

Panels are stored by columns of ``stride`` values each (a front's rows, rounded up to a multiple of eight). Of update
matrices only the lower triangle is valid.
"""

import warp as wp

from warpjld_kernels.lanes import EIGHT, VECTORISED

wp.set_module_options(VECTORISED)


@wp.struct
class Fronts:
    """F fronts in postorder.

    ``first`` holds their first columns, shape (F + 1,); ``rows[starts[f] … starts[f + 1]]`` all rows of front f, own
    columns first, as positions in the elimination order; ``children[child[f] … child[f + 1]]`` its children.
    ``panel`` and ``left`` are the offsets of panels and update matrices. The fronts ``todo[parts[p] … parts[p + 1]]``
    are processed in sequence, different p in parallel.
    """

    first: wp.array(dtype=wp.int32)
    starts: wp.array(dtype=wp.int32)
    rows: wp.array(dtype=wp.int32)
    child: wp.array(dtype=wp.int32)
    children: wp.array(dtype=wp.int32)
    panel: wp.array(dtype=wp.int64)
    left: wp.array(dtype=wp.int64)
    todo: wp.array(dtype=wp.int32)
    parts: wp.array(dtype=wp.int32)


@wp.struct
class Blocks:
    """The matrix; nodes in elimination order, position of each node in it or -1; 1 for free, 0 for prescribed ones."""

    rows: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    values: wp.array(dtype=wp.float64)
    order: wp.array(dtype=wp.int32)
    place: wp.array(dtype=wp.int32)
    free: wp.array(dtype=wp.float64)


@wp.func_native(
    """
    int* at = number.data + size_t(part) * k.place.shape[0];
    for (int n = fronts.parts.data[part]; n < fronts.parts.data[part + 1]; ++n) {
        const int f = fronts.todo.data[n];
        const int* row = fronts.rows.data + fronts.starts.data[f];
        const int own = fronts.first.data[f + 1] - fronts.first.data[f];
        const int all = fronts.starts.data[f + 1] - fronts.starts.data[f];
        for (int i = 0; i < all; ++i) at[row[i]] = i;
        for (int j = 0; j < own; ++j) {
            const int node = k.order.data[row[j]];
            for (int e = k.rows.data[node]; e < k.rows.data[node + 1]; ++e) {
                const int there = k.place.data[k.columns.data[e]];
                if (there >= row[j] && at[there] < 0) {
                    failed.data[part] = -1;
                    return;
                }
            }
        }
        for (int i = 0; i < all; ++i) at[row[i]] = -1;
    }
"""
)
def look_for_room(
    part: int,
    fronts: Fronts,
    k: Blocks,
    number: wp.array(dtype=wp.int32),
    failed: wp.array(dtype=wp.int32),
): ...


@wp.kernel
def has_room(
    first: int,
    fronts: Fronts,
    matrix: Blocks,
    # scratch
    number: wp.array(dtype=wp.int32),
    # out
    failed: wp.array(dtype=wp.int32),
):
    """Set ``failed`` to -1 if the matrix has entries outside the fronts of a range."""
    look_for_room(first + wp.tid(), fronts, matrix, number, failed)


@wp.func_native(
    EIGHT
    + """
    // C −= A Bᵀ, by columns: c (m × n), a (m × depth), b (n × depth), m a multiple of 8, n of 3; of column j of c what
    // is not above row top + j
    auto tile = [](auto high, auto wide, double* c, size_t sc, const double* a, const double* b, size_t s, int depth) {
        constexpr int H = sizeof(*high), W = sizeof(*wide);
        Eight sum[W][H];
        for (int j = 0; j < W; ++j)
            for (int h = 0; h < H; ++h) sum[j][h] = (Eight)(0.0);
        for (int k = 0; k < depth; ++k, a += s, b += s) {
            Eight along[H];
            for (int h = 0; h < H; ++h) along[h] = *(const Loose*)(a + 8 * h);
            for (int j = 0; j < W; ++j)
                for (int h = 0; h < H; ++h) sum[j][h] += along[h] * b[j];
        }
        for (int j = 0; j < W; ++j)
            for (int h = 0; h < H; ++h) *(Loose*)(c + j * sc + 8 * h) -= sum[j][h];
    };
#ifdef __AVX512F__
    constexpr int TALL = 16;
#else
    constexpr int TALL = 8;  // what 16 registers of 4 numbers hold
#endif
    auto subtract = [&tile](double* c, size_t sc, const double* a, const double* b, size_t s, int top, int m, int n,
                            int depth) {
        for (int j = 0; j < n;) {
            const int wide = n - j >= 6 ? 6 : 3;
            for (int i = (top + j) / 8 * 8; i < m; i += i + TALL <= m ? TALL : 8) {
                double* to = c + j * sc + i;
                if (TALL > 8 && i + TALL <= m) {
                    if (wide == 6) tile((char(*)[2])0, (char(*)[6])0, to, sc, a + i, b + j, s, depth);
                    else tile((char(*)[2])0, (char(*)[3])0, to, sc, a + i, b + j, s, depth);
                } else {
                    if (wide == 6) tile((char(*)[1])0, (char(*)[6])0, to, sc, a + i, b + j, s, depth);
                    else tile((char(*)[1])0, (char(*)[3])0, to, sc, a + i, b + j, s, depth);
                }
            }
            j += wide;
        }
    };
    constexpr int BLOCK = 24;
    int* at = number.data + size_t(part) * k.place.shape[0];
    for (int n = fronts.parts.data[part]; n < fronts.parts.data[part + 1]; ++n) {
        const int f = fronts.todo.data[n];
        const int* row = fronts.rows.data + fronts.starts.data[f];
        const int own = fronts.first.data[f + 1] - fronts.first.data[f];
        const int all = fronts.starts.data[f + 1] - fronts.starts.data[f], below = all - own;
        const int m = (3 * all + 7) / 8 * 8, w = 3 * own, r = (3 * below + 7) / 8 * 8;
        double* panel = factor.data + fronts.panel.data[f];
        double* rest = work.data + fronts.left.data[f];
        for (size_t i = 0; i < size_t(m) * w; ++i) panel[i] = 0;
        for (size_t i = 0; i < size_t(r) * 3 * below; ++i) rest[i] = 0;
        for (int i = 0; i < all; ++i) at[row[i]] = i;
        // of the matrix
        for (int j = 0; j < own; ++j) {
            const int here = row[j], node = k.order.data[here];
            const double* mine = k.free.data + 3 * node;
            for (int e = k.rows.data[node]; e < k.rows.data[node + 1]; ++e) {
                const int other = k.columns.data[e], there = k.place.data[other];
                if (there < here) continue;
                const int i = at[there];
                const double* v = k.values.data + 9 * size_t(e);
                const double* its = k.free.data + 3 * other;
                for (int p = 0; p < 3; ++p)
                    for (int q = 0; q < 3; ++q)
                        panel[size_t(3 * j + p) * m + 3 * i + q] += v[3 * p + q] * mine[p] * its[q];
            }
            for (int p = 0; p < 3; ++p)
                if (mine[p] == 0) panel[size_t(3 * j + p) * m + 3 * j + p] = 1;
        }
        // of the fronts below
        for (int b = fronts.child.data[f]; b < fronts.child.data[f + 1]; ++b) {
            const int c = fronts.children.data[b];
            const int* its = fronts.rows.data + fronts.starts.data[c + 1];
            const int skip = fronts.first.data[c + 1] - fronts.first.data[c];
            const int count = fronts.starts.data[c + 1] - fronts.starts.data[c] - skip;
            its -= count;
            const int from = (3 * count + 7) / 8 * 8;
            const double* given = work.data + fronts.left.data[c];
            for (int j = 0; j < count; ++j) {
                const int to = at[its[j]];
                double* target = to < own ? panel + size_t(3 * to) * m : rest + size_t(3 * (to - own)) * r - 3 * own;
                const size_t s = to < own ? m : r;
                for (int p = 0; p < 3; ++p) {
                    const double* source = given + size_t(3 * j + p) * from;
                    for (int i = j; i < count; ++i) {
                        double* entry = target + p * s + 3 * at[its[i]];
                        for (int q = 0; q < 3; ++q) entry[q] += source[3 * i + q];
                    }
                }
            }
        }
        for (int i = 0; i < all; ++i) at[row[i]] = -1;
        // its own columns
        for (int start = 0; start < w; start += BLOCK) {
            const int end = start + BLOCK < w ? start + BLOCK : w;
            for (int j = start; j < end; ++j) {
                double* column = panel + size_t(j) * m;
                const double pivot = column[j];
                if (!(pivot > 0)) {
                    failed.data[part] = 1 + k.order.data[row[j / 3]];
                    return;
                }
                const double inverse = 1 / sqrt(pivot);
                for (int i = j; i < m; ++i) column[i] *= inverse;
                for (int l = j + 1; l < end; ++l) {
                    double* other = panel + size_t(l) * m;
                    const double by = column[l];
                    for (int i = l; i < m; ++i) other[i] -= by * column[i];
                }
            }
            const double* done = panel + size_t(start) * m;
            subtract(panel + size_t(end) * m, m, done, done + end, m, end, m, w - end, end - start);
        }
        // what is left over; its rows are rounded up: what lies beyond the last is never read
        subtract(rest, r, panel + w, panel + w, m, 0, r, 3 * below, w);
    }
"""
)
def factorise_part(
    part: int,
    fronts: Fronts,
    k: Blocks,
    number: wp.array(dtype=wp.int32),
    work: wp.array(dtype=wp.float64),
    factor: wp.array(dtype=wp.float64),
    failed: wp.array(dtype=wp.int32),
): ...


@wp.kernel
def factorise(
    first: int,
    fronts: Fronts,
    matrix: Blocks,
    # scratch
    number: wp.array(dtype=wp.int32),
    work: wp.array(dtype=wp.float64),
    # out
    factor: wp.array(dtype=wp.float64),
    failed: wp.array(dtype=wp.int32),
):
    """Panels of a range of fronts; ``failed`` is a node's index plus one if its pivot is not positive."""
    factorise_part(first + wp.tid(), fronts, matrix, number, work, factor, failed)


@wp.func_native(
    EIGHT
    + """
    const int count = fronts.todo.shape[0];
    double* y = scratch.data;
    for (int n = 0; n < count; ++n) {
        const int f = fronts.todo.data[n];
        const int* row = fronts.rows.data + fronts.starts.data[f];
        const int own = fronts.first.data[f + 1] - fronts.first.data[f];
        const int all = fronts.starts.data[f + 1] - fronts.starts.data[f];
        const int m = (3 * all + 7) / 8 * 8, w = 3 * own;
        const double* panel = factor.data + fronts.panel.data[f];
        for (int i = 0; i < all; ++i)
            for (int p = 0; p < 3; ++p) y[3 * i + p] = x.data[3 * row[i] + p];
        for (int i = 3 * all; i < m; ++i) y[i] = 0;
        for (int j = 0; j < w; j += 3) {
            const double* c = panel + size_t(j) * m;
            const double y0 = y[j] / c[j];
            const double y1 = (y[j + 1] - c[j + 1] * y0) / c[m + j + 1];
            const double y2 = (y[j + 2] - c[j + 2] * y0 - c[m + j + 2] * y1) / c[2 * m + j + 2];
            y[j] = y0;
            y[j + 1] = y1;
            y[j + 2] = y2;
            for (int i = j + 3; i < m; ++i) y[i] -= c[i] * y0 + c[m + i] * y1 + c[2 * m + i] * y2;
        }
        for (int i = 0; i < all; ++i)
            for (int p = 0; p < 3; ++p) x.data[3 * row[i] + p] = y[3 * i + p];
    }
    for (int n = count - 1; n >= 0; --n) {
        const int f = fronts.todo.data[n];
        const int* row = fronts.rows.data + fronts.starts.data[f];
        const int own = fronts.first.data[f + 1] - fronts.first.data[f];
        const int all = fronts.starts.data[f + 1] - fronts.starts.data[f];
        const int m = (3 * all + 7) / 8 * 8, w = 3 * own;
        const double* panel = factor.data + fronts.panel.data[f];
        for (int i = 0; i < all; ++i)
            for (int p = 0; p < 3; ++p) y[3 * i + p] = x.data[3 * row[i] + p];
        for (int i = 3 * all; i < m; ++i) y[i] = 0;
        for (int j = w - 3; j >= 0; j -= 3) {
            const double* c = panel + size_t(j) * m;
            Eight sums[3] = {(Eight)(0.0), (Eight)(0.0), (Eight)(0.0)};
            double s[3] = {0, 0, 0};
            int i = j + 3;
            for (; i % 8; ++i)
                for (int p = 0; p < 3; ++p) s[p] += c[p * m + i] * y[i];
            for (; i < m; i += 8)
                for (int p = 0; p < 3; ++p) sums[p] += *(const Loose*)(c + p * m + i) * *(const Loose*)(y + i);
            for (int p = 0; p < 3; ++p)
                for (int l = 0; l < 8; ++l) s[p] += sums[p][l];
            const double y2 = (y[j + 2] - s[2]) / c[2 * m + j + 2];
            const double y1 = (y[j + 1] - s[1] - c[m + j + 2] * y2) / c[m + j + 1];
            y[j + 2] = y2;
            y[j + 1] = y1;
            y[j] = (y[j] - s[0] - c[j + 1] * y1 - c[j + 2] * y2) / c[j];
        }
        for (int i = 0; i < own; ++i)
            for (int p = 0; p < 3; ++p) x.data[3 * row[i] + p] = y[3 * i + p];
    }
"""
)
def solve_all(
    fronts: Fronts,
    factor: wp.array(dtype=wp.float64),
    scratch: wp.array(dtype=wp.float64),
    x: wp.array(dtype=wp.float64),
): ...


@wp.kernel
def solve(
    first: int,
    fronts: Fronts,
    factor: wp.array(dtype=wp.float64),
    # scratch
    scratch: wp.array(dtype=wp.float64),
    # in and out
    x: wp.array(dtype=wp.float64),
):
    """x ← (L Lᵀ)⁻¹ x in elimination order, as a launch of one row.

    Of the fronts ``todo`` only, ascending, each with all fronts above it: x has to be 0 in the rows of the others, and
    is not computed there.
    """
    solve_all(fronts, factor, scratch, x)
