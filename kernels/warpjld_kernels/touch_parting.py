"""Separation of overlapping parts: vertices are moved to their side of the surface in which two parts shall meet."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.touch_normals import Normals, know_normal
from warpjld_kernels.touch_parts import FAR, Parts
from warpjld_kernels.touch_samples import Samples

wp.set_module_options({**VECTORISED, "max_unroll": 1})

_LANES = 8  # vertices computed at once

NEARLY = wp.constant(0.6)  # share of the deepest probe's depth above which vertices near a probe are tested too
HOLDS = wp.constant(4.0)  # factor of a pair's separated share in the weight of its planes, up to a weight of 1


@wp.struct
class Assigned:
    """The samples that act on the vertices of every part.

    Those of part k have the indices ``first[k]`` to ``last[k]`` in ``sample``, which holds indices of samples, and in
    ``ball``, which holds their points and squared radii [m, m²], shape (4, capacity), with padding at the end.
    ``lower`` and ``upper`` are the corners of the bounding box of the balls of a part's samples.
    """

    first: wp.array(dtype=wp.int32)
    last: wp.array(dtype=wp.int32)
    sample: wp.array(dtype=wp.int32)
    ball: wp.array2d(dtype=float)
    lower: wp.array(dtype=wp.vec3)
    upper: wp.array(dtype=wp.vec3)


@wp.kernel
def fade_pairs(
    parts: Parts,
    # by pairs of parts, before separation
    deepest: wp.array2d(dtype=float),
    full: float,
    none: float,
    just: float,
    # out
    shown_out: wp.array2d(dtype=float),
):
    """Share of the overlap of two parts that is separated: it fades out with the largest depth of them and of their
    neighbours. Pairs that did not overlap before separation get 0, with a smooth transition at small depths."""
    own, other = wp.tid()
    was = wp.max(deepest[own, other], deepest[other, own])
    shown = float(0.0)
    if was > 0.0:
        most = float(0.0)
        for i_own in range(parts.beside.shape[1]):
            a = parts.beside[own, i_own]
            for i_other in range(parts.beside.shape[1]):
                b = parts.beside[other, i_other]
                if a >= 0 and b >= 0:
                    most = wp.max(most, wp.max(deepest[a, b], deepest[b, a]))
        shown = wp.clamp((none - most) / (none - full), 0.0, 1.0) * wp.min(was / just, 1.0)
    shown_out[own, other] = shown


@wp.kernel
def choose_pair_weights(
    # by pairs of parts, from the probes
    deepest: wp.array2d(dtype=float),
    few: float,
    none: float,
    # out
    spaced_out: wp.array2d(dtype=float),
    others_out: wp.array2d(dtype=float),
    deep_out: wp.array2d(dtype=float),
):
    """Weights, for each pair of parts, of the samples of spaced vertices and of all other vertices; and the depth at a
    probe above which vertices near it are tested in any case.

    Pairs that lie too deep inside each other to be separated are not sampled further; where the overlap is large,
    spaced vertices suffice.
    """
    own, other = wp.tid()
    depth = wp.max(deepest[own, other], deepest[other, own])
    spaced_out[own, other] = wp.where(depth < none, 1.0, 0.0)
    others_out[own, other] = wp.clamp(2.0 - depth / few, 0.0, 1.0)
    deep_out[own, other] = NEARLY * deepest[own, other]


@wp.func
def acts_on(parts: Parts, own: int, other: int, side: int, k: int) -> int:
    """The k-th part that is a neighbour of either part of a sample, -1 for none; a neighbour of both counts once."""
    a = parts.beside[wp.where(side == 0, own, other), k]
    if a >= 0 and side == 1 and parts.apart[own, a] == 2:
        a = -1
    return a


@wp.kernel
def assign_samples(
    samples: Samples,
    # by pairs of parts: share of their overlap that is separated
    shown: wp.array2d(dtype=float),
    parts: Parts,
    # out
    assigned: Assigned,
):
    """List for every part the samples that act on its vertices, and the box that contains their radii: one thread."""
    most = wp.min(samples.count[0], samples.vertex.shape[0])
    names = parts.apart.shape[0]
    for a in range(names + 1):
        assigned.first[a] = 0
    for a in range(names):
        assigned.lower[a] = wp.vec3(FAR, FAR, FAR)
        assigned.upper[a] = wp.vec3(-FAR, -FAR, -FAR)
    # first pass: count the samples; those of part a at index a + 1
    for i in range(most):
        if shown[samples.own[i], samples.other[i]] > 0.0:
            for side in range(2):
                for k in range(parts.beside.shape[1]):
                    a = acts_on(parts, samples.own[i], samples.other[i], side, k)
                    if a >= 0:
                        assigned.first[a + 1] = assigned.first[a + 1] + 1
    for a in range(names):
        assigned.first[a + 1] = assigned.first[a] + assigned.first[a + 1]
        assigned.last[a] = assigned.first[a]
    for i in range(most):
        if shown[samples.own[i], samples.other[i]] > 0.0:
            radius = samples.radius[i]
            reach = wp.vec3(radius, radius, radius)
            p = samples.point[i]
            for side in range(2):
                for k in range(parts.beside.shape[1]):
                    a = acts_on(parts, samples.own[i], samples.other[i], side, k)
                    if a >= 0:
                        at = assigned.last[a]
                        if at < assigned.sample.shape[0]:
                            assigned.sample[at] = i
                            for c in range(3):
                                assigned.ball[c, at] = p[c]
                            assigned.ball[3, at] = radius * radius
                            assigned.last[a] = at + 1
                        assigned.lower[a] = wp.min(assigned.lower[a], p - reach)
                        assigned.upper[a] = wp.max(assigned.upper[a], p + reach)


@wp.func_native(
    prelude(_LANES)
    + """
    const size_t row = assigned.ball.shape[1];
    const float* ball = assigned.ball.data;
    for (int base = begin; base < end; base += N) {
        const Floats x = *(const Stored*)(ball + base) - point[0];
        const Floats y = *(const Stored*)(ball + row + base) - point[1];
        const Floats z = *(const Stored*)(ball + 2 * row + base) - point[2];
        unsigned int near = LANES_OF(x * x + y * y + z * z < *(const Stored*)(ball + 3 * row + base));
        if (end - base < N) near &= (1u << (end - base)) - 1u;
        if (near) return base + FIRST_OF(near);
    }
    return end;
"""
)
def next_near(assigned: Assigned, point: wp.vec3, begin: int, end: int) -> int:
    """First sample with an index from ``begin`` to ``end`` whose radius contains a point."""


@wp.kernel
def part_surfaces(
    # frame
    points: wp.array(dtype=wp.vec3),
    normals: Normals,
    samples: Samples,
    # by pairs of parts: share of their overlap that is separated
    shown: wp.array2d(dtype=float),
    assigned: Assigned,
    # surface
    parts: Parts,
    clearance: float,
    soft: float,
    stiffness: float,
    # out
    moved_out: wp.array(dtype=wp.vec3),
):
    """Displacement d of a vertex x by a regularised least squares fit to the planes of the samples around,

        min Σ w ((x − m + d) · n − c)² + ε d²  over samples whose plane x has passed,

    n towards the side the vertex is on, m a sample's point, c a clearance, w its weight times a kernel of its radius.
    """
    own = wp.tid()
    low = assigned.lower[own]
    high = assigned.upper[own]
    end = wp.where(assigned.last[own] > assigned.first[own], parts.first_member[own + 1], parts.first_member[own])
    for m in range(parts.first_member[own], end):
        v = parts.member[m]
        p = points[v]
        d = wp.vec3(0.0, 0.0, 0.0)
        outside = wp.min(p - low) < 0.0 or wp.min(high - p) < 0.0
        if not outside and parts.give[v] > 0.0:
            matrix = wp.mat33(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            right = wp.vec3(0.0, 0.0, 0.0)
            last = assigned.last[own]
            k = next_near(assigned, p, assigned.first[own], last)
            if k < last:
                know_normal(normals, points, v)
            facing = normals.unit[v]
            while k < last:
                i = assigned.sample[k]
                k = next_near(assigned, p, k + 1, last)
                r = p - samples.point[i]
                near = 1.0 - wp.length_sq(r) / (samples.radius[i] * samples.radius[i])
                if near > 0.0:
                    side = float(0.0)
                    # +1 on the side of the sample's own part, −1 on that of the part it lies inside
                    if parts.apart[own, samples.own[i]] == 2 and own != samples.other[i]:
                        side = 1.0
                    elif parts.apart[own, samples.other[i]] == 2 and own != samples.own[i]:
                        side = -1.0
                    # a part next to both: the side is the one its normal points away from, undecided where tangential
                    sure = float(1.0)
                    if side == 1.0 and parts.apart[own, samples.other[i]] == 2 and own != samples.own[i]:
                        away = wp.dot(facing, samples.normal[i])
                        side = wp.where(away < 0.0, 1.0, -1.0)
                        sure = wp.min(4.0 * wp.abs(away), 1.0)
                    n = side * samples.normal[i]
                    limit = samples.depth[i] / samples.ratio[i]
                    # limited to a little more than the sample's own depth
                    gap = clearance * limit * wp.sqrt(samples.counts[i])
                    missing = wp.min(gap - wp.dot(r, n), gap + 1.5 * samples.parted[i])
                    looks = wp.clamp(1.0 - 2.0 * wp.dot(facing, n), 0.0, 1.0)
                    if side != 0.0 and missing > 0.0 and looks > 0.0:
                        # the weight of a plane grows from zero as it is passed, so that displacements are continuous
                        passing = wp.min(missing / (soft * limit), 1.0)
                        # pairs that are not separated have no weight either
                        share = shown[samples.own[i], samples.other[i]]
                        weight = near * near * sure * looks * passing * samples.counts[i] * wp.min(HOLDS * share, 1.0)
                        matrix += weight * wp.outer(n, n)
                        right += weight * share * missing * n
            matrix += stiffness * wp.identity(n=3, dtype=float)
            d = wp.inverse(matrix) * right
        moved_out[v] = d


@wp.kernel
def move(
    before: wp.array(dtype=wp.vec3),
    moved: wp.array(dtype=wp.vec3),
    assigned: Assigned,
    parts: Parts,
    # in and out
    points: wp.array(dtype=wp.vec3),
    # out: distance of every vertex from where it was before any displacement [m]
    size_out: wp.array(dtype=float),
):
    """Add displacements of parts that have samples; vertices without one keep their exact values."""
    own = wp.tid()
    some = assigned.last[own] > assigned.first[own]
    for m in range(parts.first_member[own], parts.first_member[own + 1]):
        v = parts.member[m]
        if some and wp.length_sq(moved[v]) > 0.0:
            points[v] = points[v] + moved[v]
        size_out[v] = wp.length(points[v] - before[v])
