"""Narrow phase of skin contact: vertices of one frame that lie inside the meshes of other parts."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.touch_beneath import beneath
from warpjld_kernels.touch_normals import Normals, know_normal
from warpjld_kernels.touch_parts import BESIDE, FAR, Bounds, Parts, within
from warpjld_kernels.touch_trees import PartTrees

wp.set_module_options({**VECTORISED, "max_unroll": 1})

UNSURE = wp.constant(0.0)  # length of the mean outward direction up to which its confidence is 0
SURE = wp.constant(0.9)  # length from which its confidence is 1


@wp.struct
class Samples:
    """Vertices that lie inside another part.

    By sample: index of the ``vertex``, its ``own`` part and the ``other``; a ``point`` of the surface in which both
    shall meet, and that surface's ``normal``, towards the other part's outside; penetration ``depth`` [m], the depth
    ``parted`` that is resolved [m], the weight ``counts``, the ``radius`` over which it acts [m], and the ``ratio`` of
    its depth to what skin can yield. ``count`` is their number.
    """

    count: wp.array(dtype=wp.int32)
    vertex: wp.array(dtype=wp.int32)
    own: wp.array(dtype=wp.int32)
    other: wp.array(dtype=wp.int32)
    point: wp.array(dtype=wp.vec3)
    normal: wp.array(dtype=wp.vec3)
    depth: wp.array(dtype=float)
    parted: wp.array(dtype=float)
    counts: wp.array(dtype=float)
    radius: wp.array(dtype=float)
    ratio: wp.array(dtype=float)


@wp.func
def beside_bones(joints: wp.array(dtype=wp.vec3), parts: Parts, k: int, p: wp.vec3) -> float:
    """1 for a point within the largest distance of a part's mesh from its bones, falling to 0 at a tenth more; 1 where
    a part has no bones."""
    first = parts.first_bone[k]
    last = parts.first_bone[k + 1]
    least = wp.where(first == last, 0.0, FAR)
    for i in range(first, last):
        a = joints[parts.bone[i][0]]
        along = joints[parts.bone[i][1]] - a
        r = p - a
        t = wp.clamp(wp.dot(r, along) / wp.max(wp.length_sq(along), 1.0e-30), 0.0, 1.0)
        # unknown joints are NaN, and do not exclude the point
        square = wp.length_sq(r - t * along)
        least = wp.where(wp.isfinite(square), wp.min(least, wp.sqrt(square)), 0.0)
    return wp.clamp(11.0 - 10.0 * least / wp.max(parts.around[k], 1.0e-30), 0.0, 1.0)


@wp.kernel
def find_samples(
    # vertices that are tested, those of one group, and weight of their samples by pairs of parts; at weight 0 they are
    # not tested
    candidate: wp.array2d(dtype=wp.int32),
    number: wp.array(dtype=wp.int32),
    group: int,
    pair_weight: wp.array2d(dtype=float),
    # nearest probe of every vertex, tested before, and by pairs of parts the depth of a probe above which the vertex is
    # tested even at weight 0, so that the deepest one is found
    beside: wp.array(dtype=wp.int32),
    deep_enough: wp.array2d(dtype=float),
    # frame
    points: wp.array(dtype=wp.vec3),
    normals: Normals,
    trees: PartTrees,
    bounds: Bounds,
    count: wp.array(dtype=wp.int32),
    others: wp.array2d(dtype=wp.int32),
    joints: wp.array(dtype=wp.vec3),
    # surface
    parts: Parts,
    share: float,
    soft: float,
    none: float,
    # out
    ratio_out: wp.array(dtype=float),
    deepest_out: wp.array2d(dtype=float),
    samples: Samples,
):
    """Find vertices inside the mesh of another part: behind the interpolated normal at the closest point.

    Surfaces with the same orientation are not in contact, nor are points whose closest point lies on the boundary of a
    mesh, where it is open. One thread.
    """
    for c in range(number[group]):
        v = candidate[group, c]
        p = points[v]
        own = parts.part[v]
        around = ratio_out[beside[v]]
        deep = float(0.0)
        for i in range(count[own]):
            k = others[own, i]
            # points beneath the open end of a mesh may be outside its bounds: fade out, for continuity
            near = within(bounds, k, p, BESIDE * parts.around[k])
            if near > 0.0 and (pair_weight[own, k] > 0.0 or around > deep_enough[own, k]):
                near *= beside_bones(joints, parts, k, p)
            if near > 0.0 and (pair_weight[own, k] > 0.0 or around > deep_enough[own, k]):
                reach = wp.max(2.0 * parts.thickness[v], parts.around[k])
                over = beneath(trees, normals, points, k, p, reach, 1.0e-3 * parts.around[k] + 1.0e-9)
                least = over.least
                if least >= 0.0:
                    near *= wp.min(5.0 - 5.0 * least / reach, 1.0)
                    if over.depth > 0.0:
                        know_normal(normals, points, v)
                        n = over.normal
                        sure = wp.clamp((over.sure - UNSURE) / (SURE - UNSURE), 0.0, 1.0)
                        facing = wp.clamp(-2.0 * wp.dot(n, normals.unit[v]), parts.facing, 1.0)
                        plain = wp.min(normals.plain[v], over.plain)
                        inside = near * wp.min(over.depth, least) * plain * over.border
                        depth = inside * facing - parts.at_rest[v]
                        parted = wp.max(inside * facing * sure - parts.at_rest[v], 0.0)
                        limit = share * wp.min(over.thick, parts.thickness[v])
                        # regardless of orientation, and larger where the outward direction is uncertain
                        if inside > parts.at_rest[v]:
                            ratio = (inside - parts.at_rest[v]) / limit
                            ratio += (1.0 - sure) * none * wp.min(ratio, 1.0)
                            deep = wp.max(deep, ratio)
                            wp.atomic_max(deepest_out, own, k, ratio)
                        if depth > 0.0:
                            yields = parts.give[v] / wp.max(parts.give[v] + parts.give_of[k], 1.0e-12)
                            at = wp.atomic_add(samples.count, 0, 1)
                            if at < samples.vertex.shape[0]:
                                samples.vertex[at] = v
                                samples.own[at] = own
                                samples.other[at] = k
                                samples.point[at] = p + yields * parted * n
                                samples.normal[at] = n
                                samples.depth[at] = depth
                                samples.parted[at] = parted
                                samples.counts[at] = pair_weight[own, k] * wp.min(parted / (soft * limit), 1.0)
                                samples.radius[at] = wp.max(wp.min(over.thick, parts.thickness[v]), 1.2 * parts.edge[v])
                                samples.ratio[at] = depth / limit
        ratio_out[v] = deep
