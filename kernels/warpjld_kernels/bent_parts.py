"""Positions of the parts of a skin that joints bend, in float64, and the volumes under their faces."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

# the same options as the deforming kernels, so that both use one precompiled header, which takes longest to compile
wp.set_module_options(VECTORISED)


@wp.struct
class Entries:
    """A sparse matrix in CSR layout: entries ``first[v]`` to ``first[v + 1]`` of row v."""

    first: wp.array(dtype=wp.int32)
    column: wp.array(dtype=wp.int32)
    value: wp.array(dtype=wp.float64)


@wp.struct
class PartRows:
    """Coefficients of V vertices; see ``warpjld.covering.rows.Rows``. ``heights`` has a vector per entry of
    ``muscles``, which are driven by the scalars from ``first_muscle`` on."""

    positions: Entries
    turns: Entries
    scales: Entries
    muscles: Entries
    heights: wp.array(dtype=wp.vec3d)
    offset: wp.array(dtype=wp.vec3d)
    first_muscle: int


@wp.func
def turned(q: wp.quatd, v: wp.vec3d) -> wp.vec3d:
    """A vector turned by a quaternion of any length but zero."""
    u = wp.vec3d(q[0], q[1], q[2])
    return v + wp.float64(2.0) / wp.dot(q, q) * wp.cross(u, wp.cross(u, v) + q[3] * v)


@wp.struct
class Parts:
    """n vertices of several parts of a surface, each in F poses of its own.

    ``chosen`` are their numbers in the surface, ``owner`` the part of each; ``pivot`` and ``first_pose`` are those of a
    part. ``rims`` map the vertices to the means of open rims.
    """

    chosen: wp.array(dtype=wp.int32)
    owner: wp.array(dtype=wp.int32)
    pivot: wp.array(dtype=wp.vec3d)
    first_pose: wp.array(dtype=wp.int32)
    rims: Entries


@wp.kernel
def bend_parts(
    first: int,
    # model
    rows: PartRows,
    parts: Parts,
    # poses
    positions: wp.array2d(dtype=wp.vec3d),
    turns: wp.array2d(dtype=wp.quatd),
    scalars: wp.array2d(dtype=wp.float64),
    # out
    base_out: wp.array2d(dtype=wp.vec3d),
    offset_out: wp.array2d(dtype=wp.vec3d),
    growth_out: wp.array2d(dtype=wp.float64),
):
    """Vertices from ``first`` on, relative to their part's pivot, as base + growth · offset, shape (n, F) each."""
    k, f = wp.tid()
    i = first + k
    v = parts.chosen[i]
    p = parts.first_pose[parts.owner[i]] + f
    base = -parts.pivot[parts.owner[i]]
    for e in range(rows.positions.first[v], rows.positions.first[v + 1]):
        base += rows.positions.value[e] * positions[p, rows.positions.column[e]]
    turn = wp.quatd(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    for e in range(rows.turns.first[v], rows.turns.first[v + 1]):
        turn += rows.turns.value[e] * turns[p, rows.turns.column[e]]
    growth = wp.float64(1.0)
    for e in range(rows.scales.first[v], rows.scales.first[v + 1]):
        growth += rows.scales.value[e] * scalars[p, rows.scales.column[e]]
    raised = wp.vec3d()
    for e in range(rows.muscles.first[v], rows.muscles.first[v + 1]):
        raised += rows.muscles.value[e] * scalars[p, rows.first_muscle + rows.muscles.column[e]] * rows.heights[e]
    base_out[i, f] = base + turned(turn, raised)
    offset_out[i, f] = turned(turn, rows.offset[v])
    growth_out[i, f] = growth


@wp.struct
class Swelling:
    """Positions base + (growth + a · more) / (1 + a · at rest) · offset of the parts' vertices, a their part's
    amplitude; shape (n, F), ``at_rest`` (n,)."""

    base: wp.array2d(dtype=wp.vec3d)
    offset: wp.array2d(dtype=wp.vec3d)
    growth: wp.array2d(dtype=wp.float64)
    more: wp.array2d(dtype=wp.float64)
    at_rest: wp.array(dtype=wp.float64)


@wp.func
def swollen(own: Swelling, i: int, f: int, amplitude: wp.float64) -> wp.vec3d:
    thinner = wp.float64(1.0) + amplitude * own.at_rest[i]
    return own.base[i, f] + (own.growth[i, f] + amplitude * own.more[i, f]) / thinner * own.offset[i, f]


@wp.func
def drifting(own: Swelling, i: int, f: int, amplitude: wp.float64) -> wp.vec3d:
    thinner = wp.float64(1.0) + amplitude * own.at_rest[i]
    return (own.more[i, f] - own.growth[i, f] * own.at_rest[i]) / (thinner * thinner) * own.offset[i, f]


@wp.kernel
def swell_parts(
    first: int,
    parts: Parts,
    own: Swelling,
    amplitudes: wp.array(dtype=wp.float64),
    # out
    points_out: wp.array2d(dtype=wp.vec3d),
    drift_out: wp.array2d(dtype=wp.vec3d),
):
    """Positions of the vertices, and after them of the rims' means, and their derivatives by the amplitude."""
    k, f = wp.tid()
    i = first + k
    count = own.base.shape[0]
    if i < count:
        points_out[i, f] = swollen(own, i, f, amplitudes[parts.owner[i]])
        drift_out[i, f] = drifting(own, i, f, amplitudes[parts.owner[i]])
        return
    point = wp.vec3d()
    drift = wp.vec3d()
    for e in range(parts.rims.first[i - count], parts.rims.first[i - count + 1]):
        j = parts.rims.column[e]
        point += parts.rims.value[e] * swollen(own, j, f, amplitudes[parts.owner[j]])
        drift += parts.rims.value[e] * drifting(own, j, f, amplitudes[parts.owner[j]])
    points_out[i, f] = point
    drift_out[i, f] = drift


@wp.kernel
def sum_volumes(
    first: int,
    blocks: wp.array(dtype=wp.int32),
    faces: wp.array2d(dtype=wp.int32),
    points: wp.array2d(dtype=wp.vec3d),
    drift: wp.array2d(dtype=wp.vec3d),
    # out
    sums_out: wp.array2d(dtype=wp.vec2d),
):
    """Σ a · (b × c) of the faces ``blocks[b]`` to ``blocks[b + 1]``, and its derivative, shape (blocks, F)."""
    k, f = wp.tid()
    block = first + k
    volume = wp.float64(0.0)
    slope = wp.float64(0.0)
    for t in range(blocks[block], blocks[block + 1]):
        a = points[faces[t, 0], f]
        b = points[faces[t, 1], f]
        c = points[faces[t, 2], f]
        over = wp.cross(b, c)
        volume += wp.dot(a, over)
        slope += wp.dot(drift[faces[t, 0], f], over) + wp.dot(drift[faces[t, 1], f], wp.cross(c, a))
        slope += wp.dot(drift[faces[t, 2], f], wp.cross(a, b))
    sums_out[block, f] = wp.vec2d(volume, slope)
