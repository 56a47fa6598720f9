"""Poses of one skin, each with a tree of boxes: how deep points are in them, which of their triangles cross.

The trees have one shape, that of the rest pose (``warpjld.grasp.posed_skins``); a pose only fits the boxes anew. Holes
of the skin are closed by fans, so that a ray from any point meets the skin as often as it winds round the point.
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
    """How often a closed surface winds round a point: the crossings of a ray along x, outwards less inwards."""


@wp.struct
class PointGroups:
    """Points in groups of groups, each before those it holds.

    A group's points are at most ``radius`` from its ``centre``, numbers ``first`` to ``end``; ``after`` is the next
    group that it does not hold. A group with ``after`` one more than its own number holds no others.
    """

    points: wp.array(dtype=wp.vec3d)
    centre: wp.array(dtype=wp.vec3d)
    radius: wp.array(dtype=wp.float64)
    first: wp.array(dtype=wp.int32)
    end: wp.array(dtype=wp.int32)
    after: wp.array(dtype=wp.int32)


@wp.func_native(
    f"""
    const int W = {WIDTH}, parts = gaps.shape[1];
    const double* known = gaps.data + size_t(pose) * parts;
    float* out = reach.data + size_t(pose) * reach.shape[1];
    for (int slot = 0; slot < skins.nodes * W; ++slot) {{
        double most = 0.0;
        if (outside)
            for (int k = 0; k < parts; ++k)
                if (skins.inside.data[slot] >> (k < 63 ? k : 63) & 1) {{
                    const double gap = known[k] < limit ? known[k] : limit;
                    most = gap > most ? gap : most;
                }}
        out[slot] = (float)most;
    }}
"""
)
def set_reach(
    skins: PosedSkins,
    pose: int,
    outside: bool,
    limit: wp.float64,
    gaps: wp.array2d(dtype=wp.float64),
    reach: wp.array2d(dtype=float),
):
    """How near a point outside must be to what lies below each box to bring a gap down."""


@wp.func_native(
    prelude(WIDTH)
    + f"""
    const int W = {WIDTH};
    int stack[{WAITING}], count = 1;
    float allowed[{WAITING}];
    const int first_node = pose * skins.nodes;
    stack[0] = skins.tree.root.data[pose];
    const float at[3] = {{(float)point[0], (float)point[1], (float)point[2]}};
    // boxes, distances and this point are rounded to float32
    const float more = (float)radius * 1.000002f + 4.0f * skins.margin * (fabsf(at[0]) + fabsf(at[1]) + fabsf(at[2]));
    const float* of_pose = reach.data + size_t(pose) * reach.shape[1];
    while (count) {{
        const int node = stack[--count];
        if (node < 0) {{
            const float room = allowed[count];
            const float* leaf = skins.tree.corners.data + 9 * W * size_t(-1 - node);
            for (int base = 0; base < W; base += N) {{
                Floats squared = Floats(0.0f);
                for (int i = 0; i < 3; ++i) {{
                    const Floats a = *(const Stored*)(leaf + W * i + base);
                    const Floats b = *(const Stored*)(leaf + W * (3 + i) + base);
                    const Floats c = *(const Stored*)(leaf + W * (6 + i) + base);
                    const Floats gap = HIGHEST(
                        HIGHEST(LOWEST(LOWEST(a, b), c) - at[i], at[i] - HIGHEST(HIGHEST(a, b), c)), Floats(0.0f));
                    squared += gap * gap;
                }}
                if (LANES_OF(squared * 0.999998f <= room * room)) return true;
            }}
        }} else {{
            const float* box = skins.tree.boxes.data + 6 * W * size_t(node);
            const float* own = of_pose + W * size_t(node - first_node);
            const int first = skins.tree.child.data[node], step = first < 0 ? -1 : 1;
            for (int base = 0; base < W; base += N) {{
                Floats squared = Floats(0.0f);
                for (int i = 0; i < 3; ++i) {{
                    const Floats below = *(const Stored*)(box + W * i + base) - at[i];
                    const Floats over = at[i] - *(const Stored*)(box + 3 * W + W * i + base);
                    const Floats gap = HIGHEST(HIGHEST(below, over), Floats(0.0f));
                    squared += gap * gap;
                }}
                const Floats room = *(const Stored*)(own + base) * 1.000002f + more;
                for (unsigned int met = LANES_OF(squared * 0.999998f <= room * room); met; met &= met - 1) {{
                    const int l = base + FIRST_OF(met);
                    allowed[count] = own[l] * 1.000002f + more;
                    stack[count++] = first + step * l;
                }}
            }}
        }}
    }}
    return false;
"""
)
def may_matter(
    skins: PosedSkins, reach: wp.array2d(dtype=float), pose: int, point: wp.vec3d, radius: wp.float64
) -> bool:
    """Whether a point within a ball may be near enough to a posed skin; if not, the ball is on one side of it."""


@wp.func
def lower_gap(
    skins: PosedSkins,
    pose: int,
    p: wp.vec3d,
    inside: bool,
    limit: wp.float64,
    part_of_face: wp.array(dtype=wp.int32),
    gaps: wp.array2d(dtype=wp.float64),
):
    """Bring the gap of the part that is nearest to a point down to its signed distance."""
    face = nearest_triangle(skins.tree, pose, p, limit)
    if face >= 0:
        part = part_of_face[face]
        if part >= 0:
            found = nearest_on_triangle(
                corner_of(skins, pose, face, 0) - p,
                corner_of(skins, pose, face, 1) - p,
                corner_of(skins, pose, face, 2) - p,
            )
            distance = wp.float64(float(wp.length(wp.vec3d(found[0], found[1], found[2]))))
            if inside:
                distance = -distance
            gaps[pose, part] = wp.min(gaps[pose, part], distance)


@wp.kernel
def points_in_skins(
    skins: PosedSkins,
    # points in the frame of the trees
    groups: PointGroups,
    near: wp.float64,
    limit: wp.float64,
    # whether points outside count as well
    outside: bool,
    part_of_face: wp.array(dtype=wp.int32),
    # scratch
    reach: wp.array2d(dtype=float),
    # in and out
    gaps: wp.array2d(dtype=wp.float64),
):
    """Smallest signed distance of points to a pose's skin by the part of the nearest triangle.

    Points farther than ``near`` from the skin's box, and distances beyond ``limit``, do not count. Groups that cannot
    bring a gap down are passed over.
    """
    pose = wp.tid()
    zero = wp.float64(0.0)
    low = wp.vec3d(skins.points[pose, 0])
    high = low
    for v in range(skins.points.shape[1]):
        x = wp.vec3d(skins.points[pose, v])
        low = wp.min(low, x)
        high = wp.max(high, x)
    set_reach(skins, pose, outside, limit, gaps, reach)
    group = int(0)
    all_inside = int(0)  # groups before this one are
    while group < groups.centre.shape[0]:
        following = group + 1
        holds_others = groups.after[group] > following
        if group >= all_inside:
            c = groups.centre[group]
            radius = groups.radius[group]
            away = wp.max(wp.max(wp.max(low - c, c - high), wp.vec3d(zero)))
            if away - radius > near:
                following = groups.after[group]
                holds_others = True
            elif not may_matter(skins, reach, pose, c, radius):
                inside = away <= zero
                if inside:
                    inside = winds_along_x(skins.tree, pose, c) > 0
                if inside:
                    all_inside = groups.after[group]
                else:
                    following = groups.after[group]
                    holds_others = True
        if not holds_others:
            for n in range(groups.first[group], groups.end[group]):
                p = groups.points[n]
                away_p = wp.max(wp.max(wp.max(low - p, p - high), wp.vec3d(zero)))
                if away_p <= near:
                    inside_p = group < all_inside
                    if not inside_p and away_p <= zero:
                        inside_p = winds_along_x(skins.tree, pose, p) > 0
                    counts = inside_p
                    if not counts and outside:
                        counts = may_matter(skins, reach, pose, p, zero)
                    if counts:
                        lower_gap(skins, pose, p, inside_p, limit, part_of_face, gaps)
        group = following


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
    """Count the triangles of other parts that cross one, by part, where no more than a corner is common."""


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
    """Pairs of triangles that cross between one part and others of a posed skin."""
    task = wp.tid()
    part = part_of[task]
    for n in range(first_of_part[part], first_of_part[part + 1]):
        crossings_of(skins, pose_of[task], by_part[n], others[task], scale, task, counts_out)
