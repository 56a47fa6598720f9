"""Smallest closings of joint chains at which the first of many vertices touches, and smallest openings that
separate."""

import warp as wp

from warpjld_kernels.closing_chain import Chain, Drives, Posture, Skin, chain_at, mapped_by
from warpjld_kernels.flexion_search import (
    CONVERGED,
    INSIDE,
    NO_CONTACT,
    OPENING,
    top_speed,
)
from warpjld_kernels.lanes import VECTORISED, prelude
from warpjld_kernels.signed_grid import SignedGrid, distance_bounds
from warpjld_kernels.surface_distance import Hit, Solids, nearest

wp.set_module_options({**VECTORISED, "max_unroll": 1})

# steps towards the object, as parts of the chain's reach
_SHORTEST = wp.constant(64)
_LONGEST = wp.constant(8)  # a march takes at least eight steps over its reach, however far the surface is
_FINEST = wp.constant(128)  # the same of a step by the grid, below which a vertex is marched
_MOST = wp.constant(160)  # evaluations of one search; halving to 1e-7 needs 24, the rest is marching
_NEVER = wp.constant(1.0e30)  # share of the reach of a vertex that never touches


@wp.struct
class Hands:
    """G hands on an object in its own frame: the skin, their joints, the chains that move, and where each object is
    (relative to the point that a hand's joints are relative to)."""

    solids: Solids
    grid: SignedGrid
    skin: Skin
    posture: Posture
    drives: Drives
    position: wp.array(dtype=wp.vec3)
    rotation: wp.array(dtype=wp.quat)


@wp.struct
class Touch:
    """Status of a vertex's search, and the closing found."""

    status: int
    closing: float


@wp.func
def seen_from_object(hands: Hands, chain: Chain, r: int, v: int) -> wp.vec3:
    g = hands.drives.frame[r]
    x = mapped_by(hands.skin, hands.posture, hands.drives, chain, r, v)
    return wp.quat_rotate_inv(hands.rotation[g], x - hands.position[g])


@wp.func
def march(
    hands: Hands, r: int, v: int, target: float, tolerance: float, best: float, first: Hit, speed: float
) -> Touch:
    """First closing below ``best`` at which |distance − target| < tolerance, from the initial closest point.

    Steps bounded by the distance (sphere tracing) lead to the first change of sign, which is then bisected.
    """
    touch = Touch()
    touch.status = NO_CONTACT
    reach = hands.drives.reach[r]
    hit = first
    distance = hit.distance - target
    low = float(0.0)
    high = float(0.0)
    s = float(0.0)
    halving = bool(False)
    going = bool(True)
    count = int(0)
    while going:
        if halving:
            if distance < 0.0:
                high = s
            else:
                low = s
            s = 0.5 * (low + high)
            if count > _MOST or high - low < 1.0e-7 or s <= low or s >= high:
                touch.status = OPENING
                touch.closing = s
                going = False
        elif s >= reach or s + distance / speed > best:
            going = False
        else:
            low = s
            s = wp.min(s + wp.clamp(distance / speed, reach / float(_SHORTEST), reach / float(_LONGEST)), reach)
        if low >= best:
            touch.status = NO_CONTACT
            going = False
        if going:
            local = seen_from_object(hands, chain_at(hands.posture, hands.drives, r, s), r, v)
            # the last nearest point is on the surface still
            limit = wp.float64(1.0001 * wp.length(local - hit.point) + 1.0e-6)
            hit = nearest(hands.solids, 0, wp.vec3d(local), limit)
            distance = hit.distance - target
            count += 1
            if wp.abs(distance) < tolerance:
                touch.status = CONVERGED
                touch.closing = s
                going = False
            elif distance < 0.0 and not halving:
                high = s
                halving = True
                s = high  # halved above, from the side that is inside
    return touch


@wp.func_native(
    prelude(8)
    + """
    const float* own = earliest.data + size_t(row) * earliest.shape[1];
    Floats low = Floats(3e38f);
    float least = best;
    int n = 0;
    for (; n + N <= count; n += N) low = LOWEST(low, *(const Stored*)(own + n));
    for (; n < count; ++n) least = own[n] < least ? own[n] : least;
    for (int l = 0; l < N; ++l) least = PICK(low, l) < least ? PICK(low, l) : least;
    if (!(least < best)) return -1;
    for (n = 0; n + N <= count; n += N)
        if (const unsigned int found = LANES_OF(*(const Stored*)(own + n) == least)) return n + FIRST_OF(found);
    for (; n < count; ++n) if (own[n] == least) return n;
    return -1;
"""
)
def soonest_of(earliest: wp.array2d(dtype=float), row: int, count: int, best: float) -> int:
    """First of the smallest numbers of a row below ``best``; -1 if there is none."""


@wp.kernel
def first_touch(
    hands: Hands,
    # vertices of each of D digits that may touch
    vertex: wp.array(dtype=wp.int32),
    first_of: wp.array(dtype=wp.int32),
    target: float,
    tolerance: float,
    # scratch
    earliest: wp.array2d(dtype=float),
    speeds: wp.array2d(dtype=float),
    # out
    status_out: wp.array(dtype=wp.int32),
    closing_out: wp.array(dtype=float),
):
    """Smallest closing of a chain, row r for digit r mod D, at which one of its digit's vertices touches.

    For every vertex a closing is kept before which it cannot touch. The smallest of these is advanced by the grid's
    lower bound of the distance over the vertex's speed; where the grid gives no progress, the vertex is traced exactly.
    The search ends when the smallest exceeds a contact already found.
    """
    r = wp.tid()
    digit = r % (first_of.shape[0] - 1)
    g = hands.drives.frame[r]
    first = first_of[digit]
    count = first_of[digit + 1] - first
    reach = hands.drives.reach[r]
    open_hand = chain_at(hands.posture, hands.drives, r, 0.0)
    status = int(NO_CONTACT)
    best = reach * 1.00001  # what comes later does not come
    winner = int(-1)
    n = int(0)
    while n < count:
        x = mapped_by(hands.skin, hands.posture, hands.drives, open_hand, r, vertex[first + n])
        local = wp.vec3d(wp.quat_rotate_inv(hands.rotation[g], x - hands.position[g]))
        two = distance_bounds(hands.solids, hands.grid, local)
        distance = float(two[0]) - target
        if distance < tolerance:
            hit = nearest(hands.solids, 0, local, two[1])
            distance = hit.distance - target
            if wp.abs(distance) < tolerance:
                status = CONVERGED
                winner = n
            elif distance < 0.0:
                status = INSIDE
                winner = n
        if winner >= 0:
            best = 0.0
            n = count
        else:
            speeds[r, n] = top_speed(hands.posture, hands.drives, r, x)
            earliest[r, n] = (distance - tolerance) / speeds[r, n]
            n += 1
    looking = winner < 0 and reach >= 1.0e-6
    while looking:
        at = soonest_of(earliest, r, count, best)
        if at < 0:
            looking = False
        else:
            soonest = earliest[r, at]
            v = vertex[first + at]
            chain = chain_at(hands.posture, hands.drives, r, soonest)
            two = distance_bounds(hands.solids, hands.grid, wp.vec3d(seen_from_object(hands, chain, r, v)))
            ahead = (float(two[0]) - target - tolerance) / speeds[r, at]
            if ahead > reach / float(_FINEST):
                earliest[r, at] = soonest + ahead
            else:
                earliest[r, at] = _NEVER
                local = wp.vec3d(seen_from_object(hands, open_hand, r, v))
                two = distance_bounds(hands.solids, hands.grid, local)
                hit = nearest(hands.solids, 0, local, two[1])
                touch = march(hands, r, v, target, tolerance, best, hit, speeds[r, at])
                if touch.status != NO_CONTACT and (touch.closing < best or (touch.closing == best and at < winner)):
                    best = touch.closing
                    status = touch.status
                    winner = at
    status_out[r] = status
    closing_out[r] = best


@wp.kernel
def distances_at(
    hands: Hands,
    # pairs of a chain and a vertex
    row: wp.array(dtype=wp.int32),
    vertex: wp.array(dtype=wp.int32),
    closing: float,
    # out
    distance_out: wp.array(dtype=float),
):
    """Signed distances of vertices at closings of their chains, limited to the chains' ends [m]."""
    i = wp.tid()
    chain = chain_at(hands.posture, hands.drives, row[i], closing)
    local = seen_from_object(hands, chain, row[i], vertex[i])
    two = distance_bounds(hands.solids, hands.grid, wp.vec3d(local))
    hit = nearest(hands.solids, 0, wp.vec3d(local), two[1])
    distance_out[i] = hit.distance


@wp.kernel
def least_opening(
    hands: Hands,
    # pairs of a vertex and its least distance, those of a chain one after another
    vertex: wp.array(dtype=wp.int32),
    floor: wp.array(dtype=float),
    first_of: wp.array(dtype=wp.int32),
    widest: float,
    cuts: int,
    pieces: int,
    # out
    by_out: wp.array(dtype=float),
):
    """Smallest opening of a chain at which all its vertices have their least distances, by repeated subdivision.

    The widest opening if there is none.
    """
    r = wp.tid()
    short = float(0.0)
    enough = widest
    for _ in range(cuts):
        step = (enough - short) / float(pieces)
        piece = int(1)
        deep = bool(True)
        while deep and piece <= pieces:
            chain = chain_at(hands.posture, hands.drives, r, short + float(piece) * step)
            deep = bool(False)
            n = first_of[r]
            while n < first_of[r + 1] and not deep:
                local = seen_from_object(hands, chain, r, vertex[n])
                two = distance_bounds(hands.solids, hands.grid, wp.vec3d(local))
                if float(two[0]) < floor[n]:
                    hit = nearest(hands.solids, 0, wp.vec3d(local), two[1])
                    deep = hit.distance < floor[n]
                n += 1
            if deep:
                piece += 1
        piece = wp.min(piece, pieces)
        enough = short + float(piece) * step
        short = short + float(piece - 1) * step
    by_out[r] = enough
