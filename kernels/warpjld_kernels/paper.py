"""The hard-edged operators as the paper has them: bases of cross products, one segment or one palm pair a vertex.

A basis is x along the segment (or the virtual segment), y the blended normal, z = x × y. The blended normal leans
towards the bisector plane at a joint, so y is not orthogonal to x, and must not be made so: its lean is the very thing
that keeps the thickness outside a bent joint. Coordinates are therefore taken with the inverse of the initial basis,
and the rest pose is exact (C24).
"""

import warp as wp

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


@wp.struct
class Parameters:
    """Parameters of the joints; see ``warpjld.covering.parameters.Parameters``."""

    inflation: wp.array(dtype=float)
    proximity: wp.array2d(dtype=float)
    muscle: wp.array(dtype=float)
    peak: wp.array(dtype=float)
    exponents: wp.array2d(dtype=float)
    palm: wp.array(dtype=float)


@wp.struct
class Places:
    """Where vertices lie; see ``warpjld.covering.paper_places.PaperPlaces``."""

    ends: wp.array2d(dtype=wp.int32)
    muscle: wp.array(dtype=float)
    segment: wp.array2d(dtype=wp.int32)
    ratio: wp.array2d(dtype=float)
    across: wp.array(dtype=float)
    between: wp.array(dtype=wp.int32)
    external: wp.array(dtype=wp.int32)
    rigid: wp.array(dtype=wp.int32)
    whole: wp.array(dtype=wp.int32)


@wp.func
def external_normal(
    s: int,
    ratio: float,
    places: Places,
    parameters: Parameters,
    original: wp.array3d(dtype=wp.vec3),
    modified: wp.array2d(dtype=wp.vec3),
    f: int,
) -> wp.vec3:
    """y axis of an external vertex on one segment: areas 1, 2 (Fig. 8, C6, C9) and the buffer 3 (Fig. 9, C5)."""
    p = places.ends[s, 0]
    d = places.ends[s, 1]
    proximal = parameters.proximity[p, 0]
    distal = parameters.proximity[d, 1]
    t = wp.clamp(ratio, 0.0, 1.0)
    if t < proximal:
        part = t / proximal
        return wp.normalize(part * original[f, s, 0] + (1.0 - part) * modified[f, p])
    if 1.0 - t < distal:
        part = (1.0 - t) / distal
        return wp.normalize(part * original[f, s, 1] + (1.0 - part) * modified[f, d])
    part = (t - proximal) / wp.max(1.0 - distal - proximal, 1.0e-6)
    return wp.normalize(part * original[f, s, 1] + (1.0 - part) * original[f, s, 0])


@wp.func
def internal_normal(s: int, ratio: float, places: Places, modified: wp.array2d(dtype=wp.vec3), f: int) -> wp.vec3:
    """y axis of an internal vertex on one segment (Fig. 10)."""
    t = wp.clamp(ratio, 0.0, 1.0)
    return wp.normalize(t * modified[f, places.ends[s, 1]] + (1.0 - t) * modified[f, places.ends[s, 0]])


@wp.func
def foot(v: int, k: int, places: Places, positions: wp.array2d(dtype=wp.vec3), f: int) -> wp.vec3:
    """Projection of a vertex on the k-th of its segments: P + R (D − P) (C2, R40)."""
    s = places.segment[v, k]
    start = positions[f, places.ends[s, 0]]
    return start + places.ratio[v, k] * (positions[f, places.ends[s, 1]] - start)


@wp.func
def basis(
    v: int,
    places: Places,
    parameters: Parameters,
    positions: wp.array2d(dtype=wp.vec3),
    original: wp.array3d(dtype=wp.vec3),
    modified: wp.array2d(dtype=wp.vec3),
    f: int,
) -> wp.mat33:
    """Axes of a vertex as columns (R51–R56)."""
    a = places.segment[v, 0]
    x = positions[f, places.ends[a, 1]] - positions[f, places.ends[a, 0]]
    y = wp.vec3(0.0)
    if places.between[v] != 0:
        b = places.segment[v, 1]
        x = foot(v, 1, places, positions, f) - foot(v, 0, places, positions, f)
        here = external_normal(a, places.ratio[v, 0], places, parameters, original, modified, f)
        there = external_normal(b, places.ratio[v, 1], places, parameters, original, modified, f)
        y = wp.normalize((1.0 - places.across[v]) * here + places.across[v] * there)  # Fig. 5
    elif places.external[v] != 0:
        y = external_normal(a, places.ratio[v, 0], places, parameters, original, modified, f)
    else:
        y = internal_normal(a, places.ratio[v, 0], places, modified, f)
    x = wp.normalize(x)
    if places.whole[v] != 0:
        y = wp.normalize(y - wp.dot(x, y) * x)  # no shear
    return wp.matrix_from_cols(x, y, wp.normalize(wp.cross(x, y)))


@wp.func
def origin(v: int, places: Places, positions: wp.array2d(dtype=wp.vec3), f: int) -> wp.vec3:
    """Projection on the segment, or on the virtual segment in between (R43, R53)."""
    here = foot(v, 0, places, positions, f)
    if places.between[v] != 0:
        here += places.across[v] * (foot(v, 1, places, positions, f) - here)
    return here


@wp.func
def rounded(
    v: int,
    local: wp.vec3,
    places: Places,
    parameters: Parameters,
    flexion_ratio: wp.array2d(dtype=float),
    f: int,
) -> wp.vec3:
    """y and z of an external vertex in a joint's area grow with the joint's flexion (§6.1, R58–R62)."""
    s = places.segment[v, 0]
    p = places.ends[s, 0]
    d = places.ends[s, 1]
    t = wp.clamp(places.ratio[v, 0], 0.0, 1.0)
    grown = float(1.0)
    if t < parameters.proximity[p, 0]:
        grown += parameters.inflation[p] * flexion_ratio[f, p] * (1.0 - t / parameters.proximity[p, 0])
    elif 1.0 - t < parameters.proximity[d, 1]:
        grown += parameters.inflation[d] * flexion_ratio[f, d] * (1.0 - (1.0 - t) / parameters.proximity[d, 1])
    return wp.vec3(local[0], grown * local[1], grown * local[2])


@wp.func
def swollen(
    v: int,
    local: wp.vec3,
    places: Places,
    parameters: Parameters,
    flexion_ratio: wp.array2d(dtype=float),
    f: int,
) -> wp.vec3:
    """y of an internal vertex grows by two functions a^b that meet in a cusp (§6.2 Fig. 11, R63–R65).

    Each of the segment's joints drives half of the muscle.
    """
    s = places.segment[v, 0]
    p = places.ends[s, 0]
    t = wp.clamp(places.ratio[v, 0], 0.0, 1.0)
    peak = parameters.peak[p]
    profile = float(0.0)
    if t <= peak:
        profile = wp.pow(t / peak, parameters.exponents[p, 0])
    else:
        profile = wp.pow((1.0 - t) / (1.0 - peak), parameters.exponents[p, 1])
    driven = 0.5 * (flexion_ratio[f, p] + flexion_ratio[f, places.ends[s, 1]])
    grown = 1.0 + places.muscle[s] * parameters.muscle[p] * driven * profile
    return wp.vec3(local[0], grown * local[1], local[2])


@wp.kernel
def express(
    # model
    places: Places,
    parameters: Parameters,
    rest: wp.array(dtype=wp.vec3),
    # rest pose, one frame
    positions: wp.array2d(dtype=wp.vec3),
    original: wp.array3d(dtype=wp.vec3),
    modified: wp.array2d(dtype=wp.vec3),
    flexion_ratio: wp.array2d(dtype=float),
    # out
    coordinates_out: wp.array(dtype=wp.vec3),
    virtual_out: wp.array(dtype=float),
):
    """Coordinates of vertices in their initial bases (§5.5, R57), as they are where joints are straight (R25), and
    initial lengths of their virtual segments."""
    v = wp.tid()
    if places.rigid[v] >= 0:
        coordinates_out[v] = rest[v] - positions[0, places.rigid[v]]
        virtual_out[v] = 1.0
        return
    axes = basis(v, places, parameters, positions, original, modified, 0)
    local = wp.inverse(axes) * (rest[v] - origin(v, places, positions, 0))
    grown = wp.vec3(1.0)
    if places.between[v] == 0 and places.whole[v] == 0:
        if places.external[v] != 0:
            grown = rounded(v, grown, places, parameters, flexion_ratio, 0)
        else:
            grown = swollen(v, grown, places, parameters, flexion_ratio, 0)
    coordinates_out[v] = wp.cw_div(local, grown)
    virtual_out[v] = wp.length(foot(v, 1, places, positions, 0) - foot(v, 0, places, positions, 0))


@wp.kernel
def deform_paper(
    # model
    places: Places,
    parameters: Parameters,
    coordinates: wp.array(dtype=wp.vec3),
    virtual_length: wp.array(dtype=float),
    chosen: wp.array(dtype=wp.int32),
    # pose
    positions: wp.array2d(dtype=wp.vec3),
    original: wp.array3d(dtype=wp.vec3),
    modified: wp.array2d(dtype=wp.vec3),
    flexion_ratio: wp.array2d(dtype=float),
    rotations: wp.array2d(dtype=wp.quat),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """Inflated coordinates, re-emitted in the final basis from the final projection (R57).

    What is rigid goes with the bone that begins at its joint.
    """
    f, i = wp.tid()
    v = chosen[i]
    local = coordinates[v]
    hard = places.rigid[v]
    if hard >= 0:
        points_out[f, i] = positions[f, hard] + wp.quat_rotate(wp.normalize(rotations[f, hard]), local)
        return
    if places.whole[v] != 0:
        pass  # a nail or a bracelet: neither rounded nor swollen
    elif places.between[v] != 0:
        # approaching neighbours: the scale factor's inflation (§4, R44, C3)
        apart = wp.length(foot(v, 1, places, positions, f) - foot(v, 0, places, positions, f))
        closer = wp.clamp(apart / virtual_length[v], 1.0e-3, 1.0)
        a = places.ends[places.segment[v, 0], 0]
        b = places.ends[places.segment[v, 1], 0]
        local = local * wp.pow(closer, -0.5 * (parameters.palm[a] + parameters.palm[b]))
    elif places.external[v] != 0:
        local = rounded(v, local, places, parameters, flexion_ratio, f)
    else:
        local = swollen(v, local, places, parameters, flexion_ratio, f)
    axes = basis(v, places, parameters, positions, original, modified, f)
    points_out[f, i] = origin(v, places, positions, f) + axes * local
