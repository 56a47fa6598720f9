"""Operators evaluated straight from a vertex's anchors: for few points, and to pack coefficients."""

import warp as wp

from warpjld_kernels.coefficients import muscle_profile, rotation_weights, rounding

wp.set_module_options({"max_unroll": 1, "enable_backward": False})


@wp.struct
class Anchors:
    """Places of vertices on segments; see ``warpjld.covering.binding.Anchors``."""

    ends: wp.array2d(dtype=wp.int32)
    muscle: wp.array(dtype=float)
    rest_joints: wp.array(dtype=wp.vec3)
    rest: wp.array(dtype=wp.vec3)
    segment: wp.array2d(dtype=wp.int32)
    weight: wp.array2d(dtype=float)
    ratio: wp.array2d(dtype=float)
    side: wp.array2d(dtype=float)
    lift: wp.array2d(dtype=wp.vec3)
    pairs: wp.array2d(dtype=wp.int32)
    pair: wp.array2d(dtype=wp.int32)
    between: wp.array2d(dtype=float)
    station: wp.array2d(dtype=float)
    rigid: wp.array(dtype=wp.int32)


@wp.struct
class Parameters:
    """Parameters of the joints; see ``warpjld.covering.parameters.Parameters``."""

    inflation: wp.array(dtype=float)
    proximity: wp.array2d(dtype=float)
    muscle: wp.array(dtype=float)
    peak: wp.array(dtype=float)
    exponents: wp.array2d(dtype=float)
    palm: wp.array(dtype=float)


@wp.func
def rest_offset(anchors: Anchors, v: int) -> wp.vec3:
    """Offset of a vertex from the affine combination of joints it hangs on."""
    foot = wp.vec3(0.0)
    if anchors.rigid[v] >= 0:
        foot = anchors.rest_joints[anchors.rigid[v]]
    for k in range(anchors.weight.shape[1]):
        s = anchors.segment[v, k]
        start = anchors.rest_joints[anchors.ends[s, 0]]
        end = anchors.rest_joints[anchors.ends[s, 1]]
        foot += anchors.weight[v, k] * (start + anchors.ratio[v, k] * (end - start))
    return anchors.rest[v] - foot


@wp.func
def round_up(anchors: Anchors, parameters: Parameters, v: int, k: int) -> wp.vec2:
    """Part of the offset that full flexion of the k-th segment's proximal and distal joint adds to it (R58–R62)."""
    s = anchors.segment[v, k]
    p = anchors.ends[s, 0]
    d = anchors.ends[s, 1]
    reach = rounding(anchors.ratio[v, k], anchors.side[v, k], parameters.proximity[p, 0], parameters.proximity[d, 1])
    weight = anchors.weight[v, k]
    return wp.vec2(weight * parameters.inflation[p] * reach[0], weight * parameters.inflation[d] * reach[1])


@wp.func
def swell(anchors: Anchors, parameters: Parameters, v: int, k: int) -> wp.vec3:
    """What the k-th segment's muscle adds to the offset when both its joints are fully flexed (R63–R65)."""
    p = anchors.ends[anchors.segment[v, k], 0]
    profile = muscle_profile(
        anchors.ratio[v, k], parameters.peak[p], parameters.exponents[p, 0], parameters.exponents[p, 1]
    )
    amplitude = anchors.muscle[anchors.segment[v, k]] * parameters.muscle[p]
    return anchors.weight[v, k] * amplitude * (1.0 - anchors.side[v, k]) * profile * anchors.lift[v, k]


@wp.kernel
def pack_coefficients(
    # model
    anchors: Anchors,
    parameters: Parameters,
    # out
    offset_out: wp.array(dtype=wp.vec3),
    rotation_out: wp.array2d(dtype=wp.vec3),
    rounding_out: wp.array2d(dtype=wp.vec2),
    muscle_out: wp.array2d(dtype=wp.vec3),
):
    """Rest offset; per operator the weights of its three rotations, its two roundings, and its muscle."""
    v = wp.tid()
    offset_out[v] = rest_offset(anchors, v)
    for k in range(anchors.weight.shape[1]):
        s = anchors.segment[v, k]
        rotation_out[v, k] = anchors.weight[v, k] * rotation_weights(
            anchors.ratio[v, k],
            anchors.side[v, k],
            parameters.proximity[anchors.ends[s, 0], 0],
            parameters.proximity[anchors.ends[s, 1], 1],
        )
        rounding_out[v, k] = round_up(anchors, parameters, v, k)
        muscle_out[v, k] = swell(anchors, parameters, v, k)


# The sums below are functions of their own for the sake of their derivatives: in the body of a kernel Warp's backward
# pass does not replay a loop, and what follows it, such as a normalisation, would see the sum before its first term.


@wp.func
def hang(anchors: Anchors, positions: wp.array2d(dtype=wp.vec3), f: int, v: int) -> wp.vec3:
    """Σ c_j J_j': the place on the segments from which a vertex is offset."""
    foot = wp.vec3(0.0)
    if anchors.rigid[v] >= 0:
        foot = positions[f, anchors.rigid[v]]
    for k in range(anchors.weight.shape[1]):
        s = anchors.segment[v, k]
        start = positions[f, anchors.ends[s, 0]]
        end = positions[f, anchors.ends[s, 1]]
        foot += anchors.weight[v, k] * (start + anchors.ratio[v, k] * (end - start))
    return foot


@wp.func
def blend(weight: float, q: wp.quat) -> wp.quat:
    return wp.quat(weight * q[0], weight * q[1], weight * q[2], weight * q[3])


@wp.func
def turn(
    anchors: Anchors,
    parameters: Parameters,
    halfway: wp.array2d(dtype=wp.quat),
    rotations: wp.array2d(dtype=wp.quat),
    f: int,
    v: int,
) -> wp.quat:
    """Σ w_k q_k, not normalised."""
    total = wp.quat(0.0, 0.0, 0.0, 0.0)
    if anchors.rigid[v] >= 0:
        total = rotations[f, anchors.rigid[v]]
    for k in range(anchors.weight.shape[1]):
        s = anchors.segment[v, k]
        p = anchors.ends[s, 0]
        d = anchors.ends[s, 1]
        w = anchors.weight[v, k] * rotation_weights(
            anchors.ratio[v, k], anchors.side[v, k], parameters.proximity[p, 0], parameters.proximity[d, 1]
        )
        total += blend(w[0], halfway[f, p]) + blend(w[1], rotations[f, p]) + blend(w[2], halfway[f, d])
    return total


@wp.func
def roundings(
    anchors: Anchors, parameters: Parameters, flexion_ratio: wp.array2d(dtype=float), f: int, v: int
) -> float:
    """What the flexed joints add to the offset's length, as a portion of it (R58–R62)."""
    total = float(0.0)
    for k in range(anchors.weight.shape[1]):
        s = anchors.segment[v, k]
        rounded = round_up(anchors, parameters, v, k)
        total += rounded[0] * flexion_ratio[f, anchors.ends[s, 0]] + rounded[1] * flexion_ratio[f, anchors.ends[s, 1]]
    return total


@wp.func
def muscles(
    anchors: Anchors, parameters: Parameters, flexion_ratio: wp.array2d(dtype=float), f: int, v: int
) -> wp.vec3:
    """What the muscles add to the offset; each of a segment's joints drives half of its muscle (R63)."""
    total = wp.vec3(0.0)
    for k in range(anchors.weight.shape[1]):
        s = anchors.segment[v, k]
        driven = 0.5 * (flexion_ratio[f, anchors.ends[s, 0]] + flexion_ratio[f, anchors.ends[s, 1]])
        total += driven * swell(anchors, parameters, v, k)
    return total


@wp.func
def palm_inflation(anchors: Anchors, parameters: Parameters, closing: wp.array3d(dtype=float), f: int, v: int) -> float:
    """What approaching palm segments add to the offset's length, as a portion of it: λ^(−k) − 1 (R44, C3)."""
    total = float(0.0)
    for k in range(anchors.between.shape[1]):
        n = anchors.pair[v, k]
        amount = anchors.between[v, k]
        if amount > 0.0:
            place = anchors.station[v, k]
            low = wp.min(int(place), closing.shape[2] - 2)
            part = place - float(low)
            a = anchors.ends[anchors.pairs[n, 0], 0]
            b = anchors.ends[anchors.pairs[n, 1], 0]
            exponent = 0.5 * (parameters.palm[a] + parameters.palm[b])
            before = wp.exp(-exponent * closing[f, n, low]) - 1.0
            beyond = wp.exp(-exponent * closing[f, n, low + 1]) - 1.0
            total += amount * ((1.0 - part) * before + part * beyond)
    return total


@wp.func
def deformed(
    anchors: Anchors,
    parameters: Parameters,
    positions: wp.array2d(dtype=wp.vec3),
    halfway: wp.array2d(dtype=wp.quat),
    rotations: wp.array2d(dtype=wp.quat),
    flexion_ratio: wp.array2d(dtype=float),
    closing: wp.array3d(dtype=float),
    f: int,
    v: int,
) -> wp.vec3:
    """S' = Σ c_j J_j' + rot(normalise(Σ w_k q_k), g d + Σ m_s e_s); ``closing`` holds log λ of palm pairs (C3)."""
    scale = (
        1.0 + roundings(anchors, parameters, flexion_ratio, f, v) + palm_inflation(anchors, parameters, closing, f, v)
    )
    offset = scale * rest_offset(anchors, v) + muscles(anchors, parameters, flexion_ratio, f, v)
    q = wp.normalize(turn(anchors, parameters, halfway, rotations, f, v))
    return hang(anchors, positions, f, v) + wp.quat_rotate(q, offset)


@wp.kernel
def deform_points(
    # model
    anchors: Anchors,
    parameters: Parameters,
    chosen: wp.array(dtype=wp.int32),
    # pose
    positions: wp.array2d(dtype=wp.vec3),
    halfway: wp.array2d(dtype=wp.quat),
    rotations: wp.array2d(dtype=wp.quat),
    flexion_ratio: wp.array2d(dtype=float),
    closing: wp.array3d(dtype=float),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """The covering formula at chosen vertices."""
    f, i = wp.tid()
    points_out[f, i] = deformed(
        anchors, parameters, positions, halfway, rotations, flexion_ratio, closing, f, chosen[i]
    )
