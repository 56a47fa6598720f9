"""The covering formula over runs of vertices that share their joints and rotations.

Scalar kernels are compiled to scalar code on the CPU, and chains of tile operations go through memory at every step.
So the arithmetic is one function of portable C++ whose loops over lanes the compiler turns into vector instructions; on
a GPU the same loops have one lane and neighbouring threads take neighbouring vertices.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options(VECTORISED)

CPU_LANES = 32
"""Vertices one CPU thread index computes together; a run has at least as many. On a GPU it is 1."""

CPU_FRAMES = 8
"""Frames computed one after another for the same vertices, while their coefficients are in the first-level cache."""

RUN_FIELDS = 8
"""Columns of the run table: first lane, length, first coefficient, first slot, joints, rotations, scales, muscles."""


@wp.func_native(
    f"""
#if defined(__CUDA_ARCH__)
    constexpr int N = 1;
#else
    constexpr int N = {CPU_LANES};
#endif
    const int* r = runs.data + {RUN_FIELDS} * run;
    const int length = r[1], joints = r[4], rotations = r[5], scales = r[6], muscles = r[7];
    const float* c = coefficients.data + r[2] + lane;
    const int* slot = slots.data + r[3];
    const float* row = palette.data + size_t(frame) * palette.shape[1];

    float x[N], y[N], z[N];
    for (int i = 0; i < N; ++i) x[i] = y[i] = z[i] = 0.0f;
    for (int k = 0; k < joints; ++k, c += length) {{
        const float* p = row + *slot++;
        const float px = p[0], py = p[1], pz = p[2];
        for (int i = 0; i < N; ++i) {{
            x[i] += c[i] * px;
            y[i] += c[i] * py;
            z[i] += c[i] * pz;
        }}
    }}

    float qx[N], qy[N], qz[N], qw[N];
    for (int i = 0; i < N; ++i) qx[i] = qy[i] = qz[i] = qw[i] = 0.0f;
    for (int k = 0; k < rotations; ++k, c += length) {{
        const float* q = row + *slot++;
        const float ax = q[0], ay = q[1], az = q[2], aw = q[3];
        for (int i = 0; i < N; ++i) {{
            qx[i] += c[i] * ax;
            qy[i] += c[i] * ay;
            qz[i] += c[i] * az;
            qw[i] += c[i] * aw;
        }}
    }}

    float dx[N], dy[N], dz[N];
    for (int i = 0; i < N; ++i) dx[i] = 1.0f;
    for (int k = 0; k < scales; ++k, c += length) {{
        const float s = row[*slot++];
        for (int i = 0; i < N; ++i) dx[i] += s * c[i];
    }}
    for (int i = 0; i < N; ++i) {{
        const float g = dx[i];
        dx[i] = g * c[i];
        dy[i] = g * c[i + length];
        dz[i] = g * c[i + 2 * length];
    }}
    c += 3 * length;
    for (int k = 0; k < muscles; ++k, c += 3 * length) {{
        const float s = row[*slot++];
        for (int i = 0; i < N; ++i) {{
            dx[i] += s * c[i];
            dy[i] += s * c[i + length];
            dz[i] += s * c[i + 2 * length];
        }}
    }}

    // d + 2 q × (q × d + w d) / |q|²: the blend need not be normalised first
    for (int i = 0; i < N; ++i) {{
        const float squared = qx[i] * qx[i] + qy[i] * qy[i] + qz[i] * qz[i] + qw[i] * qw[i];
        const float twice = 2.0f / (squared + 1e-20f);
        const float tx = qy[i] * dz[i] - qz[i] * dy[i] + qw[i] * dx[i];
        const float ty = qz[i] * dx[i] - qx[i] * dz[i] + qw[i] * dy[i];
        const float tz = qx[i] * dy[i] - qy[i] * dx[i] + qw[i] * dz[i];
        x[i] += dx[i] + twice * (qy[i] * tz - qz[i] * ty);
        y[i] += dy[i] + twice * (qz[i] * tx - qx[i] * tz);
        z[i] += dz[i] + twice * (qx[i] * ty - qy[i] * tx);
    }}

    float xyz[3 * N];
    float* out = (float*)points.data + 3 * size_t(frame) * points.shape[1];
    float* packed = scatter ? xyz : out + 3 * (r[0] + lane);
    for (int i = 0; i < N; ++i) {{
        packed[3 * i] = x[i];
        packed[3 * i + 1] = y[i];
        packed[3 * i + 2] = z[i];
    }}
    if (scatter) {{
        const int* target = order.data + r[0] + lane;
        for (int i = 0; i < N; ++i) {{
            memcpy(out + 3 * target[i], xyz + 3 * i, 12);
        }}
    }}
"""
)
def deform_lanes(
    frame: int,
    run: int,
    lane: int,
    runs: wp.array2d(dtype=wp.int32),
    slots: wp.array(dtype=wp.int32),
    coefficients: wp.array(dtype=float),
    order: wp.array(dtype=wp.int32),
    scatter: wp.bool,
    palette: wp.array2d(dtype=float),
    points: wp.array2d(dtype=wp.vec3),
): ...


@wp.kernel
def deform_runs(
    # model
    tiles: wp.array2d(dtype=wp.int32),
    runs: wp.array2d(dtype=wp.int32),
    slots: wp.array(dtype=wp.int32),
    coefficients: wp.array(dtype=float),
    order: wp.array(dtype=wp.int32),
    scatter: wp.bool,
    # pose
    palette: wp.array2d(dtype=float),
    block_frames: int,
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """S' = Σ c_j J_j' + rot(normalise(Σ w_k q_k), (1 + Σ s_i g_i) d + Σ m_i e_i).

    Launched over blocks of frames, tiles of vertices, and the frames of a block.

    ``slots`` of a run give the columns of the palette where its joints (3 values), rotations (4), scales s (1) and
    muscles m (1) begin; ``coefficients`` of a run are rows of its length: one a joint, one a rotation, one a scale,
    three for d, three a muscle. ``tiles`` hold a run and its lane where the tile begins. The last tile of a run is
    moved back to its end: some vertices are computed twice, none of another run. With ``scatter`` vertices are written
    to the places that ``order`` gives, otherwise one after another.
    """
    block, tile, part = wp.tid()
    frame = block * block_frames + part
    if frame < palette.shape[0]:
        deform_lanes(
            frame, tiles[tile, 0], tiles[tile, 1], runs, slots, coefficients, order, scatter, palette, points_out
        )
