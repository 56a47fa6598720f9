"""Broad phase of skin contact: bounds of the parts, pairs that may overlap, and vertices to be tested."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options({**VECTORISED, "max_unroll": 6})

FAR = wp.constant(1.0e30)  # larger than any coordinate [m], for empty boxes
BESIDE = wp.constant(0.03)  # margin of a mesh's box, relative to the mesh's largest distance from its bones
# margin along the diagonals, relative to that of the box: with 1 skin beneath open ends leaps 1.5 times as far
ASIDE = wp.constant(4.0)


@wp.struct
class Parts:
    """Pose-independent data of the parts.

    ``corner`` lists the vertices of every part's mesh from ``first_corner`` on, ``member`` its own vertices from
    ``first_member`` on; ``group`` says in which of the three rounds a vertex is tested. ``apart`` is 1 for pairs of
    parts that may touch, 2 for the same part and neighbours, else 0; ``beside`` lists the latter, padded with -1.
    ``bone`` holds the joints at the ends of every part's segments from ``first_bone`` on, ``around`` the largest
    distance of its mesh from them [m]. ``facing`` is 1 where overlaps count regardless of the orientation of both
    surfaces, else 0. By vertex: ``thickness`` of the flesh [m], compliance ``give``, depth of the overlap ``at_rest``
    [m] and mean ``edge`` length [m]; ``give_of`` is the mean compliance by part.
    """

    part: wp.array(dtype=wp.int32)
    first_corner: wp.array(dtype=wp.int32)
    corner: wp.array(dtype=wp.int32)
    first_member: wp.array(dtype=wp.int32)
    member: wp.array(dtype=wp.int32)
    group: wp.array(dtype=wp.int32)
    apart: wp.array2d(dtype=wp.int32)
    beside: wp.array2d(dtype=wp.int32)
    thickness: wp.array(dtype=float)
    give: wp.array(dtype=float)
    give_of: wp.array(dtype=float)
    at_rest: wp.array(dtype=float)
    facing: float
    first_bone: wp.array(dtype=wp.int32)
    bone: wp.array(dtype=wp.vec2i)
    around: wp.array(dtype=float)
    edge: wp.array(dtype=float)


Six = wp.types.vector(length=6, dtype=float)


@wp.struct
class Bounds:
    """Bounds of every part's mesh: corners of its axis-aligned box, and its extent along the six directions between two
    axes, which cut the box's edges off [m]."""

    lower: wp.array(dtype=wp.vec3)
    upper: wp.array(dtype=wp.vec3)
    least: wp.array(dtype=Six)
    most: wp.array(dtype=Six)


@wp.func
def diagonals(p: wp.vec3) -> Six:
    """Coordinates along the six directions between two axes."""
    q = wp.sqrt(0.5) * p
    return Six(q[0] + q[1], q[0] - q[1], q[0] + q[2], q[0] - q[2], q[1] + q[2], q[1] - q[2])


@wp.kernel
def find_bounds(
    points: wp.array(dtype=wp.vec3),
    parts: Parts,
    # out
    bounds: Bounds,
):
    """Bounds of the parts."""
    k = wp.tid()
    low = wp.vec3(FAR, FAR, FAR)
    high = -low
    least = Six(FAR, FAR, FAR, FAR, FAR, FAR)
    most = -least
    for i in range(parts.first_corner[k], parts.first_corner[k + 1]):
        p = points[parts.corner[i]]
        low = wp.min(low, p)
        high = wp.max(high, p)
        q = diagonals(p)
        least = wp.min(least, q)
        most = wp.max(most, q)
    bounds.lower[k] = low
    bounds.upper[k] = high
    bounds.least[k] = least
    bounds.most[k] = most


@wp.func
def within(bounds: Bounds, k: int, p: wp.vec3, margin: float) -> float:
    """1 for a point in the bounds of part k, falling to 0 at a distance ``margin`` [m]: points beneath the open end of
    a mesh may be outside them."""
    gap = wp.max(bounds.lower[k] - p, p - bounds.upper[k])
    near = float(0.0)
    if wp.max(gap) <= margin:
        beyond = wp.length(wp.max(gap, wp.vec3(0.0, 0.0, 0.0)))
        if beyond <= margin:
            q = diagonals(p)
            aside = wp.max(wp.max(bounds.least[k] - q, q - bounds.most[k]))
            near = wp.max(1.0 - wp.max(beyond, aside / ASIDE) / wp.max(margin, 1.0e-30), 0.0)
    return near


@wp.kernel
def find_pairs(
    parts: Parts,
    bounds: Bounds,
    # share of the overlap of two parts that is separated; any positive value before it is known
    shown: wp.array2d(dtype=float),
    # out
    count_out: wp.array(dtype=wp.int32),
    other_out: wp.array2d(dtype=wp.int32),
):
    """Parts that may touch a part and whose bounds overlap its own."""
    k = wp.tid()
    count = int(0)
    for other in range(parts.apart.shape[0]):
        if parts.apart[k, other] == 1 and shown[k, other] > 0.0:
            margin = BESIDE * parts.around[other]
            gap = wp.max(bounds.lower[k] - bounds.upper[other], bounds.lower[other] - bounds.upper[k])
            if wp.max(gap) < margin:
                aside = wp.max(bounds.least[k] - bounds.most[other], bounds.least[other] - bounds.most[k])
                if wp.max(aside) < ASIDE * margin:
                    other_out[k, count] = other
                    count += 1
    count_out[k] = count


@wp.kernel
def find_candidates(
    points: wp.array(dtype=wp.vec3),
    parts: Parts,
    bounds: Bounds,
    count: wp.array(dtype=wp.int32),
    others: wp.array2d(dtype=wp.int32),
    # boxes outside which vertices of every part are not tested
    within_lower: wp.array(dtype=wp.vec3),
    within_upper: wp.array(dtype=wp.vec3),
    # out: by group the vertices to be tested, and their numbers; ``wanted_out`` marks parts whose mesh is queried
    candidate_out: wp.array2d(dtype=wp.int32),
    number_out: wp.array(dtype=wp.int32),
    wanted_out: wp.array(dtype=wp.int32),
):
    """Vertices within the bounds of another part that theirs may touch: one thread."""
    for own in range(parts.apart.shape[0]):
        few = count[own]
        last = wp.where(few > 0, parts.first_member[own + 1], parts.first_member[own])
        # no vertex beyond the box around all that it may touch, nor beyond that given
        low = wp.vec3(FAR, FAR, FAR)
        high = -low
        for j in range(few):
            k = others[own, j]
            margin = BESIDE * parts.around[k] * wp.vec3(1.0, 1.0, 1.0)
            low = wp.min(low, bounds.lower[k] - margin)
            high = wp.max(high, bounds.upper[k] + margin)
        low = wp.max(low, within_lower[own])
        high = wp.min(high, within_upper[own])
        for i in range(parts.first_member[own], last):
            v = parts.member[i]
            p = points[v]
            if wp.min(p - low) >= 0.0 and wp.min(high - p) >= 0.0:
                near = int(0)
                for j in range(few):
                    k = others[own, j]
                    if within(bounds, k, p, BESIDE * parts.around[k]) > 0.0:
                        near = 1
                        wanted_out[k] = 1
                if near == 1:
                    group = parts.group[v]
                    candidate_out[group, number_out[group]] = v
                    number_out[group] = number_out[group] + 1
