"""Sphere tracing against one object: rays through it from its surface, and translation of a skin up to it."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED
from warpjld_kernels.signed_grid import SignedGrid, distance_bounds
from warpjld_kernels.surface_distance import Solids, nearest

wp.set_module_options({**VECTORISED, "max_unroll": 1})

_SLACK = wp.constant(2.0e-6)  # what float32 may add to a bound [m]


@wp.kernel
def follow_through(
    solids: Solids,
    # points of the surface, unit directions into the object, in its own frame
    start: wp.array(dtype=wp.vec3d),
    direction: wp.array(dtype=wp.vec3d),
    surface: wp.float64,
    widest: wp.float64,
    steps: int,
    # in and out: how far along
    along: wp.array(dtype=wp.float64),
    # out: the triangle where a line leaves, −1 where it does not
    face_out: wp.array(dtype=wp.int32),
):
    """Trace rays inside the object by steps of their depth, until less than ``surface`` deep (Hart 1996)."""
    n = wp.tid()
    t = along[n]
    face_out[n] = -1
    limit = wp.float64(1.0e9)
    step = int(0)
    while step < steps and t < widest:
        point = wp.vec3d(wp.vec3(start[n] + t * direction[n]))
        hit = nearest(solids, 0, point, limit)
        depth = -wp.float64(hit.distance)
        step += 1
        if depth < surface:
            face_out[n] = hit.face
            step = steps
        else:
            t += depth
            # the last nearest point is on the surface still
            after = wp.vec3d(wp.vec3(start[n] + t * direction[n]))
            limit = wp.float64(1.0001) * wp.length(after - wp.vec3d(hit.point)) + wp.float64(1.0e-6)
    along[n] = t


@wp.func
def seen_from(position: wp.vec3d, rotation: wp.quatd, x: wp.vec3) -> wp.vec3d:
    return wp.vec3d(wp.vec3(wp.quat_rotate_inv(rotation, wp.vec3d(x) - position)))


@wp.kernel
def come_near(
    solids: Solids,
    grid: SignedGrid,
    # where the object stands
    position: wp.vec3d,
    rotation: wp.quatd,
    # skins on the stage and the directions in which they move
    skins: wp.array2d(dtype=wp.vec3),
    approach: wp.array(dtype=wp.vec3d),
    reach: wp.array(dtype=wp.float64),
    clearance: wp.float64,
    shortest: wp.float64,
    steps: int,
    # scratch: what distances of vertices were at least, and when
    least: wp.array2d(dtype=float),
    when: wp.array2d(dtype=float),
    # out
    moved_out: wp.array(dtype=wp.float64),
):
    """Largest translation of a skin up to a clearance from the object, by steps of its smallest distance."""
    g = wp.tid()
    count = skins.shape[1]
    moved = wp.float64(0.0)
    closest = int(0)
    going = bool(True)
    step = int(0)
    while going and step < steps:
        now = float(moved)
        shift = wp.vec3(moved * approach[g])
        if step == 0:
            for v in range(count):
                two = distance_bounds(solids, grid, seen_from(position, rotation, skins[g, v] + shift))
                least[g, v] = float(two[0])
                when[g, v] = now
                if least[g, v] < least[g, closest]:
                    closest = v
        p = seen_from(position, rotation, skins[g, closest] + shift)
        two = distance_bounds(solids, grid, p)
        hit = nearest(solids, 0, p, two[1])
        gap = hit.distance
        least[g, closest] = gap
        when[g, closest] = now
        first = closest
        for v in range(count):
            if v != first and least[g, v] - wp.abs(now - when[g, v]) - _SLACK < gap:
                p = seen_from(position, rotation, skins[g, v] + shift)
                two = distance_bounds(solids, grid, p)
                least[g, v] = float(two[0])
                when[g, v] = now
                if least[g, v] < gap:
                    hit = nearest(solids, 0, p, two[1])
                    least[g, v] = hit.distance
                    if hit.distance < gap:
                        gap = hit.distance
                        closest = v
        # a hand that has come too near goes back by as much
        ahead = wp.min(wp.float64(gap) - clearance, reach[g] - moved)
        if ahead > wp.float64(0.0):
            moved += ahead
        else:
            moved += wp.float64(1.05) * ahead - wp.float64(1.0e-5)
        going = wp.abs(ahead) >= shortest and moved < reach[g]
        step += 1
    moved_out[g] = moved
