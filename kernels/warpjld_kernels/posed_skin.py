"""Poses of one skin, each with a bounding volume hierarchy.

All hierarchies have the topology of the rest pose's (``warpjld.grasp.posed_skins``) and are refitted for a pose. Holes
of the skin are closed by fans, so that winding numbers follow from the crossings of a ray.
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.surface_distance import nearest_on_triangle
from warpjld_kernels.triangle_tree import WAITING, WIDTH, Tree, nearest_triangle

wp.set_module_options({**VECTORISED, "max_unroll": 1})


@wp.struct
class PosedSkins:
    """P poses of a skin of V vertices and as many more as it has holes, T triangles, fans included.

    ``tree`` holds ``nodes`` nodes and ``leaves`` leaves a pose; ``held`` are how many children a node has, ``inside``
    bits of the parts below each of them, shape (nodes, 8). ``part`` is the part of a triangle, −1 in a fan;
    ``rim`` the vertices round the holes, from ``first_rim`` on.
    """

    points: wp.array2d(dtype=wp.vec3)
    faces: wp.array(dtype=wp.vec3i)
    part: wp.array(dtype=wp.int32)
    rim: wp.array(dtype=wp.int32)
    first_rim: wp.array(dtype=wp.int32)
    tree: Tree
    nodes: int
    leaves: int
    held: wp.array(dtype=wp.int32)
    inside: wp.array(dtype=wp.uint64)
    margin: float


@wp.func_native(
    f"""
    const int W = {WIDTH};
    const wp::vec_t<3, float>* at = skins.points.data + size_t(pose) * skins.points.shape[1];
    const size_t points = skins.points.shape[1];
    float largest = 0.0f;
    for (size_t v = 0; v < points; ++v)
        for (int i = 0; i < 3; ++i) largest = largest < fabsf(at[v][i]) ? fabsf(at[v][i]) : largest;
    const float margin = skins.margin * largest;
    float* corners = skins.tree.corners.data + size_t(pose) * skins.leaves * 9 * W;
    float* boxes = skins.tree.boxes.data + size_t(pose) * skins.nodes * 6 * W;
    const int first_leaf = pose * skins.leaves, first_node = pose * skins.nodes;
    for (int node = skins.nodes - 1; node >= 0; --node) {{
        const int child = skins.tree.child.data[first_node + node];
        float* box = boxes + size_t(node) * 6 * W;
        for (int slot = 0; slot < skins.held.data[node]; ++slot) {{
            float low[3] = {{3e38f, 3e38f, 3e38f}}, high[3] = {{-3e38f, -3e38f, -3e38f}};
            if (child < 0) {{
                const int leaf = -1 - child - first_leaf + slot;
                const int* face = skins.tree.face.data + size_t(first_leaf + leaf) * W;
                float* out = corners + size_t(leaf) * 9 * W;
                for (int l = 0; l < W; ++l)
                    for (int k = 0; k < 3; ++k) {{
                        const wp::vec_t<3, float> x = at[skins.faces.data[face[l]][k]];
                        for (int i = 0; i < 3; ++i) {{
                            out[W * (3 * k + i) + l] = x[i];
                            low[i] = x[i] < low[i] ? x[i] : low[i];
                            high[i] = x[i] > high[i] ? x[i] : high[i];
                        }}
                    }}
                for (int i = 0; i < 3; ++i) {{ low[i] -= margin; high[i] += margin; }}
            }} else {{
                const int below = child - first_node + slot;
                const float* its = boxes + size_t(below) * 6 * W;
                for (int l = 0; l < skins.held.data[below]; ++l)
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
def fit_boxes(skins: PosedSkins, pose: int):
    """Fit the tree of a pose to its points."""


@wp.kernel
def fit_trees(
    # vertices on the stage, and the frame that they are wanted in
    vertices: wp.array2d(dtype=wp.vec3),
    position: wp.array(dtype=wp.vec3d),
    rotation: wp.array(dtype=wp.quatd),
    # in and out
    skins: PosedSkins,
):
    """Bring the vertices of a pose into a frame, close its holes, and fit its tree."""
    pose = wp.tid()
    count = vertices.shape[1]
    for v in range(count):
        skins.points[pose, v] = wp.vec3(
            wp.quat_rotate_inv(rotation[pose], wp.vec3d(vertices[pose, v]) - position[pose])
        )
    for hole in range(skins.first_rim.shape[0] - 1):
        first = skins.first_rim[hole]
        end = skins.first_rim[hole + 1]
        total = wp.vec3(0.0)
        for k in range(first, end):
            total += skins.points[pose, skins.rim[k]]
        skins.points[pose, count + hole] = total / float(end - first)
    fit_boxes(skins, pose)


@wp.func
def corner_of(skins: PosedSkins, pose: int, face: int, k: int) -> wp.vec3d:
    return wp.vec3d(skins.points[pose, skins.faces[face][k]])


@wp.func_native(
    prelude(WIDTH)
    + f"""
    const int W = {WIDTH};
    int stack[{WAITING}], count = 1, winds = 0;
    stack[0] = tree.root.data[pose];
    const double px = point[0], py = point[1], pz = point[2];
    const float at[3] = {{(float)px, (float)py, (float)pz}};  // boxes are wider than float32 rounds
    while (count) {{
        const int node = stack[--count];
        if (node < 0) {{
            const float* leaf = tree.corners.data + 9 * W * size_t(-1 - node);
            const int* number = tree.face.data + W * size_t(-1 - node);
            for (int l = 0; l < W; ++l) {{
                if (l && number[l] == number[l - 1]) break;  // the last leaf is filled up with its last triangle
                const float* c = leaf + l;
                if ((c[W] > py && c[4 * W] > py && c[7 * W] > py)
                    || (c[W] < py && c[4 * W] < py && c[7 * W] < py)) continue;
                double x[3], y[3], z[3];
                for (int k = 0; k < 3; ++k) {{
                    x[k] = (double)leaf[W * (3 * k) + l] - px;
                    y[k] = (double)leaf[W * (3 * k + 1) + l] - py;
                    z[k] = (double)leaf[W * (3 * k + 2) + l] - pz;
                }}
                // how often the triangle, seen along x, goes round the point; edges count the same from either side
                int round = 0;
                for (int k = 0; k < 3; ++k) {{
                    const int m = (k + 1) % 3;
                    if ((y[k] <= 0.0) == (y[m] <= 0.0)) continue;
                    const int a = y[k] <= 0.0 ? k : m, b = a == k ? m : k;
                    const double left = y[a] * z[b], right = z[a] * y[b];
                    if (left > right) round += a == k ? 1 : -1;
                }}
                if (!round) continue;
                const double u[3] = {{x[1] - x[0], y[1] - y[0], z[1] - z[0]}};
                const double v[3] = {{x[2] - x[0], y[2] - y[0], z[2] - z[0]}};
                const double nx = u[1] * v[2] - u[2] * v[1], ny = u[2] * v[0] - u[0] * v[2];
                const double nz = u[0] * v[1] - u[1] * v[0];
                const double height = x[0] * nx + y[0] * ny + z[0] * nz;
                if ((height > 0.0) == (nx > 0.0)) winds += round;
            }}
        }} else {{
            const float* box = tree.boxes.data + 6 * W * size_t(node);
            const int first = tree.child.data[node], step = first < 0 ? -1 : 1;
            for (int base = 0; base < W; base += N) {{
                Floats past = at[0] - *(const Stored*)(box + 3 * W + base);
                for (int i = 1; i < 3; ++i) {{
                    past = HIGHEST(past, *(const Stored*)(box + W * i + base) - at[i]);
                    past = HIGHEST(past, at[i] - *(const Stored*)(box + W * (3 + i) + base));
                }}
                for (unsigned int met = LANES_OF(past <= 0.0f); met; met &= met - 1)
                    stack[count++] = first + step * (base + FIRST_OF(met));
            }}
        }}
    }}
    return winds;
"""
)
def winds_along_x(tree: Tree, pose: int, point: wp.vec3d) -> int:
    """Winding number of a closed surface about a point: crossings of a ray along x, outward minus inward."""


@wp.kernel
def distances_to_skin(
    skins: PosedSkins,
    pose: int,
    # points in the frame of the trees
    points: wp.array(dtype=wp.vec3d),
    limit: wp.float64,
    # out
    distance_out: wp.array(dtype=wp.float64),
    face_out: wp.array(dtype=wp.int32),
):
    """Signed distances of points to one pose, its fans included; beyond the limit infinite, and no triangle."""
    n = wp.tid()
    face = nearest_triangle(skins.tree, pose, points[n], limit)
    distance = wp.float64(wp.inf)
    if face >= 0:
        found = nearest_on_triangle(
            corner_of(skins, pose, face, 0) - points[n],
            corner_of(skins, pose, face, 1) - points[n],
            corner_of(skins, pose, face, 2) - points[n],
        )
        distance = wp.length(wp.vec3d(found[0], found[1], found[2]))
    if winds_along_x(skins.tree, pose, points[n]) > 0:
        distance = -distance
    distance_out[n] = distance
    face_out[n] = face
