"""Intersections between triangles of different parts of a posed skin."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.posed_skin import PosedSkins
from warpjld_kernels.triangle_tree import WAITING, WIDTH

wp.set_module_options({**VECTORISED, "max_unroll": 1})


@wp.func_native(
    f"""
    const int W = {WIDTH};
    const wp::vec_t<3, float>* at = skins.points.data + size_t(pose) * skins.points.shape[1];
    const wp::vec_t<3, int>* faces = skins.faces.data;
    const wp::vec_t<3, int> own = faces[face];
    float low[3], high[3];
    for (int i = 0; i < 3; ++i) {{
        const float a = at[own[0]][i], b = at[own[1]][i], c = at[own[2]][i];
        low[i] = a < b ? a : b; low[i] = c < low[i] ? c : low[i];
        high[i] = a > b ? a : b; high[i] = c > high[i] ? c : high[i];
    }}
    // node, or leaf as -1 - leaf, of the tree of this pose
    int stack[{WAITING}], count = 1, found = 0;
    const int first_node = pose * skins.nodes;
    stack[0] = skins.tree.root.data[pose];
    while (count) {{
        const int node = stack[--count];
        if (node >= 0) {{
            const float* box = skins.tree.boxes.data + 6 * W * size_t(node);
            const wp::uint64* inside = skins.inside.data + size_t(node - first_node) * W;
            const int first = skins.tree.child.data[node], step = first < 0 ? -1 : 1;
            const int held = skins.held.data[node - first_node];
            for (int l = 0; l < held; ++l)
                if ((inside[l] & others) && low[0] <= box[3 * W + l] && box[l] <= high[0]
                    && low[1] <= box[4 * W + l] && box[W + l] <= high[1]
                    && low[2] <= box[5 * W + l] && box[2 * W + l] <= high[2])
                    stack[count++] = first + step * l;
            continue;
        }}
        const int* number = skins.tree.face.data + W * size_t(-1 - node);
        for (int l = 0; l < W; ++l) {{
            const int other = number[l];
            if (l && other == number[l - 1]) break;
            const int part = skins.part.data[other];
            if (part < 0 || !(others >> part & 1)) continue;
            const wp::vec_t<3, int> its = faces[other];
            int apart = 0;
            for (int i = 0; i < 3; ++i) {{
                const float a = at[its[0]][i], b = at[its[1]][i], c = at[its[2]][i];
                float least = a < b ? a : b; least = c < least ? c : least;
                float most = a > b ? a : b; most = c > most ? c : most;
                apart |= least > high[i] || most < low[i];
            }}
            if (apart) continue;
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
            if (crosses) {{ counts.data[size_t(task) * counts.shape[1] + part] += 1; ++found; }}
        }}
    }}
    return found;
"""
)
def crossings_of(
    skins: PosedSkins,
    pose: int,
    face: int,
    others: wp.uint64,
    scale: float,
    task: int,
    counts: wp.array2d(dtype=wp.int32),
) -> int:
    """Count the triangles of other parts that intersect one, by part, unless they share an edge."""


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
    # out
    counts_out: wp.array2d(dtype=wp.int32),
):
    """Numbers of intersecting triangle pairs between one part and others of a posed skin."""
    task = wp.tid()
    part = part_of[task]
    for n in range(first_of_part[part], first_of_part[part + 1]):
        crossings_of(skins, pose_of[task], by_part[n], others[task], scale, task, counts_out)
