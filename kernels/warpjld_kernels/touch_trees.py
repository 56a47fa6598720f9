"""Bounding volume hierarchies of the parts' triangles, with eight children per node, refitted in every frame.

The trees have the layout of ``warpjld.grasp.triangle_tree``, one per part.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.triangle_tree import WIDTH, Tree

wp.set_module_options({**VECTORISED, "max_unroll": 1})

FRAME = 23
"""Numbers of a triangle's frame: the first corner; unit vectors x along the first edge, y across it in the plane, and z
normal; the edge's length; direction in x and y and length of the second edge, from the second corner, and of the third,
from the first corner; inverses of the first edge's length and of the height y of the third corner, 0 where those are 0;
the third corner's x; and twice the area."""

FRAMES = f"""
    auto make_frames = [&](const float* leaf, float* out) {{
        Floats a[3];
        for (int i = 0; i < 3; ++i) a[i] = *(const Stored*)(leaf + W * i);
        Floats b[3], c[3], x[3], y[3];
        for (int i = 0; i < 3; ++i) {{
            b[i] = *(const Stored*)(leaf + W * (3 + i)) - a[i];
            c[i] = *(const Stored*)(leaf + W * (6 + i)) - a[i];
        }}
        // edges shorter than this [m] have no direction of their own: any unit vector does
        const Floats least = Floats(1e-30f), tiny = Floats(1e-14f);
        const Floats side = ROOT(b[0] * b[0] + b[1] * b[1] + b[2] * b[2]);
        const Floats third = ROOT(HIGHEST(c[0] * c[0] + c[1] * c[1] + c[2] * c[2], least));
        const auto point = side <= 1e-6f * third;
        const Floats inverse = Floats(1.0f) / (point ? third : side);
        const auto nothing = HIGHEST(side, third) <= tiny;
        for (int i = 0; i < 3; ++i) x[i] = (point ? c[i] : b[i]) * inverse;
        x[0] = nothing ? Floats(1.0f) : x[0];
        // a triangle without area has any axis across, in which it has no extent
        const auto across = HIGHEST(x[0], -x[0]) < Floats(0.6f);
        const Floats zero = Floats(0.0f), one = Floats(1.0f);
        const Floats other[3] = {{across ? one : zero, across ? zero : one, zero}};
        const Floats along = c[0] * x[0] + c[1] * x[1] + c[2] * x[2];
        const Floats aside = other[0] * x[0] + other[1] * x[1] + other[2] * x[2];
        for (int i = 0; i < 3; ++i) y[i] = c[i] - along * x[i];
        Floats high = y[0] * y[0] + y[1] * y[1] + y[2] * y[2];
        const auto thin = high <= 1e-12f * third * third;
        for (int i = 0; i < 3; ++i) y[i] = thin ? other[i] - aside * x[i] : y[i];
        const Floats wide = ROOT(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
        for (int i = 0; i < 3; ++i) y[i] /= wide;
        high = thin ? Floats(0.0f) : wide;
        const Floats back = along - side, second = ROOT(HIGHEST(back * back + high * high, least));
        const Floats second_x = second <= tiny ? one : back / second, second_y = second <= tiny ? zero : high / second;
        const Floats third_x = third <= tiny ? one : along / third, third_y = third <= tiny ? zero : high / third;
        const Floats numbers[{FRAME}] = {{
            a[0], a[1], a[2], x[0], x[1], x[2], y[0], y[1], y[2],
            x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0],
            side, second_x, second_y, second, third_x, third_y, third,
            point ? Floats(0.0f) : inverse, thin ? Floats(0.0f) : Floats(1.0f) / high, along, side * high}};
        for (int k = 0; k < {FRAME}; ++k) *(Stored*)(out + W * k) = numbers[k];
    }};
"""
"""C++ of ``make_frames``: frames of a leaf's triangles from their corners, in single precision, since offsets from a
corner are short. They are made, and normals copied, when a query first comes to a leaf: most are never visited."""


@wp.struct
class PartTrees:
    """The triangles of P parts.

    ``tree`` has one surface per part; the nodes of part k are ``first_node[k]`` to ``first_node[k + 1]`` (exclusive),
    and ``held`` is the count of children of each node. The other arrays hold, for each leaf, the values of its eight
    triangles: ``corner``, vertex indices of the three corners; ``units``, unit normals of the corners, in the layout of
    the tree's corners; ``border``, 0 for corners on the mesh's boundary, else 1; ``thickness`` of the flesh at the
    corners [m]; ``plain``, the least of the corners' in ``Normals``; ``real``, 0 for padding triangles in a part's
    last leaf, else 1; ``frames``, the triangles' own axes, from which distances take a quarter of the operations, and
    ``framed``, by leaf, whether these, ``units`` and ``plain`` are made. ``recent`` is, by part, the leaf nearest to
    the point measured last, or -1.
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
    frames: wp.array(dtype=float)
    framed: wp.array(dtype=wp.int32)
    recent: wp.array(dtype=wp.int32)


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
                for (int l = 0; l < W; ++l)
                    for (int k = 0; k < 3; ++k)
                        for (int i = 0; i < 3; ++i) {{
                            const float x = points.data[corner[W * k + l]][i];
                            out[W * (3 * k + i) + l] = x;
                            low[i] = x < low[i] ? x : low[i];
                            high[i] = x > high[i] ? x : high[i];
                        }}
                trees.framed.data[leaf] = 0;
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
def fit_tree(trees: PartTrees, part: int, points: wp.array(dtype=wp.vec3)):
    """Copy positions of a part's corners into its leaves, and refit its boxes."""


@wp.kernel
def fit_trees(
    wanted: wp.array(dtype=wp.int32),
    points: wp.array(dtype=wp.vec3),
    # in and out
    trees: PartTrees,
):
    """Refit the trees of the parts whose ``wanted`` is not 0."""
    k = wp.tid()
    if wanted[k] != 0:
        fit_tree(trees, k, points)
        trees.recent[k] = -1
