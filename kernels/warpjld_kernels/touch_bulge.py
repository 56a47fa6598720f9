"""Volume preservation after a displacement: the volume taken from a part bulges around the displaced region."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.kernel
def measure_displaced(
    # frame: positions before and after, normals of the length of the vertex's area
    before: wp.array(dtype=wp.vec3),
    points: wp.array(dtype=wp.vec3),
    normals: wp.array(dtype=wp.vec3),
    part: wp.array(dtype=wp.int32),
    # first of the samples that act on every part
    first_sample: wp.array(dtype=wp.int32),
    give: wp.array(dtype=float),
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
    v = wp.tid()
    k = part[v]
    ring_out[v] = 0.0
    if first_sample[k + 1] > first_sample[k]:
        shift = points[v] - before[v]
        around = float(0.0)
        for i in range(first[v], first[v + 1]):
            u = column[i]
            around += value[i] * wp.length(points[u] - before[u])
        ring = wp.max(around - wp.length(shift), 0.0)
        if give[v] > 0.0 and ring > 0.0:
            ring_out[v] = ring
            wp.atomic_add(room_out, k, wp.length(normals[v]) * ring)
        wp.atomic_add(lost_out, k, -wp.dot(normals[v], shift))


@wp.kernel
def bulge(
    normals: wp.array(dtype=wp.vec3),
    part: wp.array(dtype=wp.int32),
    thickness: wp.array(dtype=float),
    most: float,
    ring: wp.array(dtype=float),
    lost: wp.array(dtype=float),
    room: wp.array(dtype=float),
    # in and out
    points: wp.array(dtype=wp.vec3),
):
    """Move vertices along their normals so that the lost volume is restored, by at most ``most`` thicknesses."""
    v = wp.tid()
    k = part[v]
    if ring[v] > 0.0 and room[k] > 0.0:
        height = wp.clamp(lost[k] / room[k] * ring[v], 0.0, most * thickness[v])
        points[v] = points[v] + height * wp.normalize(normals[v])
