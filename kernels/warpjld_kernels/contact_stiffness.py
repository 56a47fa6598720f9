"""Addition of the contact tangent Σ_a c_ai c_aj H_a to a sparse matrix of 3×3 blocks."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)


@wp.kernel
def copy_rows(
    first: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.mat33d),
    wide_rows: wp.array(dtype=wp.int32),
    wide_columns: wp.array(dtype=wp.int32),
    # out
    wide: wp.array(dtype=wp.mat33d),
):
    """Copy the blocks of a matrix into a larger sparsity pattern, zero elsewhere."""
    row = first + wp.tid()
    k = rows[row]
    last = rows[row + 1]
    for place in range(wide_rows[row], wide_rows[row + 1]):
        if k < last and columns[k] == wide_columns[place]:
            wide[place] = values[k]
            k += 1
        else:
            wide[place] = wp.mat33d()


@wp.kernel
def add_rows(
    first: int,
    nodes: wp.array(dtype=wp.int32),
    # weights, and their transpose
    c_rows: wp.array(dtype=wp.int32),
    c_columns: wp.array(dtype=wp.int32),
    c_values: wp.array(dtype=wp.float64),
    t_rows: wp.array(dtype=wp.int32),
    t_columns: wp.array(dtype=wp.int32),
    t_values: wp.array(dtype=wp.float64),
    blocks: wp.array(dtype=wp.mat33d),
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    # out
    values: wp.array(dtype=wp.mat33d),
):
    """Add the contributions of all contact points to the rows of ``nodes``; each row is written by one thread."""
    node = nodes[first + wp.tid()]
    for k in range(t_rows[node], t_rows[node + 1]):
        point = t_columns[k]
        block = t_values[k] * blocks[point]
        for m in range(c_rows[point], c_rows[point + 1]):
            column = c_columns[m]
            low = rows[node]
            high = rows[node + 1] - 1
            while low < high:
                middle = (low + high) // 2
                if columns[middle] < column:
                    low = middle + 1
                else:
                    high = middle
            values[low] += c_values[m] * block
