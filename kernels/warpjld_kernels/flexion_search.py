"""Bisection for the closing of joints at which a vertex touches an object (A §7.3, R74, R76).

Only the vertex asked for is mapped, by the same operators as the animation. What moves between two poses of a search is
one chain of joints, so the pose need not be computed again: a joint beyond k moving ones is carried along by the
product of their turns about the axes they had at the start.
"""

import warp as wp

from warpjld_kernels.surface_distance import FAR, Hit, Solids, nearest

wp.set_module_options({"max_unroll": 1, "enable_backward": False})

MOVERS = wp.constant(4)
"""Joints that may move together, each beyond the one before."""

# steps towards the object, as parts of the chain's reach; long ones would blur the closest approach
_SHORTEST = wp.constant(64)
_LONGEST = wp.constant(8)
_MOST = wp.constant(160)
_GOLDEN = wp.constant(0.381966)

_FIRST = wp.constant(0)
_MARCH = wp.constant(1)
_REFINE = wp.constant(2)
_HALVE = wp.constant(3)
_DONE = wp.constant(4)

# what a search ended with: values of warpjld.grasp.search.Status
CONVERGED = wp.constant(0)
NO_CONTACT = wp.constant(1)
INSIDE = wp.constant(2)
AT_LIMIT = wp.constant(3)
OPENING = wp.constant(4)

# row k: rotation x y z w and translation of everything beyond k moving joints, and the k-th one's flexion ratio
Chain = wp.types.matrix(shape=(5, 8), dtype=float)


@wp.struct
class Skin:
    """Packed operators of the vertices of one or more coverings; see ``warpjld_kernels.anchored``."""

    ends: wp.array2d(dtype=wp.int32)
    parents: wp.array(dtype=wp.int32)
    offset: wp.array(dtype=wp.vec3)
    segment: wp.array2d(dtype=wp.int32)
    weight: wp.array2d(dtype=float)
    ratio: wp.array2d(dtype=float)
    rotation: wp.array2d(dtype=wp.vec3)
    rounding: wp.array2d(dtype=wp.vec2)
    muscle: wp.array2d(dtype=wp.vec3)
    pair: wp.array2d(dtype=wp.int32)
    between: wp.array2d(dtype=float)
    station: wp.array2d(dtype=float)
    pairs: wp.array2d(dtype=wp.int32)
    across: wp.array2d(dtype=float)
    palm: wp.array2d(dtype=float)
    vertices: int


@wp.struct
class Posture:
    """Joints of F frames, relative to a point of each frame."""

    positions: wp.array2d(dtype=wp.vec3)
    rotations: wp.array2d(dtype=wp.quat)
    flexion_ratio: wp.array2d(dtype=float)


@wp.struct
class Drives:
    """Chains of joints that close together in some frame, one a row.

    The k-th joint goes from ``start`` at ``rate`` up to ``stop`` about ``axis``; its local rotation is
    ``before`` · turn about ``bend`` · ``after``.
    """

    frame: wp.array(dtype=wp.int32)
    reach: wp.array(dtype=float)
    count: wp.array(dtype=wp.int32)
    joint: wp.array2d(dtype=wp.int32)
    rate: wp.array2d(dtype=float)
    start: wp.array2d(dtype=float)
    stop: wp.array2d(dtype=float)
    axis: wp.array2d(dtype=wp.vec3)
    before: wp.array2d(dtype=wp.quat)
    bend: wp.array2d(dtype=wp.vec3)
    after: wp.array2d(dtype=wp.quat)
    direction: wp.array2d(dtype=wp.vec3)
    upright: wp.array2d(dtype=wp.vec3)
    level: wp.array2d(dtype=wp.vec3)
    largest: wp.array2d(dtype=float)
    depth: wp.array2d(dtype=wp.int32)


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
def turned(axis: wp.vec3, angle: float) -> wp.quat:
    half = 0.5 * angle
    s = wp.sin(half)
    return wp.quat(s * axis[0], s * axis[1], s * axis[2], wp.cos(half))


@wp.func
def scaled(w: float, q: wp.quat) -> wp.quat:
    return wp.quat(w * q[0], w * q[1], w * q[2], w * q[3])


@wp.func
def closing_angle(drives: Drives, r: int, k: int, s: float) -> float:
    """Angle of the k-th joint when the chain has closed by s."""
    start = drives.start[r, k]
    stop = drives.stop[r, k]
    angle = start + drives.rate[r, k] * s
    return wp.clamp(angle, wp.min(start, stop), wp.max(start, stop))


@wp.func
def chain_at(posture: Posture, drives: Drives, r: int, s: float) -> Chain:
    """Turns of everything beyond the moving joints when the chain has closed by s."""
    chain = Chain()
    chain[0, 3] = 1.0
    q = wp.quat(0.0, 0.0, 0.0, 1.0)
    t = wp.vec3(0.0)
    f = drives.frame[r]
    for k in range(drives.count[r]):
        start = drives.start[r, k]
        angle = closing_angle(drives, r, k, s)
        at = posture.positions[f, drives.joint[r, k]]
        local = drives.before[r, k] * turned(drives.bend[r, k], angle) * drives.after[r, k]
        first = drives.before[r, k] * turned(drives.bend[r, k], start) * drives.after[r, k]
        turn = turned(drives.axis[r, k], angle - start)
        if local[3] * first[3] < 0.0:  # poses keep local rotations on the side of w ≥ 0
            turn = scaled(-1.0, turn)
        t = t + wp.quat_rotate(q, at - wp.quat_rotate(turn, at))
        q = q * turn
        moved = wp.quat_rotate(local, drives.direction[r, k])
        flexion = wp.atan2(wp.dot(moved, drives.level[r, k]), wp.dot(moved, drives.upright[r, k]))
        for i in range(4):
            chain[k + 1, i] = q[i]
        for i in range(3):
            chain[k + 1, 4 + i] = t[i]
        chain[k + 1, 7] = wp.clamp(flexion * drives.largest[r, k], 0.0, 1.0)
    return chain


@wp.func
def rotation_at(chain: Chain, k: int, q: wp.quat) -> wp.quat:
    return wp.quat(chain[k, 0], chain[k, 1], chain[k, 2], chain[k, 3]) * q


@wp.func
def place_at(chain: Chain, k: int, x: wp.vec3) -> wp.vec3:
    q = wp.quat(chain[k, 0], chain[k, 1], chain[k, 2], chain[k, 3])
    return wp.quat_rotate(q, x) + wp.vec3(chain[k, 4], chain[k, 5], chain[k, 6])


@wp.func
def joint_place(posture: Posture, drives: Drives, chain: Chain, r: int, j: int) -> wp.vec3:
    return place_at(chain, drives.depth[r, j], posture.positions[drives.frame[r], j])


@wp.func
def joint_halfway(skin: Skin, posture: Posture, drives: Drives, chain: Chain, r: int, j: int) -> wp.quat:
    """normalise(q_parent + q_joint) (C22)."""
    f = drives.frame[r]
    own = rotation_at(chain, drives.depth[r, j], posture.rotations[f, j])
    p = skin.parents[j]
    if p < 0:
        return own
    return wp.normalize(own + rotation_at(chain, drives.depth[r, p], posture.rotations[f, p]))


@wp.func
def joint_flexion_ratio(posture: Posture, drives: Drives, chain: Chain, r: int, j: int) -> float:
    k = drives.depth[r, j]
    if k > 0 and drives.joint[r, k - 1] == j:
        return chain[k, 7]
    return posture.flexion_ratio[drives.frame[r], j]


@wp.func
def palm_share(skin: Skin, posture: Posture, drives: Drives, chain: Chain, r: int, v: int) -> float:
    """What approaching palm segments add to the offset's length, as a portion of it: λ^(−k) − 1 (R44, C3)."""
    total = float(0.0)
    stations = skin.across.shape[1]
    for k in range(skin.between.shape[1]):
        amount = skin.between[v, k]
        if amount > 0.0:
            n = skin.pair[v, k]
            a = skin.pairs[n, 0]
            b = skin.pairs[n, 1]
            starts = joint_place(posture, drives, chain, r, skin.ends[b, 0]) - joint_place(
                posture, drives, chain, r, skin.ends[a, 0]
            )
            ends = joint_place(posture, drives, chain, r, skin.ends[b, 1]) - joint_place(
                posture, drives, chain, r, skin.ends[a, 1]
            )
            low = wp.min(int(skin.station[v, k]), stations - 2)
            part = skin.station[v, k] - float(low)
            exponent = skin.palm[v // skin.vertices, n]
            for i in range(2):
                at = float(low + i) / float(stations - 1)
                length = wp.max(wp.length((1.0 - at) * starts + at * ends), 1.0e-9)
                closing = wp.min(wp.log(length / skin.across[n, low + i]), 0.0)
                share = part
                if i == 0:
                    share = 1.0 - part
                total += amount * share * (wp.exp(-exponent * closing) - 1.0)
    return total


@wp.func
def mapped(skin: Skin, posture: Posture, drives: Drives, r: int, v: int, s: float) -> wp.vec3:
    """The covering formula at one vertex when the chain has closed by s."""
    chain = chain_at(posture, drives, r, s)
    f = drives.frame[r]
    foot = wp.vec3(0.0)
    q = wp.quat(0.0, 0.0, 0.0, 0.0)
    scale = 1.0 + palm_share(skin, posture, drives, chain, r, v)
    added = wp.vec3(0.0)
    for k in range(skin.weight.shape[1]):
        weight = skin.weight[v, k]
        if weight > 0.0:
            p = skin.ends[skin.segment[v, k], 0]
            d = skin.ends[skin.segment[v, k], 1]
            start = joint_place(posture, drives, chain, r, p)
            end = joint_place(posture, drives, chain, r, d)
            foot += weight * (start + skin.ratio[v, k] * (end - start))
            w = skin.rotation[v, k]
            q += scaled(w[1], rotation_at(chain, drives.depth[r, p], posture.rotations[f, p]))
            if w[0] != 0.0:
                q += scaled(w[0], joint_halfway(skin, posture, drives, chain, r, p))
            if w[2] != 0.0:
                q += scaled(w[2], joint_halfway(skin, posture, drives, chain, r, d))
            at_p = joint_flexion_ratio(posture, drives, chain, r, p)
            at_d = joint_flexion_ratio(posture, drives, chain, r, d)
            scale += skin.rounding[v, k][0] * at_p + skin.rounding[v, k][1] * at_d
            added += 0.5 * (at_p + at_d) * skin.muscle[v, k]
    return foot + wp.quat_rotate(wp.normalize(q), scale * skin.offset[v] + added)


@wp.func
def over_facet(solids: Solids, o: int, facet: int, point: wp.vec3) -> Hit:
    """Distance to a facet's plane (R73); ``point`` is the place in the facet's basis."""
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
    """How fast a vertex at x can approach anything, an upper bound [m per unit of closing].

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
    """First closing s of a chain at which |distance − target| < tolerance.

    Steps no longer than the distance allows bring the vertex to the first change of sign, which is then halved. Where
    there is none, the closest approach is refined, lest a short contact be stepped over.
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
        hit.distance = hit.distance - task.target
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
            if phase == _FIRST:
                status = INSIDE
                phase = _DONE
            else:
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
    status_out[i] = status
    closing_out[i] = s
    distance_out[i] = hit.distance + task.target
    face_out[i] = hit.face
    point_out[i] = hit.point
    evaluations_out[i] = count
