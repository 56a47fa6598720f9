"""Smallest signed distances of hierarchically grouped points to poses of a skin."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.posed_skin import PosedSkins, corner_of, winds_along_x
from warpjld_kernels.surface_distance import nearest_on_triangle
from warpjld_kernels.triangle_tree import WAITING, WIDTH, nearest_triangle

wp.set_module_options({**VECTORISED, "max_unroll": 1})


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
    """Distance below which a point outside can reduce a gap, for each box of the tree."""


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
    """Whether a ball may contain points close enough to a posed skin; if not, it lies on one side of the skin."""


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
    """Reduce the gap of the part closest to a point to the point's signed distance, if that is smaller."""
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
