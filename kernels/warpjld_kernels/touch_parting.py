"""Vertices moved to their own side of the surface in which two parts are to meet."""

import warp as wp

from warpjld_kernels.touch_parts import FAR, Parts
from warpjld_kernels.touch_samples import Samples

wp.set_module_options({"enable_backward": False})

NEARLY = wp.constant(0.6)  # of the deepest: what is that deep may have it near
HOLDS = wp.constant(4.0)  # how soon what is parted in part holds as what is parted in full does


@wp.kernel
def fade_pairs(
    parts: Parts,
    # by pairs of parts, before anything was parted
    deepest: wp.array2d(dtype=float),
    full: float,
    none: float,
    just: float,
    # out
    shown_out: wp.array2d(dtype=float),
):
    """How much of the overlaps of two parts is parted, by how deep they and those next to them lie in one another at
    most. What was no overlap before anything was parted is none later: what just was one counts for little."""
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
def choose_heard(
    # by pairs of parts, as far as a few vertices have told
    deepest: wp.array2d(dtype=float),
    few: float,
    none: float,
    # out
    some_out: wp.array2d(dtype=float),
    all_out: wp.array2d(dtype=float),
    deep_out: wp.array2d(dtype=float),
):
    """How much vertices count that are some way apart, and all the others; and what is nearly as deep as the deepest.

    What lies too deep in one another for anything to be parted need not be asked further; where much lies inside, what
    is some way apart says enough.
    """
    own, other = wp.tid()
    depth = wp.max(deepest[own, other], deepest[other, own])
    some_out[own, other] = wp.where(depth < none, 1.0, 0.0)
    all_out[own, other] = wp.clamp(2.0 - depth / few, 0.0, 1.0)
    deep_out[own, other] = NEARLY * deepest[own, other]


@wp.kernel
def heed_samples(
    samples: Samples,
    # by pairs of parts: how much of their overlaps is parted
    shown: wp.array2d(dtype=float),
    parts: Parts,
    # out
    count_out: wp.array(dtype=wp.int32),
    list_out: wp.array2d(dtype=wp.int32),
    lower_out: wp.array(dtype=wp.vec3),
    upper_out: wp.array(dtype=wp.vec3),
):
    """Of every part the samples that its vertices may heed, and the box in which they do."""
    i = wp.tid()
    own = samples.own[i]
    other = samples.other[i]
    if shown[own, other] == 0.0:
        return
    reach = wp.vec3(samples.radius[i], samples.radius[i], samples.radius[i])
    for side in range(2):
        for k in range(parts.beside.shape[1]):
            a = parts.beside[wp.where(side == 0, own, other), k]
            # what is beside both heeds it once
            if a >= 0 and (side == 0 or parts.apart[own, a] != 2):
                at = wp.atomic_add(count_out, a, 1)
                if at < list_out.shape[1]:
                    list_out[a, at] = i
                wp.atomic_min(lower_out, a, samples.point[i] - reach)
                wp.atomic_max(upper_out, a, samples.point[i] + reach)


@wp.kernel
def part_surfaces(
    # frame
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    samples: Samples,
    # by pairs of parts: how much of their overlaps is parted
    shown: wp.array2d(dtype=float),
    # of every part
    count: wp.array(dtype=wp.int32),
    heeded: wp.array2d(dtype=wp.int32),
    lower: wp.array(dtype=wp.vec3),
    upper: wp.array(dtype=wp.vec3),
    # surface
    parts: Parts,
    clearance: float,
    soft: float,
    stiffness: float,
    # out
    moved_out: wp.array(dtype=wp.vec3),
):
    """Displacement d of a vertex x that least violates the planes of the samples around,

        Σ w ((x − m + d) · n − c)² + ε d²  →  least, over samples whose plane x has passed,

    n towards the side the vertex is on, m a sample's point, c a clearance, w its weight times a kernel of its radius.
    """
    v = wp.tid()
    p = points[v]
    own = parts.part[v]
    low = lower[own]
    high = upper[own]
    d = wp.vec3(0.0, 0.0, 0.0)
    outside = p[0] < low[0] or p[1] < low[1] or p[2] < low[2] or p[0] > high[0] or p[1] > high[1] or p[2] > high[2]
    if not outside and parts.give[v] > 0.0:
        facing = wp.normalize(normals[v])
        matrix = wp.mat33(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        right = wp.vec3(0.0, 0.0, 0.0)
        for k in range(wp.min(count[own], heeded.shape[1])):
            i = heeded[own, k]
            r = p - samples.point[i]
            near = 1.0 - wp.length_sq(r) / (samples.radius[i] * samples.radius[i])
            if near > 0.0:
                side = float(0.0)
                # on the side of the vertex that was found, or of the part that it was found in
                if parts.apart[own, samples.own[i]] == 2 and own != samples.other[i]:
                    side = 1.0
                elif parts.apart[own, samples.other[i]] == 2 and own != samples.own[i]:
                    side = -1.0
                # a part next to both is on the side that it looks away from, and on none where it looks along
                sure = float(1.0)
                if side == 1.0 and parts.apart[own, samples.other[i]] == 2 and own != samples.own[i]:
                    away = wp.dot(facing, samples.normal[i])
                    side = wp.where(away < 0.0, 1.0, -1.0)
                    sure = wp.min(4.0 * wp.abs(away), 1.0)
                n = side * samples.normal[i]
                limit = samples.depth[i] / samples.ratio[i]
                # what is much farther beyond the plane than that vertex was is not beside it
                gap = clearance * limit * wp.sqrt(samples.counts[i])
                missing = wp.min(gap - wp.dot(r, n), gap + 1.5 * samples.parted[i])
                looks = wp.clamp(1.0 - 2.0 * wp.dot(facing, n), 0.0, 1.0)
                if side != 0.0 and missing > 0.0 and looks > 0.0:
                    # a plane that is just being passed counts for nothing yet: else all would jump
                    passing = wp.min(missing / (soft * limit), 1.0)
                    # what is not parted at all holds nothing back either
                    share = shown[samples.own[i], samples.other[i]]
                    weight = near * near * sure * looks * passing * samples.counts[i] * wp.min(HOLDS * share, 1.0)
                    matrix += weight * wp.outer(n, n)
                    right += weight * share * missing * n
        matrix += stiffness * wp.identity(n=3, dtype=float)
        d = wp.inverse(matrix) * right
    moved_out[v] = d


@wp.kernel
def move(
    moved: wp.array(dtype=wp.vec3),
    # in and out
    points: wp.array(dtype=wp.vec3),
):
    """Add displacements; what has none stays bit for bit."""
    v = wp.tid()
    if wp.length_sq(moved[v]) > 0.0:
        points[v] = points[v] + moved[v]


@wp.kernel
def heed_nothing(
    count_out: wp.array(dtype=wp.int32), lower_out: wp.array(dtype=wp.vec3), upper_out: wp.array(dtype=wp.vec3)
):
    """No samples, and boxes that hold nothing."""
    k = wp.tid()
    count_out[k] = 0
    lower_out[k] = wp.vec3(FAR, FAR, FAR)
    upper_out[k] = wp.vec3(-FAR, -FAR, -FAR)
