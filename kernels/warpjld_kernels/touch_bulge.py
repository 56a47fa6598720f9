"""Volume preservation after a displacement: the volume taken from a part bulges around the displaced region."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.touch_normals import Normals, know_normal
from warpjld_kernels.touch_parts import Parts

wp.set_module_options(VECTORISED)


@wp.kernel
def measure_displaced(
    # frame: positions before and after, and distances between them; normals before
    before: wp.array(dtype=wp.vec3),
    points: wp.array(dtype=wp.vec3),
    size: wp.array(dtype=float),
    normals: Normals,
    parts: Parts,
    # first of the samples that act on every part
    first_sample: wp.array(dtype=wp.int32),
    # smoothing matrix in CSR layout
    first: wp.array(dtype=wp.int32),
    column: wp.array(dtype=wp.int32),
    value: wp.array(dtype=float),
    # out: by vertex the profile of the bulge; by part the volume lost, and the volume of a bulge of height ``ring``
    ring_out: wp.array(dtype=float),
    lost_out: wp.array(dtype=float),
    room_out: wp.array(dtype=float),
):
    """Profile of the bulge, max(smoothed |displacement| − |displacement|, 0), which is positive beside the displaced
    region, and volumes; in parts that have samples."""
    k = wp.tid()
    end = wp.where(first_sample[k + 1] > first_sample[k], parts.first_member[k + 1], parts.first_member[k])
    room = float(0.0)
    lost = float(0.0)
    for m in range(parts.first_member[k], end):
        v = parts.member[m]
        shift = points[v] - before[v]
        around = float(0.0)
        for i in range(first[v], first[v + 1]):
            around += value[i] * size[column[i]]
        ring = wp.max(around - size[v], 0.0)
        ring = wp.where(parts.give[v] > 0.0, ring, 0.0)
        ring_out[v] = ring
        if ring > 0.0 or size[v] > 0.0:
            know_normal(normals, before, v)
            room += wp.length(normals.normal[v]) * ring
            lost -= wp.dot(normals.normal[v], shift)
    room_out[k] = room
    lost_out[k] = lost


@wp.kernel
def bulge(
    normals: Normals,
    parts: Parts,
    most: float,
    ring: wp.array(dtype=float),
    lost: wp.array(dtype=float),
    room: wp.array(dtype=float),
    # in and out
    points: wp.array(dtype=wp.vec3),
):
    """Move vertices along their normals so that the lost volume is restored, by at most ``most`` thicknesses."""
    k = wp.tid()
    end = wp.where(room[k] > 0.0, parts.first_member[k + 1], parts.first_member[k])
    for m in range(parts.first_member[k], end):
        v = parts.member[m]
        if ring[v] > 0.0:
            height = wp.clamp(lost[k] / room[k] * ring[v], 0.0, most * parts.thickness[v])
            points[v] = points[v] + height * normals.unit[v]
