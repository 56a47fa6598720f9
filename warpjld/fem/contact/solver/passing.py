"""Detection of bodies that pass through each other: steps too long for contact search, and nodes deep in other bodies.

Contact search reaches about two element edges to both sides of a surface. A larger motion in one step may begin in
front of a surface and end behind it, or so deep that no contact is found. Both are detected independently of contact
points, by distances to the whole boundary of the other body.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.enclosure import Enclosure
from warpjld.fem.contact.interface.mortar import Mortar
from warpjld.fem.contact.interface.own_elements import inside_own
from warpjld.fem.contact.interface.surface import ContactSurface
from warpjld.fem.contact.obstacles.obstacle import Obstacle
from warpjld.fem.contact.obstacles.thickness import half_thickness, relative_paths
from warpjld.fem.load.prescribed import components

__all__ = ["LEAST_SHARE", "Passing", "guess_jumps"]

_FOLLOWED = 0.75
"""Largest predicted depth behind a surface, over the search distance of contact, which fades beyond."""
_DEEP = 0.5
"""Admissible depth of an inactive node in another body, in element edges: faces that do not match overlap somewhat."""
LEAST_SHARE = 1.0 / 64.0
"""Smallest fraction to which a step is cut."""
_THINNEST = 2.5e-4
"""Smallest half thickness of obstacles [m]."""
_LOOKS, _MOST_LOOKS = 4, 32
"""Positions sampled along a step per part that contact could follow, and most of them."""


@dataclass(frozen=True, eq=False)
class _Side:
    """One side of a pair.

    Attributes:
        interface: Index of the interface.
        nodes: Its nodes, shape (n,).
        edge: Typical element edge at them [m], shape (n,).
        other: Boundary of the body that the other side belongs to.
        opposite: Nodes of the other side.
        opposite_edge: Median element edge there [m].
    """

    interface: int
    nodes: Ints32
    edge: Array
    other: Enclosure
    opposite: Ints32
    opposite_edge: float


def _sides(k: int, mortar: Mortar, around: Callable[[ContactSurface], Enclosure]) -> list[_Side]:
    """Both sides of interface k, with the neighbourhood of the opposite surface."""
    both = ((mortar.slave, mortar.master), (mortar.master, mortar.slave))
    return [_Side(k, one.nodes, one.edge, around(two), two.nodes, float(np.median(two.edge))) for one, two in both]


class Passing:
    """Detection for every pair that is not bonded: two bodies, a body with itself, a body with an obstacle.

    Args:
        body: All bodies, merged.
        interfaces: Contact interfaces.
    """

    def __init__(self, body: Body, interfaces: Sequence[Interface]) -> None:
        self._rest = body.mesh.nodes
        self._interfaces = interfaces
        self._sides: list[_Side] = []
        self._own: list[tuple[Interface, Mortar]] = []
        self._own_sides: list[_Side] = []
        self._elements = body.mesh.elements
        self._obstacles: list[tuple[int, Interface, Obstacle]] = []
        between = []
        for k, interface in enumerate(interfaces):
            if interface.pair.bond is not None:
                continue
            if isinstance(interface.pair.master, Obstacle):
                self._obstacles.append((k, interface, interface.pair.master))
            elif interface.mortar is not None:
                between.append((k, interface, interface.mortar))
        if between:
            self._sort(body, between)

    def _sort(self, body: Body, between: list[tuple[int, Interface, Mortar]]) -> None:
        """Divide deformable pairs into those of two bodies and those of one body with itself."""
        piece = components(body)
        quads = np.ascontiguousarray(body.mesh.quads(body.mesh.boundary()), dtype=np.int32)
        around: dict[tuple[int, ...], Enclosure] = {}

        def enclosure(nodes: Ints32) -> Enclosure:
            pieces = tuple(np.unique(piece[nodes]).tolist())
            if pieces not in around:
                around[pieces] = Enclosure(quads[np.isin(piece[quads[:, 0]], pieces)])
            return around[pieces]

        for k, interface, mortar in between:
            if np.isin(piece[mortar.slave.nodes], piece[mortar.master.nodes]).any():
                self._own.append((interface, mortar))
                if interface.pair.exclusion is None:  # parts excluded from contact may overlap
                    self._own_sides += _sides(k, mortar, lambda two: Enclosure(two.quads))
                continue
            self._sides += _sides(k, mortar, lambda two: enclosure(two.nodes))

    def share(self, u: Array, ahead: Array, before: float, time: float) -> float:
        """Fraction of the motion from displacement u to ``ahead`` (3N,) between two times that contact can follow."""
        x, step = self._moved(u), (ahead - u).reshape(-1, 3)
        least = 1.0
        for side in self._sides:
            least = min(least, self._past_body(side, x, step))
        for interface, mortar in self._own:
            least = min(least, _past_itself(interface, mortar, x, step))
        for _, interface, obstacle in self._obstacles:
            least = min(least, _past_obstacle(interface, obstacle, x, step, before, time))
        return max(least, LEAST_SHARE)

    def _past_body(self, side: _Side, x: Array, step: Array) -> float:
        """Fraction of a step (N, 3) from x (N, 3) in which no node of a side moves too far into the other body."""
        followed = _FOLLOWED * self._interfaces[side.interface].reach
        mine, theirs = step[side.nodes], step[side.opposite]
        # an upper bound on the relative motion of the two sides
        middle = 0.5 * (theirs.max(axis=0) + theirs.min(axis=0))
        most = float(np.linalg.norm(mine - middle, axis=1).max() + np.linalg.norm(theirs - middle, axis=1).max())
        if most <= followed or not _near(x[side.nodes], x[side.other.nodes], most):
            return 1.0
        side.other.move(x)
        gap, face = side.other.ask(x[side.nodes], most)
        near = np.flatnonzero((face >= 0) & (gap < most))
        beside = step[side.other.quads[face[near]]].mean(axis=1)
        return _followed(np.linalg.norm(mine[near] - beside, axis=1), gap[near], followed)

    def depth(self, u: Array, k: int) -> float:
        """Largest distance of nodes of interface k inside the other body from the other side's nodes [m]."""
        from scipy.spatial import cKDTree

        deepest, x = 0.0, self._moved(u)
        for side in self._sides:
            if side.interface != k:
                continue
            side.other.move(x)
            inside = side.other.ask(x[side.nodes], 0.0)[0] < 0.0
            if inside.any():
                away = cKDTree(x[side.opposite]).query(x[side.nodes[inside]])[0]
                deepest = max(deepest, float(away.max()))
        return deepest

    def unseen(self, u: Array, time: float, points: Sequence[ContactPoints], pressed: Sequence[Mask]) -> str:
        """Message about the deepest node inside another body without active contact; empty if there is none.

        Args:
            u: Displacement [m], shape (3N,).
            time: Time of the obstacles.
            points: Contact points of each interface.
            pressed: Mask of the active ones.
        """
        touched = [p.weights[np.flatnonzero(mask)].indices for p, mask in zip(points, pressed, strict=True)]
        depth, k = self.deepest(u, time, touched, np.full(len(touched), _DEEP))
        if depth == 0.0:
            return ""
        title = self._interfaces[k].pair.title
        return f"{title}: bodies lie {depth:.3g} m deep in one another, and nothing parts them"

    def went_through(self, before: Array, u: Array, start: float, time: float) -> bool:
        """Whether bodies lie deep in each other on the straight path between displacements (3N,) at two times."""
        share = self.share(before, u, start, time)
        count = min(int(np.ceil(_LOOKS / share)), _MOST_LOOKS) if share < 1.0 else 0
        nothing = [np.empty(0, np.int64)] * len(self._interfaces)
        slack = np.full(len(nothing), _DEEP)
        for k in range(1, count):
            there, moment = before + k / count * (u - before), start + k / count * (time - start)
            if self.deepest(there, moment, nothing, slack)[0] > 0.0:
                return True
        return False

    def deepest(
        self, u: Array, time: float, touched: Sequence[Ints], slack: Array, *, own: bool = True
    ) -> tuple[float, int]:
        """Largest depth of an inactive node in another body [m], and the index of its interface; 0 if there is none.

        Args:
            u: Displacement [m], shape (3N,).
            time: Time of the obstacles.
            touched: Nodes in contact, of each interface.
            slack: Number of edge lengths by which a node may lie in the other body, of each interface.
            own: Whether parts of one body are examined, too.
        """
        worst, which, x = 0.0, -1, self._moved(u)
        for side in self._sides:
            if not _near(x[side.nodes], x[side.other.nodes], 0.0):
                continue
            side.other.move(x)
            depth = -side.other.ask(x[side.nodes], 0.0)[0]
            beyond = depth - slack[side.interface] * np.maximum(side.edge, side.opposite_edge)
            deepest = self._untouched(side.interface, side.nodes, beyond, depth, touched)
            worst, which = max((worst, which), (deepest, side.interface))
        for side in self._own_sides if own else ():
            deepest = self._untouched(side.interface, side.nodes, *self._own_depth(side, x, slack), touched)
            worst, which = max((worst, which), (deepest, side.interface))
        for k, interface, obstacle in self._obstacles:
            nodes = interface.slave.nodes
            depth = -obstacle.project(x[nodes], time).distance
            deepest = self._untouched(k, nodes, depth - slack[k] * interface.slave.edge, depth, touched)
            worst, which = max((worst, which), (deepest, k))
        return worst, which

    def _own_depth(self, side: _Side, x: Array, slack: Array) -> tuple[Array, Array]:
        """Depth of a side's nodes that lie in elements of their own body: beyond the accepted one, and behind the other
        surface [m], shape (n,) each; 0 for all other nodes."""
        depth = np.zeros(len(side.nodes))
        inside = np.flatnonzero(inside_own(x, self._elements, side.nodes))
        if len(inside):
            side.other.move(x)
            depth[inside] = np.abs(side.other.ask(x[side.nodes[inside]], np.inf)[0])
        return depth - slack[side.interface] * np.maximum(side.edge, side.opposite_edge), depth

    def _untouched(self, k: int, nodes: Ints32, beyond: Array, depth: Array, touched: Sequence[Ints]) -> float:
        """Largest ``depth`` (n,) of inactive nodes of interface k among those whose excess over the admissible depth,
        ``beyond`` (n,), is positive [m]."""
        offset = self._interfaces[k].pair.offset
        # a visible surface inside the mesh (negative offset) allows the meshes to overlap
        inside = 0.0 if offset is None else 2.0 * float(np.maximum(-offset, 0.0).max(initial=0.0))
        free = np.ones(len(self._rest), dtype=bool)
        free[touched[k]] = False
        return float(depth[(beyond > inside) & free[nodes]].max(initial=0.0))

    def _moved(self, u: Array) -> Array:
        return np.asarray(self._rest + u.reshape(-1, 3))


def _followed(motion: Array, gap: Array, followed: float) -> float:
    """Fraction of relative motions (n,) towards surfaces at gaps (n,) that end at most ``followed`` behind them [m]."""
    free = np.maximum(gap, 0.0)
    meets = (motion > free) & (motion > followed)
    return float(((free + followed) / np.maximum(motion, 1e-300))[meets].min(initial=1.0))


def _near(points: Array, others: Array, most: float) -> bool:
    """Whether the bounding boxes of two sets of points are closer than ``most`` [m]."""
    apart = np.maximum(points.min(axis=0) - others.max(axis=0), others.min(axis=0) - points.max(axis=0))
    return bool((apart < most).all()) if most > 0.0 else bool((apart < 0.0).all())


def _past_itself(interface: Interface, mortar: Mortar, x: Array, step: Array) -> float:
    """As ``_past_body``, for parts of a body that may touch each other, from node to nearest node."""
    from scipy.spatial import cKDTree

    followed = _FOLLOWED * interface.reach
    if np.linalg.norm(np.ptp(step[np.union1d(mortar.slave.nodes, mortar.master.nodes)], axis=0)) <= followed:
        return 1.0
    least = 1.0
    for label in np.unique(mortar.labels[0]):
        mine = np.unique(mortar.slave.quads[mortar.labels[0] == label])
        others = np.unique(mortar.master.quads[mortar.met_by(int(label))])
        if not len(others):
            continue
        away, near = cKDTree(x[others]).query(x[mine])
        least = min(least, _followed(np.linalg.norm(step[mine] - step[others[near]], axis=1), away, followed))
    return least


def _past_obstacle(
    interface: Interface, obstacle: Obstacle, x: Array, step: Array, before: float, time: float
) -> float:
    """As ``_past_body``, for a body and an obstacle; limited by the obstacle's half thickness as well."""
    nodes = interface.slave.nodes
    times = [before + (time - before) * k / _LOOKS for k in range(_LOOKS + 1)]
    motion = relative_paths(obstacle, times, [x[nodes] + k / _LOOKS * step[nodes] for k in range(_LOOKS + 1)])
    if motion.max() <= min(interface.reach, _THINNEST):
        return 1.0
    gap = obstacle.project(x[nodes], before).distance
    if (motion <= gap).all():
        return 1.0
    return _followed(motion, gap, min(interface.reach, half_thickness(obstacle, before)))


def guess_jumps(share: float, cut: float) -> bool:
    """Whether a predictor is discontinuous: the fraction that contact can follow hardly grew although the step was cut.

    Args:
        share: Fraction of the present step that contact can follow.
        cut: Fraction to which the step was cut before; 1 if it was not.
    """
    return LEAST_SHARE < cut < 1.0 and share < 1.5 * cut
