"""The covering formula over runs of vertices that use the same joints and rotations.

Warp compiles scalar kernels to scalar code on the CPU, and chains of tile operations go through memory at every step.
So the arithmetic is one function of portable C++ on SIMD vectors that stay in registers; on a GPU a vector is one
number, and neighbouring threads compute neighbouring vertices.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude

wp.set_module_options(VECTORISED)

CPU_LANES = 32
"""Vertices of a tile, which one thread index computes on the CPU; a run has at least as many. On a GPU it is 1."""

CPU_FRAMES = 8
"""Frames computed in turn for the same vertices, while their coefficients are in the first-level cache."""

RUN_FIELDS = 8
"""Columns of the run table: first lane, length, first coefficient, first slot, joints, rotations, scales, muscles."""

# the four sums of a rotation's components and their addends fit sixteen registers of eight floats
_LANES = 16


@wp.func_native(
    prelude(_LANES)
    + f"""
#if defined(__CUDA_ARCH__)
    constexpr int TILE = 1;
#else
    constexpr int TILE = {CPU_LANES};
    typedef float Four __attribute__((ext_vector_type(4), aligned(4)));
#endif
#define ROW(at) (*(const Stored*)(at))
    const int* r = runs.data + {RUN_FIELDS} * run;
    const int length = r[1], joints = r[4], rotations = r[5], scales = r[6], muscles = r[7];
    for (int base = 0; base < TILE; base += N)
    for (int frame = first; frame < last; ++frame) {{
        const float* c = coefficients.data + r[2] + lane + base;
        const int* slot = slots.data + r[3];
        const float* row = palette.data + size_t(frame) * palette.shape[1];

        Floats x = 0.0f, y = 0.0f, z = 0.0f;
        for (int k = 0; k < joints; ++k, c += length) {{
            const float* p = row + *slot++;
            const Floats w = ROW(c);
            x += w * p[0];
            y += w * p[1];
            z += w * p[2];
        }}

        Floats qx = 0.0f, qy = 0.0f, qz = 0.0f, qw = 0.0f;
        for (int k = 0; k < rotations; ++k, c += length) {{
            const float* q = row + *slot++;
            const Floats w = ROW(c);
            qx += w * q[0];
            qy += w * q[1];
            qz += w * q[2];
            qw += w * q[3];
        }}

        Floats g = 1.0f;
        for (int k = 0; k < scales; ++k, c += length) g += ROW(c) * row[*slot++];
        Floats dx = g * ROW(c), dy = g * ROW(c + length), dz = g * ROW(c + 2 * length);
        c += 3 * length;
        for (int k = 0; k < muscles; ++k, c += 3 * length) {{
            const float s = row[*slot++];
            dx += ROW(c) * s;
            dy += ROW(c + length) * s;
            dz += ROW(c + 2 * length) * s;
        }}

        // d + 2 q × (q × d + w d) / |q|²: valid for a blend q that is not normalised
        const Floats twice = 2.0f / (qx * qx + qy * qy + qz * qz + qw * qw + 1e-20f);
        const Floats tx = qy * dz - qz * dy + qw * dx;
        const Floats ty = qz * dx - qx * dz + qw * dy;
        const Floats tz = qx * dy - qy * dx + qw * dz;
        x += dx + twice * (qy * tz - qz * ty);
        y += dy + twice * (qz * tx - qx * tz);
        z += dz + twice * (qx * ty - qy * tx);

        float* out = (float*)points.data + 3 * size_t(frame) * points.shape[1];
#if defined(__CUDA_ARCH__)
        const int place = scatter ? order.data[r[0] + lane] : r[0] + lane;
        out[3 * place] = x;
        out[3 * place + 1] = y;
        out[3 * place + 2] = z;
#else
        out += 3 * (r[0] + lane + base);
#define QUAD(v, i) __builtin_shufflevector(v, v, i, i + 1, i + 2, i + 3)
#define STORE(i) {{ \\
        const auto a = QUAD(x, i), b = QUAD(y, i), e = QUAD(z, i); \\
        const auto ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), be = __builtin_shufflevector(b, e, 1, 5, 2, 6); \\
        const auto ae = __builtin_shufflevector(a, e, 4, 1, 6, 3), bz = __builtin_shufflevector(b, e, 3, 7, 3, 7); \\
        *(Four*)(out + 3 * i) = __builtin_shufflevector(ab, ae, 0, 1, 4, 5); \\
        *(Four*)(out + 3 * i + 4) = __builtin_shufflevector( \\
            __builtin_shufflevector(b, e, 1, 5, 2, 2), a, 0, 1, 6, 2); \\
        *(Four*)(out + 3 * i + 8) = __builtin_shufflevector(ae, bz, 2, 3, 4, 5); }}
        STORE(0) STORE(4) STORE(8) STORE(12)
#undef STORE
#undef QUAD
#endif
    }}
#undef ROW
"""
)
def deform_lanes(
    first: int,
    last: int,
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

    Launched over blocks of frames and tiles of vertices.

    ``slots`` of a run give the first palette columns of its joints (3 values), rotations (4), scales s (1) and muscles
    m (1); ``coefficients`` of a run are rows of its length: one per joint, rotation and scale, three for d, and three
    per muscle. ``tiles`` hold a run and the lane within it where the tile begins. The last tile of a run overlaps the
    one before, so that it ends with the run: some vertices are computed twice. With ``scatter`` a GPU writes vertices
    to the rows given by ``order``; otherwise they are written in the order of lanes.
    """
    block, tile = wp.tid()
    first = block * block_frames
    last = wp.min(first + block_frames, palette.shape[0])
    deform_lanes(
        first, last, tiles[tile, 0], tiles[tile, 1], runs, slots, coefficients, order, scatter, palette, points_out
    )


@wp.func_native(
    """
#if !defined(__CUDA_ARCH__)
    typedef float Four __attribute__((ext_vector_type(4)));
    typedef float Loose __attribute__((ext_vector_type(4), aligned(4)));
    const int count = points.shape[1];
    const float* from = (const float*)packed.data + 3 * size_t(frame) * packed.shape[1];
    float* to = (float*)points.data + 3 * size_t(frame) * count;
    const int* at = lane.data;
    int i = 0;
    // non-temporal stores of vectors need aligned addresses
    for (; i < count && (size_t(to + 3 * i) & 15); ++i)
        for (int k = 0; k < 3; ++k) to[3 * i + k] = from[3 * at[i] + k];
    for (; i + 4 <= count; i += 4) {
        // each load reads one float beyond the vertex, for which the array has room
        const Four a = *(const Loose*)(from + 3 * at[i]), b = *(const Loose*)(from + 3 * at[i + 1]);
        const Four c = *(const Loose*)(from + 3 * at[i + 2]), d = *(const Loose*)(from + 3 * at[i + 3]);
        Four* out = (Four*)(to + 3 * i);
        __builtin_nontemporal_store(__builtin_shufflevector(a, b, 0, 1, 2, 4), out);
        __builtin_nontemporal_store(__builtin_shufflevector(b, c, 1, 2, 4, 5), out + 1);
        __builtin_nontemporal_store(__builtin_shufflevector(c, d, 2, 4, 5, 6), out + 2);
    }
    for (; i < count; ++i)
        for (int k = 0; k < 3; ++k) to[3 * i + k] = from[3 * at[i] + k];
#endif
"""
)
def gather_row(
    frame: int,
    packed: wp.array2d(dtype=wp.vec3),
    lane: wp.array(dtype=wp.int32),
    points: wp.array2d(dtype=wp.vec3),
): ...


@wp.kernel
def gather_lanes(
    packed: wp.array2d(dtype=wp.vec3), lane: wp.array(dtype=wp.int32), points_out: wp.array2d(dtype=wp.vec3)
):
    """Copy vertices from the order of lanes to that of the surface, one frame per thread, on the CPU.

    Gathering from a buffer in cache and writing rows sequentially is faster than scattering vertices in memory. A row
    of ``packed`` has at least one vertex more than there are lanes.
    """
    gather_row(wp.tid(), packed, lane, points_out)
