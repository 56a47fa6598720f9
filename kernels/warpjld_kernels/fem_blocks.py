"""Products with sparse matrices of 3×3 blocks, and Chebyshev smoothing.

One function per row, in portable C++: on the CPU the first eight of a block's nine entries are one vector register, so
that memory bandwidth limits the product; on a GPU a row is nine scalar multiply-adds per block.
Vectors have at least one spare value at the end, since three values are loaded as four.
"""

from typing import Any

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)

_ROW = """
    const int begin = rows.data[row], end = rows.data[row + 1];
    const REAL* v = values.data + 9 * size_t(begin);
    const int* c = columns.data + begin;
#if defined(__CUDA_ARCH__)
    REAL s0 = 0, s1 = 0, s2 = 0;
    for (int k = begin; k < end; ++k, v += 9, ++c) {
        const REAL* p = x.data + 3 * *c;
        s0 += v[0] * p[0] + v[1] * p[1] + v[2] * p[2];
        s1 += v[3] * p[0] + v[4] * p[1] + v[5] * p[2];
        s2 += v[6] * p[0] + v[7] * p[1] + v[8] * p[2];
    }
    return {s0, s1, s2};
#else
    typedef REAL V4 __attribute__((ext_vector_type(4), aligned(sizeof(REAL))));
    typedef REAL V8 __attribute__((ext_vector_type(8), aligned(sizeof(REAL))));
    V8 eight = 0;
    REAL ninth = 0;
    for (int k = begin; k < end; ++k, v += 9, ++c) {
        const V4 p = *(const V4*)(x.data + 3 * *c);
        eight += *(const V8*)v * __builtin_shufflevector(p, p, 0, 1, 2, 0, 1, 2, 0, 1);
        ninth += v[8] * p[2];
    }
    return {eight[0] + eight[1] + eight[2], eight[3] + eight[4] + eight[5], eight[6] + eight[7] + ninth};
#endif
"""


@wp.func_native(_ROW.replace("REAL", "float"))
def row_product(
    row: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.float32),
    x: wp.array(dtype=wp.float32),
) -> wp.vec3f: ...


@wp.func_native(_ROW.replace("REAL", "double"))
def row_product(  # noqa: F811
    row: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    values: wp.array(dtype=wp.float64),
    x: wp.array(dtype=wp.float64),
) -> wp.vec3d: ...


@wp.func
def values_at(node: int, x: wp.array(dtype=Any)):
    """The three components at a node."""
    return wp.vector(x[3 * node], x[3 * node + 1], x[3 * node + 2])


@wp.func
def set_values(node: int, s: Any, x_out: wp.array(dtype=Any)):
    x_out[3 * node] = s[0]
    x_out[3 * node + 1] = s[1]
    x_out[3 * node + 2] = s[2]


@wp.func
def scaled(node: int, i: int, inverse: wp.array(dtype=Any), r: Any):
    """Component i of D⁻¹ r at a node; ``inverse`` holds the inverted diagonal blocks."""
    at = 9 * node + 3 * i
    return inverse[at] * r[0] + inverse[at + 1] * r[1] + inverse[at + 2] * r[2]


@wp.kernel
def product(
    # matrix
    first: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    values: wp.array(dtype=Any),
    # vector
    x: wp.array(dtype=Any),
    # out
    y_out: wp.array(dtype=Any),
):
    """y = A x over rows from ``first`` on."""
    row = first + wp.tid()
    set_values(row, row_product(row, rows, columns, values, x), y_out)


@wp.kernel
def residual(
    # matrix
    first: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    values: wp.array(dtype=Any),
    # vectors
    b: wp.array(dtype=Any),
    x: wp.array(dtype=Any),
    # out
    r_out: wp.array(dtype=Any),
):
    """r = b − A x over rows from ``first`` on."""
    row = first + wp.tid()
    set_values(row, values_at(row, b) - row_product(row, rows, columns, values, x), r_out)


@wp.kernel
def first_step(
    # smoother
    first: int,
    inverse: wp.array(dtype=Any),
    scale: Any,
    # vectors
    b: wp.array(dtype=Any),
    # out
    step_out: wp.array(dtype=Any),
    x_out: wp.array(dtype=Any),
):
    """The smoother's first step from x = 0: x = step = scale · D⁻¹ b."""
    row = first + wp.tid()
    r = values_at(row, b)
    for i in range(3):
        moved = scale * scaled(row, i, inverse, r)
        step_out[3 * row + i] = moved
        x_out[3 * row + i] = moved


@wp.kernel
def chebyshev_step(
    # matrix
    first: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    values: wp.array(dtype=Any),
    inverse: wp.array(dtype=Any),
    # coefficients
    momentum: Any,
    scale: Any,
    # vectors
    b: wp.array(dtype=Any),
    x: wp.array(dtype=Any),
    # in and out
    step: wp.array(dtype=Any),
    # out
    x_out: wp.array(dtype=Any),
):
    """step = momentum · step + scale · D⁻¹ (b − A x), x' = x + step."""
    row = first + wp.tid()
    r = values_at(row, b) - row_product(row, rows, columns, values, x)
    for i in range(3):
        moved = momentum * step[3 * row + i] + scale * scaled(row, i, inverse, r)
        step[3 * row + i] = moved
        x_out[3 * row + i] = x[3 * row + i] + moved


@wp.kernel
def interpolate(
    # weights
    first: int,
    rows: wp.array(dtype=wp.int32),
    columns: wp.array(dtype=wp.int32),
    weights: wp.array(dtype=Any),
    add: wp.bool,
    # vector
    x: wp.array(dtype=Any),
    # out
    y_out: wp.array(dtype=Any),
):
    """y = W x or y + W x, one scalar weight for the three components of a node: prolongation, or restriction by Wᵀ."""
    row = first + wp.tid()
    zero = weights.dtype(0.0)
    s = wp.vector(zero, zero, zero)
    for k in range(rows[row], rows[row + 1]):
        s += weights[k] * values_at(columns[k], x)
    if add:
        s += values_at(row, y_out)
    set_values(row, s, y_out)


# both precisions in one module, which is compiled once
for _real in (wp.float32, wp.float64):
    _values = wp.array(dtype=_real)
    _table = {"values": _values}
    wp.overload(product, {**_table, "x": _values, "y_out": _values})
    wp.overload(residual, {**_table, "b": _values, "x": _values, "r_out": _values})
    _smoother = {"inverse": _values, "scale": _real, "b": _values}
    wp.overload(first_step, {**_smoother, "step_out": _values, "x_out": _values})
    _moving = {"momentum": _real, "x": _values, "step": _values, "x_out": _values}
    wp.overload(chebyshev_step, {**_table, **_smoother, **_moving})
    wp.overload(interpolate, {"weights": _values, "x": _values, "y_out": _values})
