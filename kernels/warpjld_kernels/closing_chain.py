"""Covering formula at a vertex while one chain of joints closes, with the same operators as the animation (R74).

Between two poses of a search only one chain of joints moves, so that the pose need not be computed again: a joint
distal to k moving ones moves by the product of their rotations about their initial axes.
"""

import warp as wp

wp.set_module_options({"max_unroll": 1, "enable_backward": False})

MOVERS = wp.constant(4)
"""Largest number of joints of a chain."""

# row k: rotation x y z w and translation of everything beyond k moving joints, and the k-th one's flexion ratio
Chain = wp.types.matrix(shape=(MOVERS + 1, 8), dtype=float)


@wp.struct
class Skin:
    """Rows of coefficients of the vertices of one or more coverings; see ``warpjld.covering.rows.Rows``.

    ``turn_input`` counts the halfway rotations, then the bones' rotations; ``rounding_input`` and ``muscle_input``
    joints and segments; ``palm_input`` the palm pairs' stations.
    """

    ends: wp.array2d(dtype=wp.int32)
    parents: wp.array(dtype=wp.int32)
    offset: wp.array(dtype=wp.vec3)
    position_input: wp.array2d(dtype=wp.int32)
    position: wp.array2d(dtype=float)
    turn_input: wp.array2d(dtype=wp.int32)
    turn: wp.array2d(dtype=float)
    rounding_input: wp.array2d(dtype=wp.int32)
    rounding: wp.array2d(dtype=float)
    muscle_input: wp.array2d(dtype=wp.int32)
    muscle: wp.array2d(dtype=wp.vec3)
    palm_input: wp.array2d(dtype=wp.int32)
    palm: wp.array2d(dtype=float)
    pairs: wp.array2d(dtype=wp.int32)
    across: wp.array2d(dtype=float)
    exponent: wp.array2d(dtype=float)
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
    """Angle of the k-th joint at closing s of the chain [rad]."""
    start = drives.start[r, k]
    stop = drives.stop[r, k]
    angle = start + drives.rate[r, k] * s
    return wp.clamp(angle, wp.min(start, stop), wp.max(start, stop))


@wp.func
def chain_at(posture: Posture, drives: Drives, r: int, s: float) -> Chain:
    """Rigid motions of everything distal to the moving joints at closing s of the chain."""
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
    """Relative increase of the offset's length by approaching palm segments: λ^(−k) − 1 (R44, C3)."""
    total = float(0.0)
    stations = skin.across.shape[1]
    for k in range(skin.palm.shape[1]):
        amount = skin.palm[v, k]
        if amount != 0.0:
            n = skin.palm_input[v, k] // stations
            station = skin.palm_input[v, k] - n * stations
            a = skin.pairs[n, 0]
            b = skin.pairs[n, 1]
            starts = joint_place(posture, drives, chain, r, skin.ends[b, 0]) - joint_place(
                posture, drives, chain, r, skin.ends[a, 0]
            )
            ends = joint_place(posture, drives, chain, r, skin.ends[b, 1]) - joint_place(
                posture, drives, chain, r, skin.ends[a, 1]
            )
            at = float(station) / float(stations - 1)
            length = wp.max(wp.length((1.0 - at) * starts + at * ends), 1.0e-9)
            closing = wp.min(wp.log(length / skin.across[n, station]), 0.0)
            total += amount * (wp.exp(-skin.exponent[v // skin.vertices, n] * closing) - 1.0)
    return total


@wp.func
def mapped(skin: Skin, posture: Posture, drives: Drives, r: int, v: int, s: float) -> wp.vec3:
    """Covering formula at one vertex at closing s of the chain [m]."""
    return mapped_by(skin, posture, drives, chain_at(posture, drives, r, s), r, v)


@wp.func
def mapped_by(skin: Skin, posture: Posture, drives: Drives, chain: Chain, r: int, v: int) -> wp.vec3:
    """Covering formula at one vertex for given rigid motions of the chain [m]."""
    f = drives.frame[r]
    foot = wp.vec3(0.0)
    for k in range(skin.position.shape[1]):
        c = skin.position[v, k]
        if c != 0.0:
            foot += c * joint_place(posture, drives, chain, r, skin.position_input[v, k])
    q = wp.quat(0.0, 0.0, 0.0, 0.0)
    joints = skin.parents.shape[0]
    for k in range(skin.turn.shape[1]):
        w = skin.turn[v, k]
        if w != 0.0:
            j = skin.turn_input[v, k]
            if j < joints:
                q += scaled(w, joint_halfway(skin, posture, drives, chain, r, j))
            else:
                q += scaled(w, rotation_at(chain, drives.depth[r, j - joints], posture.rotations[f, j - joints]))
    scale = 1.0 + palm_share(skin, posture, drives, chain, r, v)
    for k in range(skin.rounding.shape[1]):
        g = skin.rounding[v, k]
        if g != 0.0:
            scale += g * joint_flexion_ratio(posture, drives, chain, r, skin.rounding_input[v, k])
    added = wp.vec3(0.0)
    for k in range(skin.muscle.shape[1]):
        m = skin.muscle[v, k]
        if wp.dot(m, m) > 0.0:
            segment = skin.muscle_input[v, k]
            at_p = joint_flexion_ratio(posture, drives, chain, r, skin.ends[segment, 0])
            at_d = joint_flexion_ratio(posture, drives, chain, r, skin.ends[segment, 1])
            added += 0.5 * (at_p + at_d) * m
    return foot + wp.quat_rotate(wp.normalize(q), scale * skin.offset[v] + added)
