"""The covering formula at chosen vertices with its derivatives: apart, since compiling those takes seconds."""

import warp as wp

from warpjld_kernels.anchored import Anchors, Parameters, deformed

wp.set_module_options({"max_unroll": 1, "enable_backward": True})


@wp.kernel
def deform_points_with_gradient(
    # model
    anchors: Anchors,
    parameters: Parameters,
    chosen: wp.array(dtype=wp.int32),
    # pose
    positions: wp.array2d(dtype=wp.vec3),
    halfway: wp.array2d(dtype=wp.quat),
    rotations: wp.array2d(dtype=wp.quat),
    flexion_ratio: wp.array2d(dtype=float),
    closing: wp.array3d(dtype=float),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """As ``deform_points``, differentiable in parameters and pose."""
    f, i = wp.tid()
    points_out[f, i] = deformed(
        anchors, parameters, positions, halfway, rotations, flexion_ratio, closing, f, chosen[i]
    )
