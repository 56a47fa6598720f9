"""Operators evaluated straight from a vertex's anchors: for gradients, for few points, and to pack coefficients."""

import warp as wp

from warpjld_kernels.coefficients import muscle_profile, rotation_weights, rounding

wp.set_module_options({"max_unroll": 1})


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


@wp.func
def blend(weight: float, q: wp.quat) -> wp.quat:
    return wp.quat(weight * q[0], weight * q[1], weight * q[2], weight * q[3])


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
    """The covering formula at chosen vertices, differentiable in parameters and pose.

    S' = Σ c_j J_j' + rot(normalise(Σ w_k q_k), g d + Σ m_s e_s); ``closing`` holds log λ of palm pairs (C3).
    """
    f, i = wp.tid()
    v = chosen[i]
    foot = wp.vec3(0.0)
    turn = wp.quat(0.0, 0.0, 0.0, 0.0)
    scale = float(1.0)
    muscles = wp.vec3(0.0)
    for k in range(anchors.weight.shape[1]):
        weight = anchors.weight[v, k]
        if weight > 0.0:
            s = anchors.segment[v, k]
            p = anchors.ends[s, 0]
            d = anchors.ends[s, 1]
            ratio = anchors.ratio[v, k]
            foot += weight * (positions[f, p] + ratio * (positions[f, d] - positions[f, p]))
            w = weight * rotation_weights(
                ratio, anchors.side[v, k], parameters.proximity[p, 0], parameters.proximity[d, 1]
            )
            turn += blend(w[0], halfway[f, p]) + blend(w[1], rotations[f, p]) + blend(w[2], halfway[f, d])
            rounded = round_up(anchors, parameters, v, k)
            scale += rounded[0] * flexion_ratio[f, p] + rounded[1] * flexion_ratio[f, d]
            # each of a segment's joints drives half of its muscle
            muscles += 0.5 * (flexion_ratio[f, p] + flexion_ratio[f, d]) * swell(anchors, parameters, v, k)
    for k in range(2):
        if anchors.between[v, k] > 0.0:
            n = anchors.pair[v, k]
            place = anchors.station[v, k]
            low = wp.min(int(place), closing.shape[2] - 2)
            part = place - float(low)
            a = anchors.ends[anchors.pairs[n, 0], 0]
            b = anchors.ends[anchors.pairs[n, 1], 0]
            exponent = 0.5 * (parameters.palm[a] + parameters.palm[b])
            grown = (1.0 - part) * (wp.exp(-exponent * closing[f, n, low]) - 1.0)
            grown += part * (wp.exp(-exponent * closing[f, n, low + 1]) - 1.0)
            scale += anchors.between[v, k] * grown
    offset = scale * rest_offset(anchors, v) + muscles
    points_out[f, i] = foot + wp.quat_rotate(wp.normalize(turn), offset)
