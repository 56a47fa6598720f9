"""Coarse operator Pᵀ K P of a block matrix, P holding one scalar weight for the three values of a node.

Row by row (Gustavson): a marker of one integer a coarse node tells where its block of the current row is. Each range
of rows has its own marker, so ranges may run side by side; sums are in the same order whatever the ranges.
"""

import warp as wp

wp.set_module_options(
    {
        "enable_backward": False,
        "cpu_compiler_flags": "-march=native -ffp-contract=fast -mprefer-vector-width=512",
    }
)


@wp.func_native(
    """
    int* mark = marker.data + size_t(range) * marker.shape[1];
    for (int coarse = ranges.data[range]; coarse < ranges.data[range + 1]; ++coarse) {
        int count = 0;
        int* found = fill ? out_columns.data + out_rows.data[coarse] : mark;
        for (int k = pt_rows.data[coarse]; k < pt_rows.data[coarse + 1]; ++k) {
            const int fine = pt_columns.data[k];
            for (int m = k_rows.data[fine]; m < k_rows.data[fine + 1]; ++m) {
                const int other = k_columns.data[m];
                for (int n = p_rows.data[other]; n < p_rows.data[other + 1]; ++n) {
                    const int column = p_columns.data[n];
                    if (mark[column] == coarse) continue;
                    mark[column] = coarse;
                    if (fill) {
                        int place = count;
                        while (place > 0 && found[place - 1] > column) {
                            found[place] = found[place - 1];
                            --place;
                        }
                        found[place] = column;
                    }
                    ++count;
                }
            }
        }
        if (!fill) out_rows.data[coarse + 1] = count;
    }
"""
)
def coarse_rows(
    range: int,
    ranges: wp.array(dtype=wp.int32),
    fill: wp.bool,
    k_rows: wp.array(dtype=wp.int32),
    k_columns: wp.array(dtype=wp.int32),
    p_rows: wp.array(dtype=wp.int32),
    p_columns: wp.array(dtype=wp.int32),
    pt_rows: wp.array(dtype=wp.int32),
    pt_columns: wp.array(dtype=wp.int32),
    marker: wp.array2d(dtype=wp.int32),
    out_rows: wp.array(dtype=wp.int32),
    out_columns: wp.array(dtype=wp.int32),
): ...


@wp.kernel
def coarse_pattern(
    # ranges of coarse rows
    first: int,
    ranges: wp.array(dtype=wp.int32),
    fill: wp.bool,
    # fine matrix and weights
    k_rows: wp.array(dtype=wp.int32),
    k_columns: wp.array(dtype=wp.int32),
    p_rows: wp.array(dtype=wp.int32),
    p_columns: wp.array(dtype=wp.int32),
    pt_rows: wp.array(dtype=wp.int32),
    pt_columns: wp.array(dtype=wp.int32),
    # scratch
    marker: wp.array2d(dtype=wp.int32),
    # out
    rows_out: wp.array(dtype=wp.int32),
    columns_out: wp.array(dtype=wp.int32),
):
    """Without ``fill``: blocks in each coarse row; with it: their columns, ascending. ``marker`` must hold −1."""
    coarse_rows(
        first + wp.tid(),
        ranges,
        fill,
        k_rows,
        k_columns,
        p_rows,
        p_columns,
        pt_rows,
        pt_columns,
        marker,
        rows_out,
        columns_out,
    )


@wp.func_native(
    """
    int* place = marker.data + size_t(range) * marker.shape[1];
    for (int coarse = ranges.data[range]; coarse < ranges.data[range + 1]; ++coarse) {
        const int begin = c_rows.data[coarse], end = c_rows.data[coarse + 1];
        for (int m = begin; m < end; ++m) place[c_columns.data[m]] = m;
        for (int k = pt_rows.data[coarse]; k < pt_rows.data[coarse + 1]; ++k) {
            const int fine = pt_columns.data[k];
            const double outer = pt_weights.data[k];
            const double* keep_row = mask.data + 3 * fine;
            for (int m = k_rows.data[fine]; m < k_rows.data[fine + 1]; ++m) {
                const int other = k_columns.data[m];
                const double* v = k_values.data + 9 * size_t(m);
                const double* keep = mask.data + 3 * other;
                double block[9];
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j) block[3 * i + j] = outer * keep_row[i] * keep[j] * v[3 * i + j];
                for (int n = p_rows.data[other]; n < p_rows.data[other + 1]; ++n) {
                    const double w = p_weights.data[n];
                    double* out = c_values.data + 9 * size_t(place[p_columns.data[n]]);
                    for (int i = 0; i < 9; ++i) out[i] += w * block[i];
                }
            }
        }
    }
"""
)
def coarse_sums(
    range: int,
    ranges: wp.array(dtype=wp.int32),
    k_rows: wp.array(dtype=wp.int32),
    k_columns: wp.array(dtype=wp.int32),
    k_values: wp.array(dtype=wp.float64),
    mask: wp.array(dtype=wp.float64),
    p_rows: wp.array(dtype=wp.int32),
    p_columns: wp.array(dtype=wp.int32),
    p_weights: wp.array(dtype=wp.float64),
    pt_rows: wp.array(dtype=wp.int32),
    pt_columns: wp.array(dtype=wp.int32),
    pt_weights: wp.array(dtype=wp.float64),
    c_rows: wp.array(dtype=wp.int32),
    c_columns: wp.array(dtype=wp.int32),
    marker: wp.array2d(dtype=wp.int32),
    c_values: wp.array(dtype=wp.float64),
): ...


@wp.kernel
def coarse_values(
    # ranges of coarse rows
    first: int,
    ranges: wp.array(dtype=wp.int32),
    # fine matrix, its free degrees of freedom (1 free, 0 prescribed), weights and their transpose
    k_rows: wp.array(dtype=wp.int32),
    k_columns: wp.array(dtype=wp.int32),
    k_values: wp.array(dtype=wp.float64),
    mask: wp.array(dtype=wp.float64),
    p_rows: wp.array(dtype=wp.int32),
    p_columns: wp.array(dtype=wp.int32),
    p_weights: wp.array(dtype=wp.float64),
    pt_rows: wp.array(dtype=wp.int32),
    pt_columns: wp.array(dtype=wp.int32),
    pt_weights: wp.array(dtype=wp.float64),
    # coarse pattern
    c_rows: wp.array(dtype=wp.int32),
    c_columns: wp.array(dtype=wp.int32),
    # scratch
    marker: wp.array2d(dtype=wp.int32),
    # out, zero before
    values_out: wp.array(dtype=wp.float64),
):
    """Blocks of Pᵀ M K M P, M the mask."""
    coarse_sums(
        first + wp.tid(),
        ranges,
        k_rows,
        k_columns,
        k_values,
        mask,
        p_rows,
        p_columns,
        p_weights,
        pt_rows,
        pt_columns,
        pt_weights,
        c_rows,
        c_columns,
        marker,
        values_out,
    )
