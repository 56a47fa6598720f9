"""Penetration depth of points below the meshes of parts, by bounding volume hierarchies with eight children per node.

The eight boxes of a node, or the eight triangles of a leaf, are tested at once (SIMD).
"""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.touch_normals import KNOW, Normals
from warpjld_kernels.touch_trees import FRAME, FRAMES, PartTrees
from warpjld_kernels.triangle_tree import WAITING, WIDTH

wp.set_module_options({**VECTORISED, "max_unroll": 1})

NEARLY = wp.constant(0.5)  # faces up to this share farther than the nearest contribute to the outward direction


@wp.struct
class Beneath:
    """Position of a point relative to the mesh of a part, as weighted means over near faces.

    ``least``: distance of the nearest face [m], negative if no face is in reach or the point is not behind it;
    ``depth`` below the surface [m]; outward ``normal``; ``sure``, the length of the mean normal, a measure of
    confidence; ``thick``, thickness of the flesh [m]; ``plain``, see ``Normals``; ``border``, 0 at the mesh's
    boundary.
    """

    least: float
    depth: float
    normal: wp.vec3
    sure: float
    thick: float
    plain: float
    border: float


_Found = wp.types.vector(length=8, dtype=float)

# squared_of: squared distances of a leaf's triangles, by their frames, and the nearest points' x and y in these, where
# wanted; away_from: squared distances of the boxes of a node's children
_NEAREST = """
    auto squared_of = [&](const float* frame, Floats* nearest) {
        Floats at[19], p[3];
        for (int k = 0; k < 19; ++k) at[k] = *(const Stored*)(frame + W * k);
        for (int i = 0; i < 3; ++i) p[i] = point[i] - at[i];
        const Floats x = p[0] * at[3] + p[1] * at[4] + p[2] * at[5], y = p[0] * at[6] + p[1] * at[7] + p[2] * at[8];
        const Floats z = p[0] * at[9] + p[1] * at[10] + p[2] * at[11], beyond = x - at[12], none = Floats(0.0f);
        const Floats first = LOWEST(HIGHEST(x, none), at[12]);
        const Floats along_second = beyond * at[13] + y * at[14], along_third = x * at[16] + y * at[17];
        const Floats second = LOWEST(HIGHEST(along_second, none), at[15]);
        const Floats third = LOWEST(HIGHEST(along_third, none), at[18]);
        const Floats over_second = beyond * at[14] - y * at[13], over_third = y * at[16] - x * at[17];
        const Floats to_first = (x - first) * (x - first) + y * y;
        const Floats to_second = (along_second - second) * (along_second - second) + over_second * over_second;
        const Floats to_third = (along_third - third) * (along_third - third) + over_third * over_third;
        const auto inside = HIGHEST(-y, HIGHEST(over_second, over_third)) <= none;
        const Floats to_edge = LOWEST(to_first, LOWEST(to_second, to_third));
        if (nearest) {
            const auto by_second = to_second <= to_third;
            const Floats rest_x = by_second ? at[12] + second * at[13] : third * at[16];
            const Floats rest_y = by_second ? second * at[14] : third * at[17];
            const auto by_first = to_first <= to_edge;
            nearest[0] = inside ? x : (by_first ? first : rest_x);
            nearest[1] = inside ? y : (by_first ? none : rest_y);
        }
        return z * z + (inside ? none : to_edge);
    };
    // offsets of these points from the point itself, and the weights of the triangle's corners there
    auto spread_of = [&](const float* frame, const Floats* nearest, Floats* foot, Floats* weight) {
        Floats at[22];
        for (int k = 0; k < 22; ++k) at[k] = *(const Stored*)(frame + W * k);
        for (int i = 0; i < 3; ++i) foot[i] = at[i] + nearest[0] * at[3 + i] + nearest[1] * at[6 + i] - point[i];
        const Floats none = Floats(0.0f), one = Floats(1.0f);
        weight[2] = LOWEST(nearest[1] * at[20], one);
        weight[1] = LOWEST(HIGHEST((nearest[0] - weight[2] * at[21]) * at[19], none), one - weight[2]);
        weight[0] = one - weight[1] - weight[2];
    };
    auto away_from = [&](const float* box) {
        Floats squared = Floats(0.0f);
        for (int i = 0; i < 3; ++i) {
            const Floats below = *(const Stored*)(box + W * i) - point[i];
            const Floats over = point[i] - *(const Stored*)(box + W * (3 + i));
            const Floats gap = HIGHEST(HIGHEST(below, over), Floats(0.0f));
            squared += gap * gap;
        }
        return squared;
    };
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
    + f"""
    const int W = {WIDTH};
"""
    + FRAMES
    + KNOW
    + _NEAREST
    + f"""
    auto frame_leaf = [&](size_t leaf) {{
        for (int base = 0; base < W; base += N)
            make_frames(trees.tree.corners.data + leaf * 9 * W + base, trees.frames.data + leaf * {FRAME} * W + base);
        const int* corner = trees.corner.data + leaf * 3 * W;
        for (int l = 0; l < W; ++l) {{
            float plain = 1.0f;
            for (int k = 0; k < 3; ++k) {{
                const int v = corner[W * k + l];
                know(v);
                plain = normals.plain.data[v] < plain ? normals.plain.data[v] : plain;
                for (int i = 0; i < 3; ++i)
                    trees.units.data[leaf * 9 * W + W * (3 * k + i) + l] = normals.unit.data[v][i];
            }}
            trees.plain.data[leaf * W + l] = plain;
        }}
        trees.framed.data[leaf] = 1;
    }};
    wp::vec_t<8, float> out;
    out[0] = -1.0f;
    // first pass: nearest triangle. Stack entries hold a squared distance (float bits, high word) and a node (low word)
    wp::uint64 stack[{WAITING}];
    int count = 1;
    stack[0] = (wp::uint32)trees.tree.root.data[part];
    int nearest = -1;
    float best = reach * reach;
    // begin at the leaf nearest to the point before: points follow one another along the skin
    const int before = trees.recent.data[part];
    if (before >= 0) {{
        for (int base = 0; base < W; base += N) {{
            const Floats squared = squared_of(trees.frames.data + size_t(before) * {FRAME} * W + base, nullptr);
            for (unsigned int near = LANES_OF(squared < best); near; near &= near - 1) {{
                const int l = FIRST_OF(near);
                if (!(PICK(squared, l) < best)) continue;
                best = PICK(squared, l);
                nearest = before * W + base + l;
            }}
        }}
    }}
    while (count) {{
        const wp::uint64 next = stack[--count];
        const wp::uint32 bits = next >> 32;
        float squared_next;
        memcpy(&squared_next, &bits, 4);
        if (squared_next > best) continue;
        const int node = (int)(wp::uint32)next;
        if (node < 0) {{
            const size_t leaf = -1 - node;
            if (!trees.framed.data[leaf]) frame_leaf(leaf);
            for (int base = 0; base < W; base += N) {{
                const Floats squared = squared_of(trees.frames.data + leaf * {FRAME} * W + base, nullptr);
                for (unsigned int near = LANES_OF(squared < best); near; near &= near - 1) {{
                    const int l = FIRST_OF(near);
                    if (!(PICK(squared, l) < best)) continue;
                    best = PICK(squared, l);
                    nearest = (int)(leaf * W) + base + l;
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
    if (nearest < 0) return out;
    trees.recent.data[part] = nearest / W;
    {{
        const size_t leaf = nearest / W;
        const int base = (nearest % W) / N * N, l = nearest % W - base;
        const float* frame = trees.frames.data + leaf * {FRAME} * W + base;
        Floats place[2], to[3], weight[3];
        squared_of(frame, place);
        spread_of(frame, place, to, weight);
        float normal[3] = {{}}, rim = 0.0f;
        for (int k = 0; k < 3; ++k) {{
            const float w = PICK(weight[k], l);
            rim += w * trees.border.data[leaf * 3 * W + W * k + base + l];
            for (int i = 0; i < 3; ++i) normal[i] += w * trees.units.data[leaf * 9 * W + W * (3 * k + i) + base + l];
        }}
        const float behind = PICK(to[0], l) * normal[0] + PICK(to[1], l) * normal[1] + PICK(to[2], l) * normal[2];
        // next to the mesh's boundary the side is uncertain
        if (behind <= 0.0f && rim >= 0.5f) return out;
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
            if (!trees.framed.data[leaf]) frame_leaf(leaf);
            for (int base = 0; base < W; base += N) {{
                const float* frame = trees.frames.data + leaf * {FRAME} * W + base;
                Floats place[2], foot[3], weight[3], n[3];
                const Floats squared = squared_of(frame, place);
                if (!LANES_OF(squared < within)) continue;
                spread_of(frame, place, foot, weight);
                for (int i = 0; i < 3; ++i) n[i] = Floats(0.0f);
                Floats border = Floats(0.0f), thick = Floats(0.0f);
                for (int k = 0; k < 3; ++k) {{
                    border += weight[k] * *(const Stored*)(trees.border.data + leaf * 3 * W + W * k + base);
                    thick += weight[k] * *(const Stored*)(trees.thickness.data + leaf * 3 * W + W * k + base);
                    for (int i = 0; i < 3; ++i)
                        n[i] += weight[k] * *(const Stored*)(trees.units.data + leaf * 9 * W + W * (3 * k + i) + base);
                }}
                Floats near = HIGHEST(Floats(1.0f) - (ROOT(squared) - least) / width, Floats(0.0f));
                near *= near * *(const Stored*)(frame + 22 * W) * *(const Stored*)(trees.real.data + leaf * W + base);
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
    trees: PartTrees,
    normals: Normals,
    points: wp.array(dtype=wp.vec3),
    part: int,
    point: wp.vec3,
    reach: float,
    nearly: float,
    narrowest: float,
) -> _Found: ...


@wp.func
def beneath(
    trees: PartTrees,
    normals: Normals,
    points: wp.array(dtype=wp.vec3),
    part: int,
    point: wp.vec3,
    reach: float,
    narrowest: float,
) -> Beneath:
    """Weighted means over the faces of a part whose distance from a point is close to that of the nearest face.

    The closest face alone would make the outward direction discontinuous where another face becomes the closest. In the
    middle of the flesh the directions cancel: the length of their mean is a measure of confidence.

    Args:
        points: Positions of the surface's vertices [m], from which normals are made where they are not known.
        reach: Largest distance of the nearest face [m].
        narrowest: Least width of the distance interval over which weights fall to 0 [m].
    """
    found = mean_of_near_faces(trees, normals, points, part, point, reach, NEARLY, narrowest)
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
