"""Triangular solves with a sparse factorisation L D Lᵀ for several right-hand sides at once, on the CPU.

The factor does not fit into the caches, so solves are bound by memory bandwidth: each entry, once read, is used for a
vector of adjacent right-hand sides.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

# the same options as the deforming kernels, so that both use one precompiled header, which takes longest to compile
wp.set_module_options(VECTORISED)

TOGETHER = 8
"""Right-hand sides solved together by a thread."""


@wp.func_native(
    f"""
#if !defined(__CUDA_ARCH__)
    typedef double Right __attribute__((ext_vector_type({TOGETHER}), aligned(8)));
    const int count = diagonal.shape[0];
    const int* starts = first.data;
    Right* x = (Right*)(values.data + size_t(block) * count * {TOGETHER});
    for (int time = 0; time < times; ++time) {{
        for (int j = 0; j < count; ++j) x[j] *= before.data[j];
        for (int j = 0; j < count; ++j) {{
            const Right here = x[j];
            bool reached = false;
            for (int k = 0; k < {TOGETHER}; ++k) reached |= here[k] != 0.0;
            if (!reached) continue;  // fields of one joint begin in a small part of the surface
            for (int p = starts[j] + 1; p < starts[j + 1]; ++p) x[row.data[p]] -= lower.data[p] * here;
        }}
        for (int j = count - 1; j >= 0; --j) {{
            Right here = x[j] / diagonal.data[j];
            for (int p = starts[j] + 1; p < starts[j + 1]; ++p) here -= lower.data[p] * x[row.data[p]];
            x[j] = here;
        }}
        for (int j = 0; j < count; ++j) x[j] *= after.data[j];
    }}
#endif
"""
)
def solve_block(
    block: int,
    first: wp.array(dtype=wp.int32),
    row: wp.array(dtype=wp.int32),
    lower: wp.array(dtype=wp.float64),
    diagonal: wp.array(dtype=wp.float64),
    before: wp.array(dtype=wp.float64),
    after: wp.array(dtype=wp.float64),
    times: int,
    values: wp.array3d(dtype=wp.float64),
): ...


@wp.kernel
def solve_symmetric(
    # factor
    first: wp.array(dtype=wp.int32),
    row: wp.array(dtype=wp.int32),
    lower: wp.array(dtype=wp.float64),
    diagonal: wp.array(dtype=wp.float64),
    # scales
    before: wp.array(dtype=wp.float64),
    after: wp.array(dtype=wp.float64),
    times: int,
    # in and out
    values: wp.array3d(dtype=wp.float64),
):
    """x ← (after · (L D Lᵀ)⁻¹ · before)^times x, blocks of ``TOGETHER`` right-hand sides a thread, shape
    (blocks, n, TOGETHER).

    Columns of L: entries ``first[j]`` to ``first[j + 1]`` of ``row`` and ``lower``, of which the first is its diagonal.
    """
    solve_block(wp.tid(), first, row, lower, diagonal, before, after, times, values)
