"""Differentiable covering formula at chosen vertices, in a module of its own since compiling it takes seconds."""

import warp as wp

from warpjld_kernels.rows import Rows, deformed

wp.set_module_options({"max_unroll": 1, "enable_backward": True})


@wp.kernel
def deform_rows_with_gradient(
    # model
    rows: Rows,
    chosen: wp.array(dtype=wp.int32),
    # pose
    positions: wp.array2d(dtype=wp.vec3),
    turns: wp.array2d(dtype=wp.quat),
    scalars: wp.array2d(dtype=float),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """As ``deform_rows``, differentiable in coefficients and pose."""
    f, i = wp.tid()
    points_out[f, i] = deformed(rows, positions, turns, scalars, f, chosen[i])
