"""Coarse operator Pᵀ K P of a block matrix, where P has one scalar weight for the three components of a node.

Row by row into a known pattern (see ``fem_pattern``): a marker with one integer per coarse node holds the index of its
block in the current row. Each range of rows has its own marker, so ranges may be processed in parallel; the order of
summation does not depend on the ranges.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)


@wp.struct
class Blocks:
    """Rows of 3×3 blocks: start of each row, ascending columns, nine values per block."""

    rows: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    values: wp.array(dtype=wp.float64)


@wp.struct
class Weights:
    """Rows of scalar weights."""

    rows: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)
    weights: wp.array(dtype=wp.float64)


@wp.func_native(
    """
    int* place = marker.data + size_t(range) * marker.shape[1];
    for (int row = ranges.data[range]; row < ranges.data[range + 1]; ++row) {
        const int begin = coarse.rows.data[row], end = coarse.rows.data[row + 1];
        for (int m = begin; m < end; ++m) place[coarse.columns.data[m]] = m;
        for (int k = down.rows.data[row]; k < down.rows.data[row + 1]; ++k) {
            const int node = down.columns.data[k];
            const double outer = down.weights.data[k];
            const double* keep_row = mask.data + 3 * node;
            for (int m = fine.rows.data[node]; m < fine.rows.data[node + 1]; ++m) {
                const int other = fine.columns.data[m];
                const double* v = fine.values.data + 9 * size_t(m);
                const double* keep = mask.data + 3 * other;
                double block[9];
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j) block[3 * i + j] = outer * keep_row[i] * keep[j] * v[3 * i + j];
                for (int n = up.rows.data[other]; n < up.rows.data[other + 1]; ++n) {
                    const double w = up.weights.data[n];
                    double* out = coarse.values.data + 9 * size_t(place[up.columns.data[n]]);
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
    fine: Blocks,
    mask: wp.array(dtype=wp.float64),
    up: Weights,
    down: Weights,
    marker: wp.array2d(dtype=wp.int32),
    coarse: Blocks,
): ...


@wp.kernel
def coarse_values(
    # ranges of coarse rows
    first: int,
    ranges: wp.array(dtype=wp.int32),
    # fine matrix, its free degrees of freedom (1 free, 0 prescribed), P and its transpose
    fine: Blocks,
    mask: wp.array(dtype=wp.float64),
    up: Weights,
    down: Weights,
    # scratch
    marker: wp.array2d(dtype=wp.int32),
    # out: its pattern is known, its values are zero before
    coarse_out: Blocks,
):
    """Blocks of Pᵀ M K M P, M the mask."""
    coarse_sums(first + wp.tid(), ranges, fine, mask, up, down, marker, coarse_out)
