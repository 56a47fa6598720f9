"""The moment from which on contact of a scene has to be solved (R91, R112)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.simulation.specification import FleshWish
from warpjld.simulation.specification import Pressing
from warpjld.script.binding import cover
from warpjld.script.press_bodies import prop_obstacle
from warpjld.script.staging import stage

if TYPE_CHECKING:
    from warpjld.fem.contact import Obstacle
    from warpjld.fem.contact.obstacles.facets import Facets
    from warpjld.grasp import Places
    from warpjld.script.scene import Actor, Scene

__all__ = ["Approach", "approach"]

_CLEAR = 2e-4
"""Skin deeper than this inside an object that cannot get out of the way presses on it [m]."""

_FAR = 2e-3
"""Way of a free object that is worth a note [m]."""

_PARTED = 0.01
"""Skin of two digits that is nearer than this at rest belongs to where they part [m]."""

_DIGIT = 0.01
"""Skin that goes no farther than this passes no digit unseen [m]."""
_MOST = 40
"""Moments between two frames at most."""


@dataclass(frozen=True, eq=False)
class Approach:
    """How a scene comes to the moment from which on contact has to be solved.

    Attributes:
        start: That frame: the one before anything is held; the first one where something is held there already.
        moved: Places of free objects that hands push before they hold them, by name: frames and placements.
        began: Where these were at first [m], shape (3,), by name.
    """

    start: float
    moved: dict[str, tuple[list[float], list[Places]]]
    began: dict[str, NDArray[np.float64]] = field(default_factory=dict)

    def place(self, name: str) -> Places | None:
        """Where a free object is at the start, if not where the script has it."""
        return self.moved[name][1][-1] if name in self.moved else None

    def notes(self) -> list[str]:
        """Where free objects were pushed before anything held them."""
        out = []
        for name, (frames, places) in self.moved.items():
            way = places[-1].position[0] - self.began[name]
            far = float(np.linalg.norm(way))
            if far > _FAR:
                toward = " ".join(f"{axis}{part / far:+.2f}" for axis, part in zip("xyz", way, strict=True))
                out.append(
                    f"{name} is pushed by {1e3 * far:.1f} mm towards {toward} from frame {frames[0]:g} to "
                    f"{frames[-1]:g} by digits that cannot hold it: close others against them, or HOLD it until they do"
                )
        return out


def approach(scene: Scene, pressing: Pressing) -> Approach:
    """Look for the first moment that needs solving (R91, R112).

    Before it nothing touches, or what is touched gives way: a free object that is pushed, and that friction could not
    hold where it is, goes where nothing pushes it any more.
    """
    wishes = scene.contact
    stands = {o for o, _ in wishes.prescribed} | {wish.object for wish in wishes.grips if wish.lift}
    free = [name for name in wishes.physical if name not in stands]
    keyed = any(state.tracks for state in wishes.prescribed.values())
    moved: dict[str, tuple[list[float], list[Places]]] = {}
    began: dict[str, NDArray[np.float64]] = {}
    # what stands on its points gives way to its weight by so little that it may do so in the first step
    if keyed or (any(wishes.gravity) and (free or not wishes.grips)):
        return Approach(float(pressing.first), moved)
    # a grip is searched for from digits that touch, and may do so without pressing: that has to be solved
    latest = min([pressing.last - 1.0, *(np.ceil(wish.first) - 1.0 for wish in wishes.grips)])
    for frame in range(pressing.first, int(latest) + 1):
        for moment in [float(frame)] if frame == pressing.first else _moments(scene, frame, moved):
            held, places = _held(scene, moment, free, moved)
            if held:
                return Approach(float(max(pressing.first, frame - 1)), moved, began)
            for name, place in places.items():
                began.setdefault(name, scene.whereabouts(scene.prop(name), np.array([moment])).position[0])
                frames, sequence = moved.setdefault(name, ([], []))
                frames.append(moment)
                sequence.append(place)
    return Approach(latest, moved, began)


def _moments(scene: Scene, frame: int, moved: dict[str, tuple[list[float], list[Places]]]) -> list[float]:
    """Moments after the frame before and up to this one, so close that skin passes nothing from one to the next."""
    from warpjld.fem.contact.obstacles.meshes import RigidMesh
    from warpjld.simulation.solve.substeps import half_thickness, way_past

    times = [0.0, 0.5, 1.0]
    count = 1.0
    skins = [_skins(scene, frame - 1.0 + time) for time in times]
    paths = {name: [at[name] for at in skins] for name in scene.contact.flesh}
    for path in paths.values():
        farthest = float(np.linalg.norm(path[-1] - path[0], axis=1).max(initial=0.0))
        count = max(count, farthest / _DIGIT)
    for prop in scene.props.values():
        obstacle = prop_obstacle(scene, prop, frame - 1.0)
        if prop.name in moved:
            obstacle = RigidMesh(moved[prop.name][1][-1].apply(prop.thing.vertices)[0], prop.thing.faces)
        ways = [way_past(obstacle, times, path) for path in paths.values()]
        if any(way > 0.0 for way in ways):
            count = max(count, max(ways) / half_thickness(obstacle))
    pieces = min(_MOST, int(np.ceil(count)))
    return [frame - 1.0 + (k + 1) / pieces for k in range(pieces)]


def _skins(scene: Scene, frame: float) -> dict[str, NDArray[np.float64]]:
    """Of the actors whose flesh deforms, as the covering has them, by name [m]."""
    moment = np.array([frame])
    return {
        name: cover(actor).deform(stage(actor, moment, scene.rate))[0].astype(np.float64)
        for name in scene.contact.flesh
        for actor in (scene.actor(name),)
    }


def _held(
    scene: Scene, frame: float, free: list[str], moved: dict[str, tuple[list[float], list[Places]]]
) -> tuple[bool, dict[str, Places]]:
    """Whether anything is held at a frame, and where free objects are that are pushed."""
    from warpjld.fem.contact.obstacles.facets import Facets
    from warpjld.simulation.solve.free_object import settle

    moment = np.array([frame])
    skins = _skins(scene, frame)
    if any(_meets_itself(scene.actor(name), wish, skins[name]) for name, wish in scene.contact.flesh.items()):
        return True, {}
    obstacles = {p.name: prop_obstacle(scene, p, frame) for p in scene.props.values() if p.name not in free}
    if any(_inside(solid, skin) for solid in obstacles.values() for skin in skins.values()):
        return True, {}
    for name in scene.contact.physical:
        if name not in free:
            shape = obstacles[name].mesh(0.0)[0]
            if any(_inside(solid, shape) for other, solid in obstacles.items() if other != name):
                return True, {}
    places: dict[str, Places] = {}
    for name in free:
        prop = scene.prop(name)
        place = moved[name][1][-1] if name in moved else scene.whereabouts(prop, moment)
        vertices = place.apply(prop.thing.vertices)[0]
        skin = np.concatenate([*skins.values(), np.empty((0, 3))])
        if any(float(solid.project(vertices, 0.0).distance.min()) < _CLEAR for solid in obstacles.values()):
            # friction holds what lies on something: the first push is already a grip
            pushed = Facets(vertices, prop.thing.faces).project(skin).distance.min(initial=1.0) if len(skin) else 1.0
            if pushed < -_CLEAR:
                return True, {}
            continue
        found = settle(vertices, prop.thing.faces, skin, [], 0.0)
        if found.overlap > _CLEAR or _pinched(scene, name, Facets(vertices, prop.thing.faces), skins):
            return True, {}
        if name in moved or np.linalg.norm(found.of(vertices) - vertices, axis=1).max() > 1e-6:
            turn = found.turn * Rotation.from_quat(place.rotation[0])
            places[name] = type(place)(found.of(place.position), turn.as_quat()[None])
    return False, places


def _pinched(scene: Scene, name: str, shape: Facets, skins: dict[str, NDArray[np.float64]]) -> bool:
    """Whether hands that reach into a free object could hold it by friction."""
    from warpjld.simulation.solve.friction_closure import pinched

    points = np.concatenate([*skins.values(), np.empty((0, 3))])
    if not len(points):
        return False
    found = shape.project(points)
    inside = found.distance < -_CLEAR
    friction = min(scene.contact.coefficient(name, actor) for actor in skins)
    return pinched(points[inside], -found.normal[inside], -found.distance[inside], friction)


def _meets_itself(actor: Actor, wish: FleshWish, skin: NDArray[np.float64]) -> bool:
    """Whether skin of two digits, or of a digit and the palm, has passed through one another where flesh would touch
    (R126); where digits part they lie together at rest."""
    from warpjld.covering.intersections import crossing_faces, surface_parts

    if not wish.itself:
        return False
    covering = cover(actor)
    parts = surface_parts(covering)
    pairs = crossing_faces(skin, covering.surface.faces).contact(parts).pairs
    middle = covering.surface.vertices[covering.surface.faces].mean(axis=1)
    far = np.linalg.norm(middle[pairs[:, 0]] - middle[pairs[:, 1]], axis=1) > _PARTED
    mine = np.array([not wish.digits or name.rpartition(".")[2] in wish.digits for name in parts.names])
    return bool((far & mine[parts.of_face[pairs]].all(axis=1)).any())


def _inside(solid: Obstacle, points: NDArray[np.float64]) -> bool:
    return bool((solid.project(points, 0.0).distance < -_CLEAR).any())
