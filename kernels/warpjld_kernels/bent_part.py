"""Positions of a part of the skin that a joint bends, in float64, and the volume under its faces."""

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


@wp.kernel
def bend_part(
    # model
    rows: PartRows,
    chosen: wp.array(dtype=wp.int32),
    pivot: wp.vec3d,
    # poses
    positions: wp.array2d(dtype=wp.vec3d),
    turns: wp.array2d(dtype=wp.quatd),
    scalars: wp.array2d(dtype=wp.float64),
    # out
    base_out: wp.array2d(dtype=wp.vec3d),
    offset_out: wp.array2d(dtype=wp.vec3d),
    growth_out: wp.array2d(dtype=wp.float64),
):
    """Chosen vertices relative to the pivot as base + growth · offset, shape (n, F) each."""
    i, f = wp.tid()
    v = chosen[i]
    base = -pivot
    for e in range(rows.positions.first[v], rows.positions.first[v + 1]):
        base += rows.positions.value[e] * positions[f, rows.positions.column[e]]
    turn = wp.quatd(wp.float64(0.0), wp.float64(0.0), wp.float64(0.0), wp.float64(0.0))
    for e in range(rows.turns.first[v], rows.turns.first[v + 1]):
        turn += rows.turns.value[e] * turns[f, rows.turns.column[e]]
    growth = wp.float64(1.0)
    for e in range(rows.scales.first[v], rows.scales.first[v + 1]):
        growth += rows.scales.value[e] * scalars[f, rows.scales.column[e]]
    raised = wp.vec3d()
    for e in range(rows.muscles.first[v], rows.muscles.first[v + 1]):
        raised += rows.muscles.value[e] * scalars[f, rows.first_muscle + rows.muscles.column[e]] * rows.heights[e]
    base_out[i, f] = base + turned(turn, raised)
    offset_out[i, f] = turned(turn, rows.offset[v])
    growth_out[i, f] = growth


@wp.struct
class BentPart:
    """n vertices in F poses, base + (growth + a · more) / (1 + a · at rest) · offset for the amplitude a, and the
    entries of the map from them to the means of open rims."""

    base: wp.array2d(dtype=wp.vec3d)
    offset: wp.array2d(dtype=wp.vec3d)
    growth: wp.array2d(dtype=wp.float64)
    more: wp.array2d(dtype=wp.float64)
    at_rest: wp.array(dtype=wp.float64)
    rims: Entries


@wp.func
def swollen(part: BentPart, i: int, f: int, amplitude: wp.float64) -> wp.vec3d:
    thinner = wp.float64(1.0) + amplitude * part.at_rest[i]
    return part.base[i, f] + (part.growth[i, f] + amplitude * part.more[i, f]) / thinner * part.offset[i, f]


@wp.func
def drifting(part: BentPart, i: int, f: int, amplitude: wp.float64) -> wp.vec3d:
    thinner = wp.float64(1.0) + amplitude * part.at_rest[i]
    return (part.more[i, f] - part.growth[i, f] * part.at_rest[i]) / (thinner * thinner) * part.offset[i, f]


@wp.kernel
def swell_part(
    part: BentPart,
    amplitude: wp.float64,
    # out
    points_out: wp.array2d(dtype=wp.vec3d),
    drift_out: wp.array2d(dtype=wp.vec3d),
):
    """Positions of the vertices and of the rims' means, and their derivatives by the amplitude."""
    i, f = wp.tid()
    count = part.base.shape[0]
    if i < count:
        points_out[i, f] = swollen(part, i, f, amplitude)
        drift_out[i, f] = drifting(part, i, f, amplitude)
        return
    point = wp.vec3d()
    drift = wp.vec3d()
    for e in range(part.rims.first[i - count], part.rims.first[i - count + 1]):
        point += part.rims.value[e] * swollen(part, part.rims.column[e], f, amplitude)
        drift += part.rims.value[e] * drifting(part, part.rims.column[e], f, amplitude)
    points_out[i, f] = point
    drift_out[i, f] = drift


@wp.kernel
def sum_volume(
    faces: wp.array2d(dtype=wp.int32),
    points: wp.array2d(dtype=wp.vec3d),
    drift: wp.array2d(dtype=wp.vec3d),
    together: int,
    # out
    sums_out: wp.array2d(dtype=wp.vec2d),
):
    """Σ a · (b × c) of ``together`` faces a block, and its derivative, shape (blocks, F)."""
    block, f = wp.tid()
    volume = wp.float64(0.0)
    slope = wp.float64(0.0)
    for t in range(block * together, wp.min((block + 1) * together, faces.shape[0])):
        a = points[faces[t, 0], f]
        b = points[faces[t, 1], f]
        c = points[faces[t, 2], f]
        over = wp.cross(b, c)
        volume += wp.dot(a, over)
        slope += wp.dot(drift[faces[t, 0], f], over) + wp.dot(drift[faces[t, 1], f], wp.cross(c, a))
        slope += wp.dot(drift[faces[t, 2], f], wp.cross(a, b))
    sums_out[block, f] = wp.vec2d(volume, slope)
