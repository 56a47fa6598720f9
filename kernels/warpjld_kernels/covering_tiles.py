"""The covering formula over runs of vertices that share their joints and rotations, in tile arithmetic.

A plain kernel is compiled to scalar code on the CPU; the same arithmetic on tiles is vectorised.
"""

from typing import Any

import warp as wp

wp.set_module_options(
    {
        "enable_backward": False,
        "cpu_compiler_flags": "-march=native -ffp-contract=fast -mprefer-vector-width=512",
    }
)

LANES = 64
"""Vertices a tile holds; a run has at least as many."""

RUN_FIELDS = 8
"""Columns of the run table: first lane, length, first coefficient, first slot, joints, rotations, scales, muscles."""


@wp.func
def cross(a: Any, b: Any, c: Any, d: Any):
    return a * d - b * c


@wp.func
def inverse_length(squared: float) -> float:
    return 1.0 / wp.sqrt(wp.max(squared, 1.0e-20))


@wp.func
def as_vec3(x: float, y: float, z: float) -> wp.vec3:
    return wp.vec3(x, y, z)


@wp.kernel
def deform_runs(
    # model
    tiles: wp.array2d(dtype=wp.int32),
    runs: wp.array2d(dtype=wp.int32),
    slots: wp.array(dtype=wp.int32),
    coefficients: wp.array(dtype=float),
    order: wp.array(dtype=wp.int32),
    # pose
    palette: wp.array2d(dtype=float),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """S' = Σ c_j J_j' + rot(normalise(Σ w_k q_k), (1 + Σ s_i g_i) d + Σ m_i e_i) for ``LANES`` vertices of a run.

    ``slots`` of a run give the columns of the palette where its joints (3 values), rotations (4), scales s (1) and
    muscles m (1) begin; ``coefficients`` of a run are rows of its length: one a joint, one a rotation, one a scale,
    three for d, three a muscle.
    The last tile of a run is moved back to its end: some vertices are computed twice, none of another run.
    """
    f, b = wp.tid()
    run = tiles[b, 0]
    lane = tiles[b, 1]
    length = runs[run, 1]
    at = runs[run, 2] + lane
    slot = runs[run, 3]
    joints = runs[run, 4]
    rotations = runs[run, 5]
    scales = runs[run, 6]
    muscles = runs[run, 7]

    x = wp.tile_zeros(shape=LANES, dtype=float)
    y = wp.tile_zeros(shape=LANES, dtype=float)
    z = wp.tile_zeros(shape=LANES, dtype=float)
    for _ in range(joints):
        c = wp.tile_load(coefficients, shape=LANES, offset=at)
        column = slots[slot]
        x += c * palette[f, column]
        y += c * palette[f, column + 1]
        z += c * palette[f, column + 2]
        at += length
        slot += 1

    qx = wp.tile_zeros(shape=LANES, dtype=float)
    qy = wp.tile_zeros(shape=LANES, dtype=float)
    qz = wp.tile_zeros(shape=LANES, dtype=float)
    qw = wp.tile_zeros(shape=LANES, dtype=float)
    for _ in range(rotations):
        w = wp.tile_load(coefficients, shape=LANES, offset=at)
        column = slots[slot]
        qx += w * palette[f, column]
        qy += w * palette[f, column + 1]
        qz += w * palette[f, column + 2]
        qw += w * palette[f, column + 3]
        at += length
        slot += 1

    scale = wp.tile_ones(shape=LANES, dtype=float)
    for _ in range(scales):
        scale += wp.tile_load(coefficients, shape=LANES, offset=at) * palette[f, slots[slot]]
        at += length
        slot += 1
    dx = scale * wp.tile_load(coefficients, shape=LANES, offset=at)
    dy = scale * wp.tile_load(coefficients, shape=LANES, offset=at + length)
    dz = scale * wp.tile_load(coefficients, shape=LANES, offset=at + 2 * length)
    at += 3 * length
    for _ in range(muscles):
        s = palette[f, slots[slot]]
        dx += wp.tile_load(coefficients, shape=LANES, offset=at) * s
        dy += wp.tile_load(coefficients, shape=LANES, offset=at + length) * s
        dz += wp.tile_load(coefficients, shape=LANES, offset=at + 2 * length) * s
        at += 3 * length
        slot += 1

    # v + 2 q × (q × v + w v), the length of q divided out of the products
    scale = wp.tile_map(inverse_length, qx * qx + qy * qy + qz * qz + qw * qw)
    qx = qx * scale
    qy = qy * scale
    qz = qz * scale
    qw = qw * scale
    tx = cross(qy, qz, dy, dz) + qw * dx
    ty = cross(qz, qx, dz, dx) + qw * dy
    tz = cross(qx, qy, dx, dy) + qw * dz
    x += dx + 2.0 * cross(qy, qz, ty, tz)
    y += dy + 2.0 * cross(qz, qx, tz, tx)
    z += dz + 2.0 * cross(qx, qy, tx, ty)

    points = wp.tile_map(as_vec3, x, y, z)
    targets = wp.tile_load(order, shape=LANES, offset=runs[run, 0] + lane)
    wp.tile_store_indexed(points_out[f], indices=targets, t=points, axis=0)
