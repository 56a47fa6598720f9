"""Penetration depth of points below the meshes of parts, by bounding volume hierarchies with eight children per node.

The eight boxes of a node, or the eight triangles of a leaf, are tested at once (SIMD). The trees have the layout of
``warpjld.grasp.triangle_tree``, one per part; their boxes are refitted in every frame.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.triangle_tree import WAITING, WIDTH, Tree

wp.set_module_options({**VECTORISED, "max_unroll": 1})

NEARLY = wp.constant(0.5)  # faces up to this share farther than the nearest contribute to the outward direction


@wp.struct
class PartTrees:
    """The triangles of P parts.

    ``tree`` has one surface per part; the nodes of part k are ``first_node[k]`` to ``first_node[k + 1]`` (exclusive),
    and ``held`` is the count of children of each node. The other arrays hold, for each leaf, the values of its eight
    triangles: ``corner``, vertex indices of the three corners; ``units``, unit normals of the corners, in the layout of
    the tree's corners; ``border``, 0 for corners on the mesh's boundary, else 1; ``thickness`` of the flesh at the
    corners [m]; ``plain``, the least :func:`smooth_skin` of the corners; ``real``, 0 for padding triangles in a part's
    last leaf, else 1.
    """

    tree: Tree
    first_node: wp.array(dtype=wp.int32)
    held: wp.array(dtype=wp.int32)
    corner: wp.array(dtype=wp.int32)
    units: wp.array(dtype=float)
    border: wp.array(dtype=float)
    thickness: wp.array(dtype=float)
    plain: wp.array(dtype=float)
    real: wp.array(dtype=float)


@wp.struct
class Beneath:
    """Position of a point relative to the mesh of a part, as weighted means over near faces.

    ``least``: distance of the nearest face [m], negative if no face is in reach or the point is not behind it;
    ``depth`` below the surface [m]; outward ``normal``; ``sure``, the length of the mean normal, a measure of
    confidence; ``thick``, thickness of the flesh [m]; ``plain``, see :func:`smooth_skin`; ``border``, 0 at the mesh's
    boundary.
    """

    least: float
    depth: float
    normal: wp.vec3
    sure: float
    thick: float
    plain: float
    border: float


@wp.func_native(
    f"""
    const int W = {WIDTH};
    for (int node = trees.first_node.data[part + 1] - 1; node >= trees.first_node.data[part]; --node) {{
        const int child = trees.tree.child.data[node];
        float* box = trees.tree.boxes.data + size_t(node) * 6 * W;
        for (int slot = 0; slot < trees.held.data[node]; ++slot) {{
            float low[3] = {{3e38f, 3e38f, 3e38f}}, high[3] = {{-3e38f, -3e38f, -3e38f}};
            if (child < 0) {{
                const size_t leaf = -1 - child + slot;
                const int* corner = trees.corner.data + leaf * 3 * W;
                float* out = trees.tree.corners.data + leaf * 9 * W;
                float* unit = trees.units.data + leaf * 9 * W;
                float* plain = trees.plain.data + leaf * W;
                for (int l = 0; l < W; ++l) {{
                    plain[l] = 1.0f;
                    for (int k = 0; k < 3; ++k) {{
                        const int v = corner[W * k + l];
                        plain[l] = plains.data[v] < plain[l] ? plains.data[v] : plain[l];
                        for (int i = 0; i < 3; ++i) {{
                            const float x = points.data[v][i];
                            out[W * (3 * k + i) + l] = x;
                            unit[W * (3 * k + i) + l] = units.data[v][i];
                            low[i] = x < low[i] ? x : low[i];
                            high[i] = x > high[i] ? x : high[i];
                        }}
                    }}
                }}
            }} else {{
                const size_t below = child + slot;
                const float* its = trees.tree.boxes.data + below * 6 * W;
                for (int l = 0; l < trees.held.data[below]; ++l)
                    for (int i = 0; i < 3; ++i) {{
                        low[i] = its[W * i + l] < low[i] ? its[W * i + l] : low[i];
                        high[i] = its[3 * W + W * i + l] > high[i] ? its[3 * W + W * i + l] : high[i];
                    }}
            }}
            for (int i = 0; i < 3; ++i) {{ box[W * i + slot] = low[i]; box[3 * W + W * i + slot] = high[i]; }}
        }}
    }}
"""
)
def fit_tree(
    trees: PartTrees,
    part: int,
    points: wp.array(dtype=wp.vec3),
    units: wp.array(dtype=wp.vec3),
    plains: wp.array(dtype=float),
):
    """Copy positions and normals of a part's corners into its leaves, and refit its boxes."""


@wp.kernel
def fit_trees(
    wanted: wp.array(dtype=wp.int32),
    points: wp.array(dtype=wp.vec3),
    units: wp.array(dtype=wp.vec3),
    plains: wp.array(dtype=float),
    # in and out
    trees: PartTrees,
):
    """Refit the trees of the parts whose ``wanted`` is not 0."""
    k = wp.tid()
    if wanted[k] != 0:
        fit_tree(trees, k, points, units, plains)


_Found = wp.types.vector(length=8, dtype=float)

# nearest_of: squared distances of a leaf's triangles from a point, corners relative to it, and barycentric coordinates
# of the nearest points; away_from: squared distances of the boxes of a node's children
_NEAREST = f"""
    const int W = {WIDTH};
    auto nearest_of = [&](const float* leaf, Floats corner[3][3], Floats weight[3]) {{
        Floats edge[3][3], normal[3], side[3];
        for (int k = 0; k < 3; ++k) {{
            weight[k] = Floats(0.0f);
            for (int i = 0; i < 3; ++i) corner[k][i] = *(const Stored*)(leaf + W * (3 * k + i)) - point[i];
        }}
        for (int k = 0; k < 3; ++k)
            for (int i = 0; i < 3; ++i) edge[k][i] = corner[(k + 1) % 3][i] - corner[k][i];
        for (int i = 0; i < 3; ++i) {{
            const int j = (i + 1) % 3, m = (i + 2) % 3;
            normal[i] = edge[0][j] * edge[1][m] - edge[0][m] * edge[1][j];
        }}
        Floats squared = Floats(3e38f), lateral = Floats(3e38f), lengths = Floats(0.0f);
        for (int k = 0; k < 3; ++k) {{
            const Floats* a = corner[k];
            const Floats* b = corner[(k + 1) % 3];
            const Floats* e = edge[k];
            const Floats length = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
            Floats t = -(a[0] * e[0] + a[1] * e[1] + a[2] * e[2]) / HIGHEST(length, Floats(1e-30f));
            t = LOWEST(HIGHEST(t, Floats(0.0f)), Floats(1.0f));
            const Floats x = a[0] + t * e[0], y = a[1] + t * e[1], z = a[2] + t * e[2];
            const Floats to_edge = x * x + y * y + z * z;
            const auto nearer = to_edge < squared;
            weight[k] = nearer ? Floats(1.0f) - t : weight[k];
            weight[(k + 1) % 3] = nearer ? t : weight[(k + 1) % 3];
            weight[(k + 2) % 3] = nearer ? Floats(0.0f) : weight[(k + 2) % 3];
            squared = LOWEST(squared, to_edge);
            // beyond an edge: on the other side of the plane through it and the normal
            side[k] = normal[0] * (a[1] * b[2] - a[2] * b[1]) + normal[1] * (a[2] * b[0] - a[0] * b[2])
                + normal[2] * (a[0] * b[1] - a[1] * b[0]);
            lateral = LOWEST(lateral, side[k]);
            lengths += length;
        }}
        const Floats wide = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        const Floats height = corner[0][0] * normal[0] + corner[0][1] * normal[1] + corner[0][2] * normal[2];
        const Floats inverse = Floats(1.0f) / HIGHEST(wide, Floats(1e-37f));
        // a degenerate triangle has no interior: its normal is rounding error
        lateral = wide > 1e-12f * lengths * lengths ? lateral : Floats(-1.0f);
        const auto above = lateral >= Floats(0.0f);
        squared = above ? LOWEST(squared, height * height * inverse) : squared;
        for (int k = 0; k < 3; ++k) weight[(k + 2) % 3] = above ? side[k] * inverse : weight[(k + 2) % 3];
        return squared;
    }};
    auto away_from = [&](const float* box) {{
        Floats squared = Floats(0.0f);
        for (int i = 0; i < 3; ++i) {{
            const Floats below = *(const Stored*)(box + W * i) - point[i];
            const Floats over = point[i] - *(const Stored*)(box + W * (3 + i));
            const Floats gap = HIGHEST(HIGHEST(below, over), Floats(0.0f));
            squared += gap * gap;
        }}
        return squared;
    }};
"""


@wp.func_native(
    prelude(WIDTH)
    + """
#if defined(__CUDA_ARCH__)
#define ROOT(x) sqrtf(x)
#else
#define ROOT(x) __builtin_elementwise_sqrt(x)
#endif
"""
    + _NEAREST
    + f"""
    wp::vec_t<8, float> out;
    out[0] = -1.0f;
    // first pass: nearest triangle. Stack entries hold a squared distance (float bits, high word) and a node (low word)
    wp::uint64 stack[{WAITING}];
    int count = 1;
    stack[0] = (wp::uint32)trees.tree.root.data[part];
    float best = reach * reach, behind = 0.0f, rim = 1.0f;
    while (count) {{
        const wp::uint64 next = stack[--count];
        const wp::uint32 bits = next >> 32;
        float squared_next;
        memcpy(&squared_next, &bits, 4);
        if (squared_next > best) continue;
        const int node = (int)(wp::uint32)next;
        if (node < 0) {{
            const size_t leaf = -1 - node;
            for (int base = 0; base < W; base += N) {{
                Floats corner[3][3], weight[3];
                const Floats squared = nearest_of(trees.tree.corners.data + leaf * 9 * W + base, corner, weight);
                for (unsigned int near = LANES_OF(squared < best); near; near &= near - 1) {{
                    const int l = FIRST_OF(near);
                    if (!(PICK(squared, l) < best)) continue;
                    best = PICK(squared, l);
                    float foot[3] = {{}}, normal[3] = {{}};
                    rim = 0.0f;
                    for (int k = 0; k < 3; ++k) {{
                        const float w = PICK(weight[k], l);
                        rim += w * trees.border.data[leaf * 3 * W + W * k + base + l];
                        for (int i = 0; i < 3; ++i) {{
                            foot[i] += w * PICK(corner[k][i], l);
                            normal[i] += w * trees.units.data[leaf * 9 * W + W * (3 * k + i) + base + l];
                        }}
                    }}
                    behind = foot[0] * normal[0] + foot[1] * normal[1] + foot[2] * normal[2];
                    out[0] = 0.0f;
                }}
            }}
        }} else {{
            const int first = trees.tree.child.data[node], step = first < 0 ? -1 : 1, begin = count;
            for (int base = 0; base < W; base += N) {{
                const Floats away = away_from(trees.tree.boxes.data + 6 * W * size_t(node) + base) * 0.999998f;
                for (unsigned int near = LANES_OF(away <= best); near; near &= near - 1) {{
                    const int l = FIRST_OF(near);
                    const float squared = PICK(away, l);
                    wp::uint32 bits;
                    memcpy(&bits, &squared, 4);
                    const wp::uint64 entry = wp::uint64(bits) << 32 | (wp::uint32)(first + step * (base + l));
                    int place = count++;
                    for (; place > begin && stack[place - 1] < entry; --place) stack[place] = stack[place - 1];
                    stack[place] = entry;
                }}
            }}
        }}
    }}
    // next to the mesh's boundary the side is uncertain
    if (out[0] < 0.0f || (behind <= 0.0f && rim >= 0.5f)) {{
        out[0] = -1.0f;
        return out;
    }}
    const float least = sqrtf(best), width = nearly * least + narrowest, within = (least + width) * (least + width);
    Floats total = Floats(0.0f), sums[7];
    for (int i = 0; i < 7; ++i) sums[i] = Floats(0.0f);
    stack[0] = (wp::uint32)trees.tree.root.data[part];
    count = 1;
    while (count) {{
        const int node = (int)(wp::uint32)stack[--count];
        if (node < 0) {{
            const size_t leaf = -1 - node;
            for (int base = 0; base < W; base += N) {{
                Floats corner[3][3], weight[3];
                const Floats squared = nearest_of(trees.tree.corners.data + leaf * 9 * W + base, corner, weight);
                if (!LANES_OF(squared < within)) continue;
                Floats u[3], v[3], n[3], foot[3];
                for (int i = 0; i < 3; ++i) {{
                    u[i] = corner[1][i] - corner[0][i];
                    v[i] = corner[2][i] - corner[0][i];
                    n[i] = foot[i] = Floats(0.0f);
                }}
                Floats border = Floats(0.0f), thick = Floats(0.0f);
                for (int k = 0; k < 3; ++k) {{
                    border += weight[k] * *(const Stored*)(trees.border.data + leaf * 3 * W + W * k + base);
                    thick += weight[k] * *(const Stored*)(trees.thickness.data + leaf * 3 * W + W * k + base);
                    for (int i = 0; i < 3; ++i) {{
                        foot[i] += weight[k] * corner[k][i];
                        n[i] += weight[k] * *(const Stored*)(trees.units.data + leaf * 9 * W + W * (3 * k + i) + base);
                    }}
                }}
                const Floats x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2];
                const Floats z = u[0] * v[1] - u[1] * v[0];
                Floats near = HIGHEST(Floats(1.0f) - (ROOT(squared) - least) / width, Floats(0.0f));
                near *= near * ROOT(x * x + y * y + z * z) * *(const Stored*)(trees.real.data + leaf * W + base);
                const Floats length = ROOT(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
                const Floats unit = near / HIGHEST(length, Floats(1e-20f));
                total += near;
                sums[0] += unit * (foot[0] * n[0] + foot[1] * n[1] + foot[2] * n[2]);
                for (int i = 0; i < 3; ++i) sums[1 + i] += unit * n[i];
                sums[4] += near * thick;
                sums[5] += near * *(const Stored*)(trees.plain.data + leaf * W + base);
                sums[6] += near * LOWEST(2.0f * border, Floats(1.0f));
            }}
        }} else {{
            const int first = trees.tree.child.data[node], step = first < 0 ? -1 : 1;
            for (int base = 0; base < W; base += N) {{
                const Floats away = away_from(trees.tree.boxes.data + 6 * W * size_t(node) + base);
                for (unsigned int near = LANES_OF(away < within); near; near &= near - 1)
                    stack[count++] = (wp::uint32)(first + step * (base + FIRST_OF(near)));
            }}
        }}
    }}
    out[0] = least;
    float all = 1e-30f;
    for (int l = 0; l < N; ++l) all += PICK(total, l);
    for (int i = 0; i < 7; ++i) {{
        float sum = 0.0f;
        for (int l = 0; l < N; ++l) sum += PICK(sums[i], l);
        out[1 + i] = sum / all;
    }}
#undef ROOT
    return out;
"""
)
def mean_of_near_faces(
    trees: PartTrees, part: int, point: wp.vec3, reach: float, nearly: float, narrowest: float
) -> _Found: ...


@wp.func
def beneath(trees: PartTrees, part: int, point: wp.vec3, reach: float, narrowest: float) -> Beneath:
    """Weighted means over the faces of a part whose distance from a point is close to that of the nearest face.

    The closest face alone would make the outward direction discontinuous where another face becomes the closest. In the
    middle of the flesh the directions cancel: the length of their mean is a measure of confidence.

    Args:
        reach: Largest distance of the nearest face [m].
        narrowest: Least width of the distance interval over which weights fall to 0 [m].
    """
    found = mean_of_near_faces(trees, part, point, reach, NEARLY, narrowest)
    out = Beneath()
    out.least = found[0]
    out.depth = found[1]
    mean = wp.vec3(found[2], found[3], found[4])
    out.sure = wp.length(mean)
    out.normal = wp.normalize(mean)
    out.thick = found[5]
    out.plain = found[6]
    out.border = found[7]
    return out
