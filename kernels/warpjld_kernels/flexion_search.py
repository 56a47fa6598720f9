"""Bisection for the closing of joints at which a vertex touches an object (A §7.3, R74, R76).

Only that vertex is deformed (see ``closing_chain``).
"""

import warp as wp

from warpjld_kernels.closing_chain import Drives, Posture, Skin, mapped
from warpjld_kernels.surface_distance import FAR, Hit, Solids, nearest

wp.set_module_options({"max_unroll": 1, "enable_backward": False})

# steps towards the object, as parts of the chain's reach; long ones would blur the closest approach
_SHORTEST = wp.constant(64)
_LONGEST = wp.constant(8)  # a march takes at least eight steps over its reach, however far the surface is
_MOST = wp.constant(160)  # evaluations of one search; halving to 1e-7 needs 24, the rest is marching
_GOLDEN = wp.constant(0.381966)  # 2 - golden ratio: the share that golden section cuts off

_FIRST = wp.constant(0)
_MARCH = wp.constant(1)
_REFINE = wp.constant(2)
_HALVE = wp.constant(3)
_DONE = wp.constant(4)

# what a search ended with: values of warpjld.grasp.search_result.Status
CONVERGED = wp.constant(0)
NO_CONTACT = wp.constant(1)
INSIDE = wp.constant(2)
AT_LIMIT = wp.constant(3)
OPENING = wp.constant(4)


@wp.struct
class Task:
    """One search."""

    drive: int
    vertex: int
    thing: int
    facet: int
    target: float
    position: wp.vec3
    rotation: wp.quat


@wp.func
def over_facet(solids: Solids, o: int, facet: int, point: wp.vec3) -> Hit:
    """Distance to a facet's plane (R73); ``point`` is the position in the facet's basis."""
    surface = wp.mesh_get(solids.mesh[o])
    a = surface.points[surface.indices[3 * facet]]
    b = surface.points[surface.indices[3 * facet + 1]]
    x = wp.normalize(b - a)
    y = solids.features[solids.first_face[o] + facet, 0]
    away = point - a
    hit = Hit()
    hit.face = facet
    hit.distance = wp.dot(away, y)
    hit.point = wp.vec3(wp.dot(away, x), hit.distance, wp.dot(away, wp.cross(x, y)))
    return hit


@wp.func
def top_speed(posture: Posture, drives: Drives, r: int, x: wp.vec3) -> float:
    """Upper bound on the speed of a vertex at x [m per unit of closing].

    Its radius about each moving joint; a third and 3 mm more for what inflation and the other joints may add.
    """
    total = float(0.0)
    for k in range(drives.count[r]):
        radius = wp.length(x - posture.positions[drives.frame[r], drives.joint[r, k]])
        total += wp.abs(drives.rate[r, k]) * (1.3 * radius + 0.003)
    return total


@wp.kernel
def search(
    # objects
    solids: Solids,
    # model
    skin: Skin,
    # poses
    posture: Posture,
    drives: Drives,
    # tasks
    drive: wp.array(dtype=wp.int32),
    vertex: wp.array(dtype=wp.int32),
    thing: wp.array(dtype=wp.int32),
    facet: wp.array(dtype=wp.int32),
    target: wp.array(dtype=float),
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.quat),
    tolerance: float,
    first: int,
    # out
    status_out: wp.array(dtype=wp.int32),
    closing_out: wp.array(dtype=float),
    distance_out: wp.array(dtype=float),
    face_out: wp.array(dtype=wp.int32),
    point_out: wp.array(dtype=wp.vec3),
    evaluations_out: wp.array(dtype=wp.int32),
):
    """First closing s of a chain at which |distance − target| < tolerance, from outside or from inside.

    Steps bounded by the distance (sphere tracing) lead to the first change of sign, which is then bisected. Without a
    change of sign, the closest approach is refined, so that a short contact is not missed. From inside, distances have
    the opposite sign, so that the exit is searched.
    """
    i = first + wp.tid()
    task = Task()
    task.drive = drive[i]
    task.vertex = vertex[i]
    task.thing = thing[i]
    task.facet = facet[i]
    task.target = target[i]
    task.position = position[i]
    task.rotation = rotation[i]
    reach = drives.reach[task.drive]
    status = int(NO_CONTACT)
    phase = int(_FIRST)
    s = float(0.0)
    count = int(0)
    side = float(1.0)
    speed = float(0.0)
    # bracket of the change of sign; the step before the present one
    low = float(0.0)
    high = float(0.0)
    previous = float(0.0)
    # closest approach, and the steps before and after it
    hit = Hit()
    closest = Hit()
    at = float(0.0)
    before = float(0.0)
    beyond = float(0.0)
    # golden section between them
    x0 = float(0.0)
    x1 = float(0.0)
    x2 = float(0.0)
    x3 = float(0.0)
    d1 = float(FAR)
    d2 = float(FAR)
    slot = int(1)
    while phase != _DONE:
        x = mapped(skin, posture, drives, task.drive, task.vertex, s)
        local = wp.quat_rotate_inv(task.rotation, x - task.position)
        if task.facet >= 0:
            hit = over_facet(solids, task.thing, task.facet, local)
        else:
            limit = wp.float64(FAR)
            if count > 0:  # the last nearest point is on the surface still
                limit = wp.float64(1.0001 * wp.length(local - hit.point) + 1.0e-6)
            hit = nearest(solids, task.thing, wp.vec3d(local), limit)
        hit.distance = side * (hit.distance - task.target)
        if phase == _FIRST and hit.distance < 0.0:
            side = -1.0
            hit.distance = -hit.distance
        count += 1
        if hit.distance < closest.distance or count == 1:
            closest = hit
            at = s
            before = previous
            if phase == _MARCH:
                beyond = -1.0
        elif beyond < 0.0:
            beyond = s
        if wp.abs(hit.distance) < tolerance:
            status = CONVERGED
            phase = _DONE
        elif phase == _HALVE:
            if hit.distance < 0.0:
                high = s
            else:
                low = s
            s_next = 0.5 * (low + high)
            if count > _MOST or high - low < 1.0e-7 or s_next <= low or s_next >= high:
                status = OPENING
                phase = _DONE
            else:
                s = s_next
        elif hit.distance < 0.0:
            low = previous
            if phase == _REFINE:
                low = x0
            high = s
            s = 0.5 * (low + high)
            phase = _HALVE
        elif phase == _REFINE:
            if slot == 1:
                d1 = hit.distance
            else:
                d2 = hit.distance
            if d2 == FAR:
                slot = 2
                s = x2
            elif x3 - x0 < 1.0e-5 or count > _MOST:
                phase = _DONE
            elif d1 < d2:
                x3 = x2
                x2 = x1
                d2 = d1
                x1 = x0 + _GOLDEN * (x3 - x0)
                slot = 1
                s = x1
            else:
                x0 = x1
                x1 = x2
                d1 = d2
                x2 = x3 - _GOLDEN * (x3 - x0)
                slot = 2
                s = x2
        elif reach < 1.0e-6:
            status = AT_LIMIT
            phase = _DONE
        elif s >= reach:
            if beyond > before:
                x0 = before
                x3 = beyond
                x1 = x0 + _GOLDEN * (x3 - x0)
                x2 = x3 - _GOLDEN * (x3 - x0)
                s = x1
                phase = _REFINE
            else:
                phase = _DONE
        else:
            if phase == _FIRST:
                speed = top_speed(posture, drives, task.drive, x)
                phase = _MARCH
            previous = s
            s = wp.min(s + wp.clamp(hit.distance / speed, reach / float(_SHORTEST), reach / float(_LONGEST)), reach)
    if status == NO_CONTACT:
        s = at
        hit = closest
    if side < 0.0:
        if status == NO_CONTACT:
            status = INSIDE
        if status == AT_LIMIT:
            status = INSIDE
    status_out[i] = status
    closing_out[i] = s
    distance_out[i] = side * hit.distance + task.target
    face_out[i] = hit.face
    point_out[i] = hit.point
    evaluations_out[i] = count
