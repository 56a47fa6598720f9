"""Intersections between triangles of different parts of a posed skin."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.posed_skin import PosedSkins
from warpjld_kernels.triangle_tree import WAITING, WIDTH

wp.set_module_options({**VECTORISED, "max_unroll": 1})

MOST_PARTS = 64
"""Parts of a skin that are told from one another: bits of a mask."""


@wp.func_native(
    prelude(WIDTH)
    + f"""
    const int W = {WIDTH};
    const wp::vec_t<3, float>* at = skins.points.data + size_t(pose) * skins.points.shape[1];
    const wp::vec_t<3, int>* faces = skins.faces.data;
    const int* first_face = first_of_part.data;
    const int parts = counts.shape[1] < {MOST_PARTS} ? counts.shape[1] : {MOST_PARTS};
    // boxes of the other parts, side by side; of those that are not asked for nothing overlaps
    float lows[3][{MOST_PARTS}], highs[3][{MOST_PARTS}];
    for (int k = 0; k < (parts + W - 1) / W * W; ++k) {{
        for (int i = 0; i < 3; ++i) {{ lows[i][k] = 3e38f; highs[i][k] = -3e38f; }}
        if (k >= parts || !(others >> k & 1)) continue;
        for (int n = first_face[k]; n < first_face[k + 1]; ++n)
            for (int c = 0; c < 3; ++c) {{
                const wp::vec_t<3, float> x = at[faces[by_part.data[n]][c]];
                for (int i = 0; i < 3; ++i) {{
                    lows[i][k] = x[i] < lows[i][k] ? x[i] : lows[i][k];
                    highs[i][k] = x[i] > highs[i][k] ? x[i] : highs[i][k];
                }}
            }}
    }}
    int* own_counts = counts.data + size_t(task) * counts.shape[1];
    const int* allowed = most.data + size_t(task) * most.shape[1];
    wp::uint64 asked = others;
    for (int n = first_face[own_part]; asked && n < first_face[own_part + 1]; ++n) {{
    const wp::vec_t<3, int> own = faces[by_part.data[n]];
    float low[3], high[3];
    for (int i = 0; i < 3; ++i) {{
        const float a = at[own[0]][i], b = at[own[1]][i], c = at[own[2]][i];
        low[i] = a < b ? a : b; low[i] = c < low[i] ? c : low[i];
        high[i] = a > b ? a : b; high[i] = c > high[i] ? c : high[i];
    }}
    wp::uint64 near = 0;
    for (int base = 0; base < parts; base += N) {{
        Floats past = low[0] - *(const Stored*)(highs[0] + base);
        for (int i = 1; i < 3; ++i) past = HIGHEST(past, low[i] - *(const Stored*)(highs[i] + base));
        for (int i = 0; i < 3; ++i) past = HIGHEST(past, *(const Stored*)(lows[i] + base) - high[i]);
        near |= wp::uint64(LANES_OF(past <= 0.0f)) << base;
    }}
    near &= asked;
    if (!near) continue;
    // node, or leaf as -1 - leaf, of the tree of this pose
    int stack[{WAITING}], count = 1;
    const int first_node = pose * skins.nodes;
    stack[0] = skins.tree.root.data[pose];
    while (count) {{
        const int node = stack[--count];
        if (node >= 0) {{
            const float* box = skins.tree.boxes.data + 6 * W * size_t(node);
            const wp::uint64* inside = skins.inside.data + size_t(node - first_node) * W;
            const int first = skins.tree.child.data[node], step = first < 0 ? -1 : 1;
            for (int base = 0; base < W; base += N) {{
                Floats past = low[0] - *(const Stored*)(box + 3 * W + base);
                for (int i = 1; i < 3; ++i) past = HIGHEST(past, low[i] - *(const Stored*)(box + W * (3 + i) + base));
                for (int i = 0; i < 3; ++i) past = HIGHEST(past, *(const Stored*)(box + W * i + base) - high[i]);
                for (unsigned int met = LANES_OF(past <= 0.0f); met; met &= met - 1) {{
                    const int l = base + FIRST_OF(met);
                    if (inside[l] & near) stack[count++] = first + step * l;
                }}
            }}
            continue;
        }}
        const int* number = skins.tree.face.data + W * size_t(-1 - node);
        const float* leaf = skins.tree.corners.data + 9 * W * size_t(-1 - node);
        for (int base = 0; base < W; base += N) {{
        Floats past = Floats(-1.0f);
        for (int i = 0; i < 3; ++i) {{
            const Floats a = *(const Stored*)(leaf + W * i + base);
            const Floats b = *(const Stored*)(leaf + W * (3 + i) + base);
            const Floats c = *(const Stored*)(leaf + W * (6 + i) + base);
            past = HIGHEST(past, HIGHEST(LOWEST(LOWEST(a, b), c) - high[i], low[i] - HIGHEST(HIGHEST(a, b), c)));
        }}
        for (unsigned int met = LANES_OF(past <= 0.0f); met; met &= met - 1) {{
            const int l = base + FIRST_OF(met);
            const int other = number[l];
            if (l && other == number[l - 1]) break;  // the last leaf is filled up with its last triangle
            const int part = skins.part.data[other];
            if (part < 0 || !(near >> part & 1)) continue;
            const wp::vec_t<3, int> its = faces[other];
            int shared = 0, from_own = 0, from_its = 0;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (own[i] == its[j]) {{ ++shared; from_own = i; from_its = j; }}
            if (shared > 1) continue;
            // a common corner comes first in both: then only the edges opposite to it can pass through
            double corner[2][3][3], side[2][3];
            for (int k = 0; k < 3; ++k)
                for (int i = 0; i < 3; ++i) {{
                    corner[0][k][i] = at[own[(from_own + k) % 3]][i];
                    corner[1][k][i] = at[its[(from_its + k) % 3]][i];
                }}
            for (int s = 0; s < 2; ++s) {{
                const double (*b)[3] = corner[1 - s];
                double normal[3], length = 0.0;
                for (int i = 0; i < 3; ++i) {{
                    const int j = (i + 1) % 3, m = (i + 2) % 3;
                    normal[i] = (b[1][j] - b[0][j]) * (b[2][m] - b[0][m]) - (b[1][m] - b[0][m]) * (b[2][j] - b[0][j]);
                    length += normal[i] * normal[i];
                }}
                length = sqrt(length);
                for (int k = 0; k < 3; ++k) {{
                    double height = 0.0;
                    for (int i = 0; i < 3; ++i) height += (corner[s][k][i] - b[0][i]) * normal[i];
                    height = length > 0.0 ? height / length : 0.0;
                    side[s][k] = fabs(height) > 1e-13 * scale ? height : 0.0;
                }}
            }}
            int crosses = 0;
            for (int e = 0; e < (shared ? 1 : 3) && !crosses; ++e) {{
                const int start = e == 0 ? 1 : 0, end = e == 1 ? 1 : 2;
                for (int s = 0; s < 2 && !crosses; ++s) {{
                    if (!(side[s][start] * side[s][end] < 0.0)) continue;
                    const double* from = corner[s][start];
                    const double (*b)[3] = corner[1 - s];
                    double along[3], to[3][3], turns[3];
                    for (int i = 0; i < 3; ++i) along[i] = corner[s][end][i] - from[i];
                    for (int k = 0; k < 3; ++k)
                        for (int i = 0; i < 3; ++i) to[k][i] = b[k][i] - from[i];
                    for (int k = 0; k < 3; ++k) {{
                        const double* x = to[k];
                        const double* y = to[(k + 1) % 3];
                        turns[k] = along[0] * (x[1] * y[2] - x[2] * y[1]) + along[1] * (x[2] * y[0] - x[0] * y[2])
                            + along[2] * (x[0] * y[1] - x[1] * y[0]);
                    }}
                    crosses = (turns[0] >= 0.0 && turns[1] >= 0.0 && turns[2] >= 0.0)
                        || (turns[0] <= 0.0 && turns[1] <= 0.0 && turns[2] <= 0.0);
                }}
            }}
            if (crosses && ++own_counts[part] > allowed[part]) {{
                asked = enough ? 0 : asked & ~(wp::uint64(1) << part);
                near &= asked;
                if (!near) count = 0;
            }}
        }}
        }}
    }}
    }}
"""
)
def crossings_of(
    skins: PosedSkins,
    pose: int,
    own_part: int,
    others: wp.uint64,
    first_of_part: wp.array(dtype=wp.int32),
    by_part: wp.array(dtype=wp.int32),
    scale: float,
    task: int,
    most: wp.array2d(dtype=wp.int32),
    enough: bool,
    counts: wp.array2d(dtype=wp.int32),
):
    """Count the pairs of intersecting triangles of a part and of others, by other part, unless they share an edge."""


@wp.kernel
def count_crossings(
    skins: PosedSkins,
    # tasks: a pose, a part of the skin, and bits of the parts that it may cross
    pose_of: wp.array(dtype=wp.int32),
    part_of: wp.array(dtype=wp.int32),
    others: wp.array(dtype=wp.uint64),
    # triangles by part
    first_of_part: wp.array(dtype=wp.int32),
    by_part: wp.array(dtype=wp.int32),
    scale: float,
    # counting ends for a part beyond this number; or, with ``enough``, for all parts
    most: wp.array2d(dtype=wp.int32),
    enough: bool,
    # out
    counts_out: wp.array2d(dtype=wp.int32),
):
    """Numbers of intersecting triangle pairs between one part and others of a posed skin."""
    task = wp.tid()
    crossings_of(
        skins, pose_of[task], part_of[task], others[task], first_of_part, by_part, scale, task, most, enough, counts_out
    )
