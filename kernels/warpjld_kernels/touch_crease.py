"""Separation of the two sides of a bent joint at the bisecting plane in which they meet."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options({**VECTORISED, "max_unroll": 3})

ROOM = 0.25  # margin, in thicknesses, within which vertices before the plane are considered too


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
def across(creases: Creases, entry: int, points: wp.array(dtype=wp.vec3)) -> wp.vec3:
    """The point opposite to a vertex: weighted mean of three vertices of the other side [m]."""
    out = wp.vec3(0.0, 0.0, 0.0)
    for k in range(3):
        out += creases.share[entry][k] * points[creases.opposite[entry][k]]
    return out


@wp.func
def counts(creases: Creases, entry: int, r: wp.vec3, n: wp.vec3) -> float:
    """Weight of an entry at offset r from its opposite point, n the plane's normal: it falls to zero with tangential
    distance, since two sides overlap only where they still face each other."""
    beside = wp.length(r - wp.dot(r, n) * n) / creases.size[creases.crease[entry]]
    return creases.weight[entry] * wp.clamp(2.0 - 2.0 * beside, 0.0, 1.0)


@wp.func_native(f"""
    const float* at = (const float*)points.data;
    int count = 0;
    for (int row = 0; row < creases.vertex.shape[0]; ++row) {{
        const int v = creases.vertex.data[row];
        const float* p = at + 3 * size_t(v);
        float most = 0.0f;
        bool is_near = false;
        for (int entry = creases.first.data[row]; entry < creases.first.data[row + 1]; ++entry) {{
            const int j = creases.crease.data[entry];
            if (bent.data[j] == 0.0f) continue;
            float r[3] = {{p[0], p[1], p[2]}};
            for (int k = 0; k < 3; ++k) {{
                const float* q = at + 3 * size_t(creases.opposite.data[entry][k]);
                const float part = creases.share.data[entry][k];
                for (int i = 0; i < 3; ++i) r[i] -= part * q[i];
            }}
            const wp::vec3& n = normal.data[j];
            const float along = r[0] * n[0] + r[1] * n[1] + r[2] * n[2], height = creases.height.data[entry];
            const float size = creases.size.data[j];
            float overlap = height < 0.0f ? along : -along;
            is_near |= -overlap < 2.0f * kept * fabsf(height) + {ROOM}f * size;
            if (overlap > 0.0f) {{
                const float aside = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] - along * along;
                const float facing = 2.0f - 2.0f * sqrtf(aside > 0.0f ? aside : 0.0f) / size;
                const float bounded = facing < 0.0f ? 0.0f : (facing > 1.0f ? 1.0f : facing);
                overlap *= bent.data[j] * creases.weight.data[entry] * bounded;
                most = overlap > most ? overlap : most;
                const float ratio = overlap / (2.0f * share * size);
                deepest.data[j] = ratio > deepest.data[j] ? ratio : deepest.data[j];
            }}
        }}
        if (is_near) near.data[count++] = row;
        overlaps.data[v] = most;
    }}
    return count;
""")
def overlaps_at_creases(
    creases: Creases,
    normal: wp.array(dtype=wp.vec3),
    bent: wp.array(dtype=float),
    points: wp.array(dtype=wp.vec3),
    share: float,
    kept: float,
    near: wp.array(dtype=wp.int32),
    overlaps: wp.array(dtype=float),
    deepest: wp.array(dtype=float),
) -> int:
    """As :func:`measure_creases`; returns the number of rows in ``near``."""


@wp.kernel
def measure_creases(
    creases: Creases,
    # normals of the planes, and their weights, 0 for joints that are hardly bent
    normal: wp.array(dtype=wp.vec3),
    bent: wp.array(dtype=float),
    points: wp.array(dtype=wp.vec3),
    share: float,
    kept: float,
    # out: number and rows of the vertices that may have to be pushed, with a margin for the effect of pushing others;
    # the overlap of every vertex with the opposite side [m]; and the largest overlap at every plane, relative to what
    # both sides can yield, zeros before
    count_out: wp.array(dtype=wp.int32),
    near_out: wp.array(dtype=wp.int32),
    overlap_out: wp.array(dtype=float),
    deepest_out: wp.array(dtype=float),
):
    """Overlap of every vertex with the opposite side of its joints: one thread."""
    count_out[0] = overlaps_at_creases(creases, normal, bent, points, share, kept, near_out, overlap_out, deepest_out)


@wp.kernel
def smooth_overlaps(
    creases: Creases,
    count: wp.array(dtype=wp.int32),
    near: wp.array(dtype=wp.int32),
    overlap: wp.array(dtype=float),
    # smoothing matrix in CSR layout
    row_first: wp.array(dtype=wp.int32),
    column: wp.array(dtype=wp.int32),
    value: wp.array(dtype=float),
    # out
    smoothed_out: wp.array(dtype=float),
):
    """Smoothed overlap of the vertices that may have to be pushed, by row: one thread."""
    for n in range(count[0]):
        row = near[n]
        v = creases.vertex[row]
        around = float(0.0)
        for i in range(row_first[v], row_first[v + 1]):
            around += value[i] * overlap[column[i]]
        smoothed_out[row] = around


@wp.kernel
def push_creases(
    creases: Creases,
    normal: wp.array(dtype=wp.vec3),
    bent: wp.array(dtype=float),
    points: wp.array(dtype=wp.vec3),
    count: wp.array(dtype=wp.int32),
    near: wp.array(dtype=wp.int32),
    deepest: wp.array(dtype=float),
    # the overlap smoothed, by row
    smoothed: wp.array(dtype=float),
    kept: float,
    least: float,
    wider: float,
    widest: float,
    full: float,
    none: float,
    # out
    shift_out: wp.array(dtype=wp.vec3),
):
    """Displacement of every vertex that may have to be pushed away from its opposite point, half of the separation
    needed.

    The separation aimed at is a small distance plus a multiple of the smoothed overlap, but no more than a share of the
    distance at rest. One thread.
    """
    for n in range(count[0]):
        row = near[n]
        v = creases.vertex[row]
        p = points[v]
        shift = wp.vec3(0.0, 0.0, 0.0)
        for entry in range(creases.first[row], creases.first[row + 1]):
            j = creases.crease[entry]
            if bent[j] == 0.0:
                continue
            towards = normal[j]
            r = p - across(creases, entry, points)
            side = wp.sign(creases.height[entry])
            apart = 2.0 * least * creases.size[j] + wp.min(wider * smoothed[row], widest * creases.size[j])
            apart = wp.min(apart, 2.0 * kept * wp.abs(creases.height[entry]))
            missing = apart - side * wp.dot(r + shift, towards)
            if missing > 0.0:
                shown = bent[j] * wp.clamp((none - deepest[j]) / (none - full), 0.0, 1.0)
                shift += 0.5 * shown * counts(creases, entry, r, towards) * missing * side * towards
        shift_out[row] = shift


@wp.kernel
def move_smoothly(
    creases: Creases,
    count: wp.array(dtype=wp.int32),
    near: wp.array(dtype=wp.int32),
    shift: wp.array(dtype=wp.vec3),
    # transposed smoothing matrix in CSR layout
    row_first: wp.array(dtype=wp.int32),
    column: wp.array(dtype=wp.int32),
    value: wp.array(dtype=float),
    # zeros, and zeros again afterwards
    total: wp.array(dtype=wp.vec3),
    # in and out
    points: wp.array(dtype=wp.vec3),
):
    """Add smoothed shifts; vertices without one keep their exact values. One thread."""
    for n in range(count[0]):
        row = near[n]
        if wp.length_sq(shift[row]) > 0.0:
            v = creases.vertex[row]
            for i in range(row_first[v], row_first[v + 1]):
                total[column[i]] = total[column[i]] + value[i] * shift[row]
    for n in range(count[0]):
        row = near[n]
        if wp.length_sq(shift[row]) > 0.0:
            v = creases.vertex[row]
            for i in range(row_first[v], row_first[v + 1]):
                points[column[i]] = points[column[i]] + total[column[i]]
                total[column[i]] = wp.vec3(0.0, 0.0, 0.0)
