"""Search for the frame at which the contact solve has to start (R91, R112)."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.meshes import RigidMesh
from warpjld.fem.contact.obstacles.thickness import distance_past, half_thickness
from warpjld.grasp import Places
from warpjld.simulation.animation import ActorAnimation, Animation
from warpjld.simulation.bodies.free_object import settle_free_object
from warpjld.simulation.bodies.skin_obstacle import SkinObstacle
from warpjld.simulation.solve.friction_closure import friction_closure
from warpjld.simulation.specification import ContactSpecification, FleshMaterial, SolveSpecification

__all__ = ["StartFrame", "find_start"]

_CLEAR = 2e-4
"""Penetration of skin from which an object that cannot move away counts as touched [m]."""

_FAR = 2e-3
"""Displacement of a free object from which a note is given [m]."""

_PARTED = 0.01
"""Distance at rest below which skin of two digits belongs to the web between them, where they always touch [m]."""

_DIGIT = 0.01
"""Largest motion of skin between two tested moments [m]: less than the thickness of a digit."""
_MOST = 40
"""Most tested moments per frame."""


@dataclass(frozen=True, eq=False)
class StartFrame:
    """Start of the contact solve, and what happens before it.

    Attributes:
        start: Frame before anything is pressed or held; the first frame if something is already.
        moved: Free objects that hands push before they hold them, by name: frames and placements.
        began: Initial positions of these [m], shape (3,), by name.
        falls: Messages about objects that fell.
        interrupted: Frame after which Ctrl-C ended the falls, so that nothing is solved; None if nothing did.
    """

    start: float
    moved: dict[str, tuple[list[float], list[Places]]]
    began: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    falls: tuple[str, ...] = ()
    interrupted: float | None = None

    def place(self, name: str) -> Places | None:
        """Placement of a free object at the start; None if it is the animation's."""
        return self.moved[name][1][-1] if name in self.moved else None

    def notes(self) -> list[str]:
        """Messages about falls and about free objects that were pushed away."""
        out = [*self.falls]
        for name, (frames, places) in self.moved.items():
            if name not in self.began:
                continue
            way = places[-1].position[0] - self.began[name]
            far = float(np.linalg.norm(way))
            if far > _FAR:
                toward = " ".join(f"{axis}{part / far:+.2f}" for axis, part in zip("xyz", way, strict=True))
                out.append(
                    f"{name} is pushed by {1e3 * far:.1f} mm towards {toward} from frame {frames[0]:g} to "
                    f"{frames[-1]:g} by digits that cannot hold it: close others against them, or HOLD it until they do"
                )
        return out


def find_start(
    animation: Animation, contact: ContactSpecification, request: SolveSpecification, *, fell: bool = False
) -> StartFrame:
    """Find the first frame that has to be solved (R91, R112).

    Before it nothing touches, or only free objects are pushed that friction could not hold: these are moved rigidly to
    where nothing pushes them any more. ``fell``: free objects with weight have fallen before, so that gravity need not
    act from the first frame on.
    """
    stands = {o for o, _ in contact.prescribed} | {grip.object for grip in contact.grips if grip.lift}
    free = [name for name in contact.physical if name not in stands]
    keyed = any(state.tracks for state in contact.prescribed.values())
    # a supported object deforms so little under its weight that this can be left to the first solved step
    bends = any(flesh.flexion for flesh in contact.flesh.values())
    strained = any(any(matter.prestress) for name, matter in contact.physical.items() if name in stands)
    if (
        keyed
        or bends
        or strained
        or contact.loaded
        or (any(contact.gravity) and not fell and (free or not contact.grips))
    ):
        return StartFrame(float(request.first), {})
    return _Approach(animation, contact, free).start(request)


class _Approach:
    """Motion of hands and free objects before the first contact that has to be solved."""

    def __init__(self, animation: Animation, contact: ContactSpecification, free: list[str]) -> None:
        self._animation, self._contact, self._free = animation, contact, free
        self._actors = {name: animation.actors[name] for name in contact.flesh}
        others = {name: actor for name, actor in animation.actors.items() if name not in contact.flesh}
        self._bystanders = others if contact.flesh or contact.physical else {}
        self._moved: dict[str, tuple[list[float], list[Places]]] = {}
        self._began: dict[str, NDArray[np.float64]] = {}

    def start(self, request: SolveSpecification) -> StartFrame:
        """Test moment by moment until something is pressed or held."""
        # a grip search starts from digits in contact, which may not press yet: that frame has to be solved
        latest = min([request.last - 1.0, *(np.ceil(grip.first) - 1.0 for grip in self._contact.grips)])
        for frame in range(request.first, int(latest) + 1):
            for moment in [float(frame)] if frame == request.first else self._moments(frame):
                places = self._pushed(moment)
                if places is None:
                    return StartFrame(float(max(request.first, frame - 1)), self._moved, self._began)
                for name, place in places.items():
                    self._began.setdefault(name, self._animation.objects[name].place(moment).position[0])
                    frames, sequence = self._moved.setdefault(name, ([], []))
                    frames.append(moment)
                    sequence.append(place)
        return StartFrame(latest, self._moved, self._began)

    def _moments(self, frame: int) -> list[float]:
        """Times in (frame - 1, frame], so dense that skin cannot pass through anything between two of them."""
        times = [0.0, 0.5, 1.0]
        count = 1.0
        skins = [self._skins(frame - 1.0 + time) for time in times]
        paths = [[at[name] for at in skins] for name in self._actors]
        for path in paths:
            farthest = float(np.linalg.norm(path[-1] - path[0], axis=1).max(initial=0.0))
            count = max(count, farthest / _DIGIT)
        for name, one in self._animation.objects.items():
            obstacle = one.obstacle(frame - 1.0)
            if name in self._moved:
                obstacle = RigidMesh(self._moved[name][1][-1].apply(one.thing.vertices)[0], one.thing.faces)
            ways = [distance_past(obstacle, times, path) for path in paths]
            if any(way > 0.0 for way in ways):
                count = max(count, max(ways) / half_thickness(obstacle))
        pieces = min(_MOST, int(np.ceil(count)))
        return [frame - 1.0 + (k + 1) / pieces for k in range(pieces)]

    def _skins(self, frame: float) -> dict[str, NDArray[np.float64]]:
        """Covered skins of the actors with deformable flesh, by name [m]."""
        return {name: actor.skin(frame) for name, actor in self._actors.items()}

    def _pushed(self, frame: float) -> dict[str, Places] | None:
        """Placements of free objects that are pushed at a frame; None if the frame has to be solved."""
        skins = self._skins(frame)
        flesh = self._contact.flesh
        if any(_meets_itself(actor, flesh[name], skins[name]) for name, actor in self._actors.items()):
            return None
        if self._actors_meet(frame, skins):
            return None
        objects = self._animation.objects
        obstacles = {name: one.obstacle(frame) for name, one in objects.items() if name not in self._free}
        obstacles |= {name: SkinObstacle(actor, frame) for name, actor in self._bystanders.items()}
        if any(_inside(solid, skin) for solid in obstacles.values() for skin in skins.values()):
            return None
        for name in self._contact.physical:
            if name not in self._free:
                shape = obstacles[name].mesh(0.0)[0]
                if any(_inside(solid, shape) for other, solid in obstacles.items() if other != name):
                    return None
        places: dict[str, Places] = {}
        for name in self._free:
            held, place = self._free_object(name, frame, list(obstacles.values()), skins)
            if held:
                return None
            places |= {} if place is None else {name: place}
        return places

    def _actors_meet(self, frame: float, skins: dict[str, NDArray[np.float64]]) -> bool:
        """Whether the skins of two actors with deformable flesh interpenetrate (R126)."""
        for one, other in combinations(self._actors, 2):
            low, high = (np.stack([how(skins[name], axis=0) for name in (one, other)]) for how in (np.min, np.max))
            if (low.max(axis=0) > high.min(axis=0)).any():
                continue
            for solid, name in ((one, other), (other, one)):
                if _inside(SkinObstacle(self._actors[solid], frame), skins[name]):
                    return True
        return False

    def _free_object(
        self, name: str, frame: float, obstacles: list[Obstacle], skins: dict[str, NDArray[np.float64]]
    ) -> tuple[bool, Places | None]:
        """Whether a free object is held at a frame, and else the placement it is pushed to (None: not pushed)."""
        one = self._animation.objects[name]
        place = self._moved[name][1][-1] if name in self._moved else one.place(frame)
        vertices = place.apply(one.thing.vertices)[0]
        skin = np.concatenate([*skins.values(), np.empty((0, 3))])
        shape = Facets(vertices, one.thing.faces)
        if any(float(solid.project(vertices, 0.0).distance.min()) < _CLEAR for solid in obstacles):
            # friction may hold an object that lies on something, so that any push has to be solved
            pushed = shape.project(skin).distance.min(initial=1.0) if len(skin) else 1.0
            return bool(pushed < -_CLEAR), None
        found = settle_free_object(vertices, one.thing.faces, skin, [], 0.0)
        if found.overlap > _CLEAR or self._pinched(name, shape, skin):
            return True, None
        if name not in self._moved and np.linalg.norm(found.of(vertices) - vertices, axis=1).max() <= 1e-6:
            return False, None
        turn = found.turn * Rotation.from_quat(place.rotation[0])
        return False, Places(found.of(place.position), turn.as_quat()[None])

    def _pinched(self, name: str, shape: Facets, points: NDArray[np.float64]) -> bool:
        """Whether hands that penetrate a free object could hold it by friction."""
        if not len(points):
            return False
        found = shape.project(points)
        inside = found.distance < -_CLEAR
        friction = min(self._contact.coefficient(name, actor) for actor in self._actors)
        return friction_closure(points[inside], -found.normal[inside], -found.distance[inside], friction)


def _meets_itself(actor: ActorAnimation, material: FleshMaterial, skin: NDArray[np.float64]) -> bool:
    """Whether the skins of two digits, or of a digit and the palm, intersect where flesh would touch (R126); the webs
    between digits, which touch at rest, do not count."""
    from warpjld.covering.intersections import crossing_faces, surface_parts

    if not material.itself:
        return False
    covering = actor.covering
    parts = surface_parts(covering)
    middle = covering.surface.vertices[covering.surface.faces].mean(axis=1)
    mine = np.array([not material.digits or name.rpartition(".")[2] in material.digits for name in parts.names])
    if mine.sum() < 2:
        return False

    def apart(pairs: NDArray[np.int32]) -> NDArray[np.bool_]:
        part = parts.of_face[pairs]
        tested = (part[:, 0] != part[:, 1]) & mine[part].all(axis=1)
        far = np.linalg.norm(middle[pairs[tested, 0]] - middle[pairs[tested, 1]], axis=1) > _PARTED
        tested[tested] = far
        return np.asarray(tested)

    return bool(len(crossing_faces(skin, covering.surface.faces, apart).pairs))


def _inside(solid: Obstacle, points: NDArray[np.float64]) -> bool:
    """Whether any point (n, 3) [m] penetrates an obstacle at its time 0."""
    return bool((solid.project(points, 0.0).distance < -_CLEAR).any())
