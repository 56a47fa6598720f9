"""Separation of the two sides of a bent joint at the bisecting plane in which they meet."""

import warp as wp

wp.set_module_options({"enable_backward": False})

ROOM = wp.constant(0.25)  # margin, in thicknesses, within which vertices before the plane are considered too


@wp.struct
class Creases:
    """Vertices near the bisecting planes of joints, as ``warpjld.touch.creases.Creases``.

    ``vertex`` and ``first`` give the index and the first entry of every vertex that a joint may push, with one more
    ``first`` at the end. Every entry has its plane ``crease``, the signed distance ``height`` from it at rest [m], its
    ``weight``, and the ``opposite`` point as three vertices with weights ``share``. ``size`` is the thickness of the
    flesh at every plane [m].
    """

    vertex: wp.array(dtype=wp.int32)
    first: wp.array(dtype=wp.int32)
    crease: wp.array(dtype=wp.int32)
    height: wp.array(dtype=float)
    weight: wp.array(dtype=float)
    opposite: wp.array(dtype=wp.vec3i)
    share: wp.array(dtype=wp.vec3)
    size: wp.array(dtype=float)


@wp.func
def across(creases: Creases, entry: int, frame: int, points: wp.array2d(dtype=wp.vec3)) -> wp.vec3:
    """The point opposite to a vertex: weighted mean of three vertices of the other side [m]."""
    out = wp.vec3(0.0, 0.0, 0.0)
    for k in range(3):
        out += creases.share[entry][k] * points[frame, creases.opposite[entry][k]]
    return out


@wp.func
def counts(creases: Creases, entry: int, r: wp.vec3, n: wp.vec3) -> float:
    """Weight of an entry at offset r from its opposite point, n the plane's normal: it falls to zero with tangential
    distance, since two sides overlap only where they still face each other."""
    beside = wp.length(r - wp.dot(r, n) * n) / creases.size[creases.crease[entry]]
    return creases.weight[entry] * wp.clamp(2.0 - 2.0 * beside, 0.0, 1.0)


@wp.kernel
def measure_creases(
    creases: Creases,
    # normals of the planes in every frame, and their weights, 0 for joints that are hardly bent
    normal: wp.array2d(dtype=wp.vec3),
    bent: wp.array2d(dtype=float),
    points: wp.array2d(dtype=wp.vec3),
    share: float,
    kept: float,
    # out: number and rows of the vertices that may have to be pushed, with a margin for the effect of pushing others;
    # the overlap of every vertex with the opposite side [m]; and the largest overlap at every plane, relative to what
    # both sides can yield
    count_out: wp.array(dtype=wp.int32),
    near_out: wp.array2d(dtype=wp.int32),
    overlap_out: wp.array2d(dtype=float),
    deepest_out: wp.array2d(dtype=float),
):
    """Overlap of every vertex with the opposite side of its joints."""
    frame, row = wp.tid()
    v = creases.vertex[row]
    most = float(0.0)
    near = int(0)
    for entry in range(creases.first[row], creases.first[row + 1]):
        j = creases.crease[entry]
        if bent[frame, j] == 0.0:
            continue
        n = normal[frame, j]
        r = points[frame, v] - across(creases, entry, frame, points)
        overlap = -wp.sign(creases.height[entry]) * wp.dot(r, n)
        if -overlap < 2.0 * kept * wp.abs(creases.height[entry]) + ROOM * creases.size[j]:
            near = 1
        if overlap > 0.0:
            overlap *= bent[frame, j] * counts(creases, entry, r, n)
            most = wp.max(most, overlap)
            wp.atomic_max(deepest_out, frame, j, overlap / (2.0 * share * creases.size[j]))
    if near == 1:
        near_out[frame, wp.atomic_add(count_out, frame, 1)] = row
    overlap_out[frame, v] = most


@wp.kernel
def push_creases(
    creases: Creases,
    normal: wp.array2d(dtype=wp.vec3),
    bent: wp.array2d(dtype=float),
    points: wp.array2d(dtype=wp.vec3),
    count: wp.array(dtype=wp.int32),
    near: wp.array2d(dtype=wp.int32),
    overlap: wp.array2d(dtype=float),
    deepest: wp.array2d(dtype=float),
    # smoothing matrix in CSR layout
    row_first: wp.array(dtype=wp.int32),
    column: wp.array(dtype=wp.int32),
    value: wp.array(dtype=float),
    kept: float,
    least: float,
    wider: float,
    widest: float,
    full: float,
    none: float,
    # out
    shift_out: wp.array2d(dtype=wp.vec3),
):
    """Displacement of every vertex that may have to be pushed away from its opposite point, half of the separation
    needed.

    The separation aimed at is a small distance plus a multiple of the smoothed overlap, but no more than a share of the
    distance at rest.
    """
    frame = wp.tid()
    for n in range(count[frame]):
        row = near[frame, n]
        v = creases.vertex[row]
        p = points[frame, v]
        around = float(0.0)
        for i in range(row_first[v], row_first[v + 1]):
            around += value[i] * overlap[frame, column[i]]
        shift = wp.vec3(0.0, 0.0, 0.0)
        for entry in range(creases.first[row], creases.first[row + 1]):
            j = creases.crease[entry]
            if bent[frame, j] == 0.0:
                continue
            towards = normal[frame, j]
            r = p - across(creases, entry, frame, points)
            side = wp.sign(creases.height[entry])
            apart = 2.0 * least * creases.size[j] + wp.min(wider * around, widest * creases.size[j])
            apart = wp.min(apart, 2.0 * kept * wp.abs(creases.height[entry]))
            missing = apart - side * wp.dot(r + shift, towards)
            if missing > 0.0:
                shown = bent[frame, j] * wp.clamp((none - deepest[frame, j]) / (none - full), 0.0, 1.0)
                shift += 0.5 * shown * counts(creases, entry, r, towards) * missing * side * towards
        shift_out[frame, row] = shift


@wp.kernel
def move_smoothly(
    creases: Creases,
    count: wp.array(dtype=wp.int32),
    near: wp.array2d(dtype=wp.int32),
    shift: wp.array2d(dtype=wp.vec3),
    # transposed smoothing matrix in CSR layout
    row_first: wp.array(dtype=wp.int32),
    column: wp.array(dtype=wp.int32),
    value: wp.array(dtype=float),
    # zeros, and zeros again afterwards
    total: wp.array2d(dtype=wp.vec3),
    # in and out
    points: wp.array2d(dtype=wp.vec3),
):
    """Add smoothed shifts; vertices without one keep their exact values."""
    frame = wp.tid()
    for n in range(count[frame]):
        row = near[frame, n]
        if wp.length_sq(shift[frame, row]) > 0.0:
            v = creases.vertex[row]
            for i in range(row_first[v], row_first[v + 1]):
                total[frame, column[i]] = total[frame, column[i]] + value[i] * shift[frame, row]
    for n in range(count[frame]):
        row = near[frame, n]
        if wp.length_sq(shift[frame, row]) > 0.0:
            v = creases.vertex[row]
            for i in range(row_first[v], row_first[v + 1]):
                points[frame, column[i]] = points[frame, column[i]] + total[frame, column[i]]
                total[frame, column[i]] = wp.vec3(0.0, 0.0, 0.0)
