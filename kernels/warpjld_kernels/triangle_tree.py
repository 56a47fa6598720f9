"""Nearest triangle of a surface to a point, by a bounding volume hierarchy with eight children per node.

Eight boxes, or eight triangles, are measured at once in float32, with a margin. Triangles that may be nearest are
measured one by one in float64, and of equally near ones that of the lowest number counts: where a search starts, and
with which bound, does not change what it finds.
"""

import warp as wp

from warpjld_kernels.lanes import prelude

WIDTH = 8
"""Children of a node, triangles of a leaf."""

SLIVER = 1e-20
"""Squared area by which a triangle counts as its edges alone, as a part of the sum of its squared edges, squared."""

ROUNDING = 2e-5
"""Error of a distance to a triangle in float32, as a part of the triangle's size and of the coordinates."""

FRAME = 20
"""Numbers of a triangle's frame."""

FRAME_ROUNDING = 2e-6
"""The same by a frame, which is made in float64: a dozen roundings of 6e-8, twice."""

CANDIDATES = 32
"""Triangles that wait to be measured in float64: a fan round the nearest corner, and some that were near before it."""

WAITING = 128
"""Places on the stack of a search, of which every level of the tree takes seven."""


@wp.struct
class Tree:
    """Trees of some surfaces, one after another; see ``warpjld.grasp.triangle_tree``.

    ``boxes`` hold 48 numbers a node: the lower x, y and z of its eight children, then the upper. ``child`` is the first
    of a node's children, or −1 minus the first of its leaves. ``corners`` hold 72 numbers a leaf: x, y, z of the first
    corner of its eight triangles, of the second and of the third; ``face`` their numbers. ``frames``, 160 numbers a
    leaf, are those of ``warpjld.grasp.triangle_frames``, or there are none: of surfaces that deform.
    """

    root: wp.array(dtype=wp.int32)
    child: wp.array(dtype=wp.int32)
    boxes: wp.array(dtype=float)
    corners: wp.array(dtype=float)
    face: wp.array(dtype=wp.int32)
    frames: wp.array(dtype=float)


_BY_FRAMES = f"""                    const float* frame = tree.frames.data + {FRAME * WIDTH} * size_t(-1 - node) + base;
                    Floats of[{FRAME}];
                    for (int k = 0; k < {FRAME}; ++k) of[k] = *(const Stored*)(frame + {WIDTH} * k);
                    Floats local[3];
                    for (int k = 0; k < 3; ++k)
                        local[k] = of[3 * k] * at[0] + of[3 * k + 1] * at[1] + of[3 * k + 2] * at[2] + of[9 + k];
                    const Floats x = local[0], y = local[1], beyond = x - of[12];
                    const Floats first = x - LOWEST(HIGHEST(x, Floats(0.0f)), of[12]);
                    Floats second = beyond * of[13] + y * of[14], third = x * of[16] + y * of[17];
                    second -= LOWEST(HIGHEST(second, Floats(0.0f)), of[15]);
                    third -= LOWEST(HIGHEST(third, Floats(0.0f)), of[18]);
                    const Floats over_second = beyond * of[14] - y * of[13], over_third = y * of[16] - x * of[17];
                    const Floats aside = LOWEST(first * first + y * y, LOWEST(
                        second * second + over_second * over_second, third * third + over_third * over_third));
                    const Floats over = HIGHEST(-y, HIGHEST(over_second, over_third));
                    low = local[2] * local[2] + (over <= Floats(0.0f) ? Floats(0.0f) : aside);
                    error = of[19] + {FRAME_ROUNDING} * rounded;
"""
"""Squared distances of a point to triangles of a leaf, each in its frame."""


@wp.func_native(
    prelude(WIDTH)
    + f"""
    // squared distance, whose bits are in the order of its values, and node: one word
    wp::uint64 stack[{WAITING}];
    stack[0] = (wp::uint32)tree.root.data[surface];
    int count = 1, nearest = -1, candidates = 0;
    double best = bound * bound;
    const float at[3] = {{(float)point[0], (float)point[1], (float)point[2]}};
    const float rounded = fabsf(at[0]) + fabsf(at[1]) + fabsf(at[2]);
    const float slack = 1.2e-7f * rounded;  // of the point itself, rounded to float32
    const bool framed = tree.frames.shape[0] > 0;
    // triangles that may be nearest, and lower bounds of their distances; the nearest is within ``reach``
    int candidate[{CANDIDATES}];
    float least[{CANDIDATES}];
    float reach = (float)bound * 1.000001f;
    const auto measure = [&]() {{
        for (int c = 0; c < candidates; ++c) {{
            if (least[c] > reach) continue;
            const int l = candidate[c] % {WIDTH}, found = tree.face.data[candidate[c]];
            const float* leaf = tree.corners.data + {9 * WIDTH} * size_t(candidate[c] / {WIDTH});
            double corner[3][3], edge[3][3], normal[3], squared = 0.0, lateral = 1e300, lengths = 0.0;
            for (int k = 0; k < 3; ++k)
                for (int i = 0; i < 3; ++i) corner[k][i] = (double)leaf[{WIDTH} * (3 * k + i) + l] - point[i];
            for (int k = 0; k < 3; ++k)
                for (int i = 0; i < 3; ++i) edge[k][i] = corner[(k + 1) % 3][i] - corner[k][i];
            for (int i = 0; i < 3; ++i) {{
                const int j = (i + 1) % 3, m = (i + 2) % 3;
                normal[i] = edge[0][j] * edge[1][m] - edge[0][m] * edge[1][j];
            }}
            for (int k = 0; k < 3; ++k) {{
                const double* a = corner[k];
                const double* b = corner[(k + 1) % 3];
                const double* e = edge[k];
                const double length = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
                double t = -(a[0] * e[0] + a[1] * e[1] + a[2] * e[2]) / (length > 1e-300 ? length : 1e-300);
                t = t > 0.0 ? (t < 1.0 ? t : 1.0) : 0.0;
                const double x = a[0] + t * e[0], y = a[1] + t * e[1], z = a[2] + t * e[2];
                const double to_edge = x * x + y * y + z * z;
                squared = k && squared < to_edge ? squared : to_edge;
                // beyond an edge: on the other side of the plane through it and the normal
                const double side = normal[0] * (a[1] * b[2] - a[2] * b[1])
                    + normal[1] * (a[2] * b[0] - a[0] * b[2]) + normal[2] * (a[0] * b[1] - a[1] * b[0]);
                lateral = side < lateral ? side : lateral;
                lengths += length;
            }}
            const double wide = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
            // a triangle without area has no inside, only a normal made of rounding
            if (lateral >= 0.0 && wide > {SLIVER} * lengths * lengths) {{
                const double height =
                    corner[0][0] * normal[0] + corner[0][1] * normal[1] + corner[0][2] * normal[2];
                const double to_plane = height * height / wide;
                squared = to_plane < squared ? to_plane : squared;
            }}
            if (squared < best || (squared == best && found < nearest)) {{
                best = squared;
                nearest = found;
            }}
        }}
        candidates = 0;
        const float nearer = (float)sqrt(best) * 1.000001f;
        reach = nearer < reach ? nearer : reach;
    }};
    while (count) {{
        const wp::uint64 next = stack[--count];
        const wp::uint32 bits = next >> 32;
        float squared_next;
        memcpy(&squared_next, &bits, 4);
        if (squared_next > reach * reach) continue;
        const int node = (int)(wp::uint32)next;
        if (node < 0) {{
            const float* leaf = tree.corners.data + {9 * WIDTH} * size_t(-1 - node);
            for (int base = 0; base < {WIDTH}; base += N) {{
                Floats low = Floats(0.0f), error;
                if (framed) {{
{_BY_FRAMES}                }} else {{
                    // most triangles of a leaf lie in boxes that are too far: in float32, as the leaf itself was
                    Floats outside = Floats(0.0f);
                    for (int i = 0; i < 3; ++i) {{
                        const Floats a = *(const Stored*)(leaf + {WIDTH} * i + base);
                        const Floats b = *(const Stored*)(leaf + {WIDTH} * (3 + i) + base);
                        const Floats c = *(const Stored*)(leaf + {WIDTH} * (6 + i) + base);
                        const Floats below = LOWEST(LOWEST(a, b), c) - at[i];
                        const Floats over = at[i] - HIGHEST(HIGHEST(a, b), c);
                        const Floats gap = HIGHEST(HIGHEST(below, over) - slack, Floats(0.0f));
                        outside += gap * gap;
                    }}
                    if (!LANES_OF(outside * 0.999998f <= reach * reach)) continue;
                    Floats corner[3][3], edge[3][3], normal[3], side_of = Floats(3e38f);
                    Floats size = Floats(rounded);
                    for (int k = 0; k < 3; ++k)
                        for (int i = 0; i < 3; ++i)
                            corner[k][i] = *(const Stored*)(leaf + {WIDTH} * (3 * k + i) + base) - at[i];
                    for (int k = 0; k < 3; ++k)
                        for (int i = 0; i < 3; ++i) {{
                            edge[k][i] = corner[(k + 1) % 3][i] - corner[k][i];
                            size += HIGHEST(edge[k][i], -edge[k][i]);
                        }}
                    for (int i = 0; i < 3; ++i) {{
                        const int j = (i + 1) % 3, m = (i + 2) % 3;
                        normal[i] = edge[0][j] * edge[1][m] - edge[0][m] * edge[1][j];
                    }}
                    for (int k = 0; k < 3; ++k) {{
                        const Floats* a = corner[k];
                        const Floats* b = corner[(k + 1) % 3];
                        const Floats* e = edge[k];
                        const Floats length = e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
                        Floats t = -(a[0] * e[0] + a[1] * e[1] + a[2] * e[2]) / HIGHEST(length, Floats(1e-36f));
                        t = LOWEST(HIGHEST(t, Floats(0.0f)), Floats(1.0f));
                        const Floats x = a[0] + t * e[0], y = a[1] + t * e[1], z = a[2] + t * e[2];
                        const Floats to_edge = x * x + y * y + z * z;
                        low = k ? LOWEST(low, to_edge) : to_edge;
                        side_of = LOWEST(side_of, normal[0] * (a[1] * b[2] - a[2] * b[1])
                            + normal[1] * (a[2] * b[0] - a[0] * b[2]) + normal[2] * (a[0] * b[1] - a[1] * b[0]));
                    }}
                    Floats height = corner[0][0] * normal[0];
                    height += corner[0][1] * normal[1] + corner[0][2] * normal[2];
                    const Floats wide = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
                    const Floats to_plane = height * height / HIGHEST(wide, Floats(1e-36f));
                    low = side_of >= Floats(0.0f) ? LOWEST(low, to_plane) : low;
                    // narrower triangles than a part in 10⁵ of their size may count as their edges alone
                    error = {ROUNDING} * size;
                }}
                const Floats most = reach * 1.00001f + error;
                for (unsigned int near = LANES_OF(low <= most * most); near; near &= near - 1) {{
                    const int l = FIRST_OF(near);
                    const float away = sqrtf(PICK(low, l)), wrong = PICK(error, l) + 1e-5f * away;
                    if (away - wrong > reach) continue;
                    if (candidates == {CANDIDATES}) measure();
                    least[candidates] = away - wrong;
                    candidate[candidates++] = {WIDTH} * (-1 - node) + base + l;
                    if (framed && away + wrong < reach) reach = away + wrong;
                }}
                if (!framed) measure();
            }}
        }} else {{
            const float* box = tree.boxes.data + {6 * WIDTH} * size_t(node);
            const int first = tree.child.data[node], step = first < 0 ? -1 : 1;
            const int begin = count;
            for (int base = 0; base < {WIDTH}; base += N) {{
                Floats squared = Floats(0.0f);
                for (int i = 0; i < 3; ++i) {{
                    const Floats below = *(const Stored*)(box + {WIDTH} * i + base) - at[i];
                    const Floats over = at[i] - *(const Stored*)(box + {3 * WIDTH} + {WIDTH} * i + base);
                    const Floats gap = HIGHEST(HIGHEST(below, over), Floats(0.0f));
                    squared += gap * gap;
                }}
                squared *= 0.999998f;  // float32 may have come out too large
                float away[N];
                for (int l = 0; l < N; ++l) away[l] = PICK(squared, l);
                for (unsigned int near = LANES_OF(squared <= reach * reach); near; near &= near - 1) {{
                    const int l = FIRST_OF(near);
                    wp::uint32 bits;
                    memcpy(&bits, away + l, 4);
                    const wp::uint64 entry = wp::uint64(bits) << 32 | (wp::uint32)(first + step * (base + l));
                    int place = count++;
                    for (; place > begin && stack[place - 1] < entry; --place) stack[place] = stack[place - 1];
                    stack[place] = entry;
                }}
            }}
        }}
    }}
    measure();
    return nearest;
"""
)
def nearest_triangle(tree: Tree, surface: int, point: wp.vec3d, bound: wp.float64) -> int:
    """Number of the triangle nearest to a point, -1 where none is nearer than ``bound``."""
