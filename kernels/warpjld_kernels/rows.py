"""Covering formula evaluated directly from a vertex's rows of coefficients, for few points and for derivatives."""

import warp as wp

wp.set_module_options({"max_unroll": 1, "enable_backward": False})


@wp.struct
class Rows:
    """Coefficients of V vertices and the pose input each belongs to; see ``warpjld.covering.rows.Rows``."""

    position_input: wp.array2d(dtype=wp.int32)
    position: wp.array2d(dtype=float)
    turn_input: wp.array2d(dtype=wp.int32)
    turn: wp.array2d(dtype=float)
    scale_input: wp.array2d(dtype=wp.int32)
    scale: wp.array2d(dtype=float)
    muscle_input: wp.array2d(dtype=wp.int32)
    muscle: wp.array2d(dtype=wp.vec3)
    offset: wp.array(dtype=wp.vec3)


# The sums below are functions of their own for the sake of their derivatives: in the body of a kernel Warp's backward
# pass does not replay a loop, and what follows it, such as a normalisation, would see the sum before its first term.


@wp.func
def hang(rows: Rows, positions: wp.array2d(dtype=wp.vec3), f: int, v: int) -> wp.vec3:
    """Σ c_j J_j': the point on the segments from which a vertex is offset [m]."""
    foot = wp.vec3(0.0)
    for k in range(rows.position.shape[1]):
        foot += rows.position[v, k] * positions[f, rows.position_input[v, k]]
    return foot


@wp.func
def turn(rows: Rows, turns: wp.array2d(dtype=wp.quat), f: int, v: int) -> wp.quat:
    """Σ w_k q_k, not normalised."""
    total = wp.quat(0.0, 0.0, 0.0, 0.0)
    for k in range(rows.turn.shape[1]):
        w = rows.turn[v, k]
        q = turns[f, rows.turn_input[v, k]]
        total += wp.quat(w * q[0], w * q[1], w * q[2], w * q[3])
    return total


@wp.func
def growth(rows: Rows, scalars: wp.array2d(dtype=float), f: int, v: int) -> float:
    """Relative increase of the offset's length by flexed joints and approaching palm segments, Σ s_i g_i."""
    total = float(0.0)
    for k in range(rows.scale.shape[1]):
        total += rows.scale[v, k] * scalars[f, rows.scale_input[v, k]]
    return total


@wp.func
def muscles(rows: Rows, scalars: wp.array2d(dtype=float), f: int, v: int) -> wp.vec3:
    """Displacement by the muscles, Σ m_i e_i [m] (R63)."""
    total = wp.vec3(0.0)
    for k in range(rows.muscle.shape[1]):
        total += scalars[f, rows.muscle_input[v, k]] * rows.muscle[v, k]
    return total


@wp.func
def deformed(
    rows: Rows,
    positions: wp.array2d(dtype=wp.vec3),
    turns: wp.array2d(dtype=wp.quat),
    scalars: wp.array2d(dtype=float),
    f: int,
    v: int,
) -> wp.vec3:
    """S' = Σ c_j J_j' + rot(normalise(Σ w_k q_k), (1 + Σ s_i g_i) d + Σ m_i e_i)."""
    offset = (1.0 + growth(rows, scalars, f, v)) * rows.offset[v] + muscles(rows, scalars, f, v)
    return hang(rows, positions, f, v) + wp.quat_rotate(wp.normalize(turn(rows, turns, f, v)), offset)


@wp.kernel
def deform_rows(
    # model
    rows: Rows,
    chosen: wp.array(dtype=wp.int32),
    # pose
    positions: wp.array2d(dtype=wp.vec3),
    turns: wp.array2d(dtype=wp.quat),
    scalars: wp.array2d(dtype=float),
    # out
    points_out: wp.array2d(dtype=wp.vec3),
):
    """The covering formula at chosen vertices.

    ``turns`` are the halfway rotations, then the bones' rotations; ``scalars`` the flexion ratios, the thickening of
    the palm pairs and the drive of the muscles.
    """
    f, i = wp.tid()
    points_out[f, i] = deformed(rows, positions, turns, scalars, f, chosen[i])
