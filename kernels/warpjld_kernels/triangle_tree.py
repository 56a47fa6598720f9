"""Nearest triangle of a surface to a point, by a bounding volume hierarchy with eight children per node.

Eight boxes, or eight triangles, are measured at once. Boxes are compared in float32 with a margin, triangles in
float64, and of equally near triangles the one of the lowest number counts: where a search starts, and with which bound,
does not change what it finds.
"""

import warp as wp

from warpjld_kernels.lanes import prelude

WIDTH = 8
"""Children of a node, triangles of a leaf."""

SLIVER = 1e-20
"""Squared area by which a triangle counts as its edges alone, as a part of the sum of its squared edges, squared."""

ROUNDING = 2e-5
"""Error of a distance to a triangle in float32, as a part of the triangle's size and of the coordinates."""

WAITING = 128
"""Places on the stack of a search, of which every level of the tree takes seven."""


@wp.struct
class Tree:
    """Trees of some surfaces, one after another; see ``warpjld.grasp.triangle_tree``.

    ``boxes`` hold 48 numbers a node: the lower x, y and z of its eight children, then the upper. ``child`` is the first
    of a node's children, or −1 minus the first of its leaves. ``corners`` hold 72 numbers a leaf: x, y, z of the first
    corner of its eight triangles, of the second and of the third; ``face`` their numbers.
    """

    root: wp.array(dtype=wp.int32)
    child: wp.array(dtype=wp.int32)
    boxes: wp.array(dtype=float)
    corners: wp.array(dtype=float)
    face: wp.array(dtype=wp.int32)


@wp.func_native(
    prelude(WIDTH)
    + f"""
    // squared distance, whose bits are in the order of its values, and node: one word
    wp::uint64 stack[{WAITING}];
    stack[0] = (wp::uint32)tree.root.data[surface];
    int count = 1, nearest = -1;
    double best = bound * bound;
    const float at[3] = {{(float)point[0], (float)point[1], (float)point[2]}};
    const float rounded = fabsf(at[0]) + fabsf(at[1]) + fabsf(at[2]);
    while (count) {{
        const wp::uint64 next = stack[--count];
        const wp::uint32 bits = next >> 32;
        float squared_next;
        memcpy(&squared_next, &bits, 4);
        if (squared_next > best) continue;
        const int node = (int)(wp::uint32)next;
        if (node < 0) {{
            const float* leaf = tree.corners.data + {9 * WIDTH} * size_t(-1 - node);
            const int* number = tree.face.data + {WIDTH} * size_t(-1 - node);
            for (int base = 0; base < {WIDTH}; base += N) {{
                // most triangles of a leaf lie in boxes that are too far: in float32, as the leaf itself was
                Floats outside = Floats(0.0f);
                for (int i = 0; i < 3; ++i) {{
                    const Floats a = *(const Stored*)(leaf + {WIDTH} * i + base);
                    const Floats b = *(const Stored*)(leaf + {WIDTH} * (3 + i) + base);
                    const Floats c = *(const Stored*)(leaf + {WIDTH} * (6 + i) + base);
                    const Floats below = LOWEST(LOWEST(a, b), c) - at[i];
                    const Floats over = at[i] - HIGHEST(HIGHEST(a, b), c);
                    const Floats gap = HIGHEST(HIGHEST(below, over), Floats(0.0f));
                    outside += gap * gap;
                }}
                if (!LANES_OF(outside * 0.999998f <= (float)best)) continue;
                // distances in float32 leave few triangles that may be nearer
                unsigned int near = 0;
                {{
                    Floats corner[3][3], edge[3][3], normal[3], low = Floats(0.0f), side_of = Floats(3e38f);
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
                    const Floats most = (float)sqrt(best) * 1.00001f + {ROUNDING} * size;
                    near = LANES_OF(low <= most * most);
                }}
                for (; near; near &= near - 1) {{
                    const int l = base + FIRST_OF(near), found = number[l];
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
                for (unsigned int near = LANES_OF(squared <= (float)best); near; near &= near - 1) {{
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
    return nearest;
"""
)
def nearest_triangle(tree: Tree, surface: int, point: wp.vec3d, bound: wp.float64) -> int:
    """Number of the triangle nearest to a point, -1 where none is nearer than ``bound``."""
