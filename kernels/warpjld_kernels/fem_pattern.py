"""Sparsity patterns: columns of a product of sparse matrices, and the blocks that elements add to.

Row by row (Gustavson): a marker with one integer per column records whether the current row contains it. Each range of
rows has its own marker, so ranges may be processed in parallel.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)


@wp.struct
class Rows:
    """A pattern: start of each row, and column indices."""

    rows: wp.array(dtype=wp.int32)
    columns: wp.array(dtype=wp.int32)


@wp.func_native(
    """
    int* mark = marker.data + size_t(range) * marker.shape[1];
    for (int row = ranges.data[range]; row < ranges.data[range + 1]; ++row) {
        int count = 0;
        int* found = fill ? product.columns.data + product.rows.data[row] : mark;
        for (int k = first.rows.data[row]; k < first.rows.data[row + 1]; ++k) {
            const int node = first.columns.data[k];
            for (int m = second.rows.data[node]; m < second.rows.data[node + 1]; ++m) {
                const int other = second.columns.data[m];
                for (int n = third.rows.data[other]; n < third.rows.data[other + 1]; ++n) {
                    const int column = third.columns.data[n];
                    if (mark[column] == row) continue;
                    mark[column] = row;
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
        if (!fill) product.rows.data[row + 1] = count;
    }
"""
)
def product_rows(
    range: int,
    ranges: wp.array(dtype=wp.int32),
    fill: wp.bool,
    first: Rows,
    second: Rows,
    third: Rows,
    marker: wp.array2d(dtype=wp.int32),
    product: Rows,
): ...


@wp.kernel
def product_pattern(
    # ranges of rows
    begin: int,
    ranges: wp.array(dtype=wp.int32),
    fill: wp.bool,
    # factors
    first: Rows,
    second: Rows,
    third: Rows,
    # scratch
    marker: wp.array2d(dtype=wp.int32),
    # out
    product_out: Rows,
):
    """Without ``fill``: number of columns of each row; with it: the columns, ascending. ``marker`` must be −1."""
    product_rows(begin + wp.tid(), ranges, fill, first, second, third, marker, product_out)


@wp.kernel
def element_slots(
    # mesh
    first: int,
    elements: wp.array2d(dtype=wp.int32),
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    # out
    slots_out: wp.array2d(dtype=wp.int32),
):
    """Index of the matrix block that node pair (a, b) of an element adds to."""
    element = first + wp.tid()
    for a in range(8):
        row = elements[element, a]
        for b in range(8):
            want = elements[element, b]
            low = rows[row]
            high = rows[row + 1] - 1
            while low < high:
                middle = (low + high) // 2
                if columns[middle] < want:
                    low = middle + 1
                else:
                    high = middle
            slots_out[element, 8 * a + b] = low
