"""All actors and objects of a scene as one drawable, and cameras that frame them over all frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.geometry.paint import paint_of_surface
from warpjld.render.style import Style
from warpjld.script.directing import camera_at
from warpjld.script.outermost import outermost
from warpjld.script.outputs import CameraSetting
from warpjld.script.props import Prop, texture_of
from warpjld.script.scene import Actor
from warpjld.script.staging import stage, staged
from warpjld.skeleton import Poses, Skeleton

if TYPE_CHECKING:
    from warpjld.covering import Covering
    from warpjld.grasp import Places
    from warpjld.render import Camera as RenderCamera
    from warpjld.render import Solid
    from warpjld.render.texture import MeshTexture
    from warpjld.simulation.display.surfaces import DeformedSurfaces
    from warpjld.touch.contact import SkinContact

__all__ = ["Crowd", "Role", "role_of"]

_TOGETHER = 512  # frames per block when framing; of each block only the points of the convex hull are kept
_SAMPLES = 12  # frames whose whole surface is framed, beside the joints of all frames


@dataclass(frozen=True, eq=False)
class Role:
    """An actor with its covering and its poses at the frames to make.

    Attributes:
        actor: The actor.
        covering: Its covering.
        poses: Its poses at the frames.
        contact: Contact of its skin for display, where TOUCH is on.
    """

    actor: Actor
    covering: Covering
    poses: Poses
    contact: SkinContact | None = None

    def limited(self, poses: Poses, first: int) -> Poses:
        """Poses of this role, with digits stopped at contact where TOUCH LIMIT is set."""
        return poses if self.contact is None else self.contact.poses(poses, first=first)


def role_of(actor: Actor, frames: NDArray[np.float64], rate: float) -> Role:
    """Bind an actor and pose it at frames (F,) of a scene with a rate [1/s]."""
    from warpjld.script.binding import cover

    role = Role(actor, cover(actor), staged(actor, frames, rate))
    if actor.touch == "off":
        return role
    from warpjld.touch.contact import SkinContact

    role = replace(role, contact=SkinContact(role.covering, limits=actor.touch == "limit"))
    return replace(role, poses=role.limited(role.poses, round(float(frames[0])) if len(frames) else 0))


@dataclass(frozen=True, eq=False)
class Crowd:
    """The roles of a scene, with their vertices, faces, joints and segments concatenated.

    Attributes:
        roles: In the order of the scene's actors.
        frames: Frame numbers of their poses, shape (F,).
        device: Warp device of the covering.
        props: The scene's objects.
        whereabouts: Function that gives the placements of an object at frames.
        pressed: Deformed surfaces from the contact simulation, where there was one.
    """

    roles: Sequence[Role]
    frames: NDArray[np.float64]
    device: str = "cpu"
    props: Sequence[Prop] = ()
    whereabouts: Callable[[Prop, NDArray[np.float64]], Places] | None = None
    pressed: DeformedSurfaces | None = None

    @cached_property
    def faces(self) -> NDArray[np.int32]:
        """Triangles over the concatenated vertices, shape (T, 3)."""
        counts = np.cumsum([0, *(len(r.covering.surface.vertices) for r in self.roles)])
        faces = [r.covering.surface.faces + start for r, start in zip(self.roles, counts, strict=False)]
        return np.concatenate([np.empty((0, 3), np.int32), *faces]).astype(np.int32)

    @cached_property
    def segments(self) -> NDArray[np.int32]:
        """Segments over the concatenated joints, shape (B, 2)."""
        counts = np.cumsum([0, *(len(r.covering.skeleton) for r in self.roles)])
        pairs = [
            (segment.proximal + start, segment.distal + start)
            for role, start in zip(self.roles, counts, strict=False)
            for segment in role.covering.skeleton.segments
        ]
        return np.array(pairs, dtype=np.int32).reshape(-1, 2)

    def at(self, frame: float, rate: float) -> Crowd:
        """The same roles at one frame (fractions allowed) of a scene with a rate [1/s]."""
        moment = np.array([frame])
        roles = [
            replace(role, poses=role.limited(stage(role.actor, moment, rate), round(frame))) for role in self.roles
        ]
        return replace(self, roles=roles, frames=moment)

    @cached_property
    def places(self) -> list[Places]:
        """Placements of every object at the frames."""
        assert self.whereabouts is not None or not self.props
        return [self.whereabouts(prop, self.frames) for prop in self.props if self.whereabouts]

    def solids(self, shift: NDArray[np.float64] | float = 0.0) -> list[Solid]:
        """The objects as drawables, at the first frame, translated by ``-shift`` [m]."""
        from warpjld.render import Solid

        return [
            Solid(vertices, prop.thing.faces, color=prop.color, texture=texture_of(prop))
            for prop, vertices in zip(self.props, self.solid_vertices(0, shift), strict=True)
        ]

    def moved_solids(self, frame: int, shift: NDArray[np.float64] | float = 0.0) -> list[NDArray[np.float64] | None]:
        """As ``solid_vertices``; None for objects that have not moved since the previous frame."""
        if np.any(shift) or frame == 0:
            return [*self.solid_vertices(frame, shift)]
        return [
            None if self._stays(prop, places, frame) else self.prop_vertices(prop, places, frame)
            for prop, places in zip(self.props, self.places, strict=True)
        ]

    def solid_vertices(self, frame: int, shift: NDArray[np.float64] | float = 0.0) -> list[NDArray[np.float64]]:
        """Vertices of every object at the ``frame``-th of the frames, translated by ``-shift`` [m]."""
        pairs = zip(self.props, self.places, strict=True)
        return [self.prop_vertices(prop, places, frame) - shift for prop, places in pairs]

    def prop_vertices(self, prop: Prop, places: Places, frame: int) -> NDArray[np.float64]:
        """Vertices of an object at the ``frame``-th of the frames [m], shape (n, 3)."""
        if self.pressed is not None and (found := self.pressed.object(prop.name, self.frames[frame])) is not None:
            return found
        return places[frame].apply(prop.shape(float(self.frames[frame])))[0]

    def _stays(self, prop: Prop, places: Places, frame: int) -> bool:
        """Whether an object has not changed since the previous frame."""
        pressed = self.pressed is not None and self.pressed.moves(prop.name)
        still = np.array_equal(places.position[frame], places.position[frame - 1]) and np.array_equal(
            places.rotation[frame], places.rotation[frame - 1]
        )
        return still and not prop.deforms and not pressed

    def joints(self, frame: int) -> NDArray[np.float64]:
        """Concatenated joint positions at the ``frame``-th of the frames [m], shape (J, 3)."""
        each = (role.poses[frame : frame + 1].positions[0] for role in self.roles)
        return np.concatenate([np.empty((0, 3)), *each])

    def surface(self, frame: int) -> NDArray[np.float32]:
        """Concatenated vertices at the ``frame``-th of the frames [m], shape (V, 3)."""
        here = slice(frame, frame + 1)
        skins = [self.worn(r, r.covering.deform(r.poses[here], device=self.device), frame)[0] for r in self.roles]
        return np.concatenate([np.empty((0, 3), np.float32), *skins])

    def worn(self, role: Role, vertices: NDArray[np.float32], start: int) -> NDArray[np.float32]:
        """Surfaces of a role as displayed, for n frames from the ``start``-th on.

        Where TOUCH is on, skin is separated from other skin and pushed out of rigid objects; where contact was solved,
        its deformed skin replaces the covering's.

        Args:
            role: The role.
            vertices: Surfaces from the covering [m], shape (n, V, 3).
            start: Index of the first of their frames.
        """
        if role.contact is not None and len(vertices):
            poses = role.poses[start : start + len(vertices)]
            first = round(float(self.frames[start]))
            vertices = role.contact.skin(vertices, poses, first=first)
            pairs = zip(self.props, self.places, strict=True)
            here = slice(start, start + len(vertices))
            held = [(prop.thing, places[here]) for prop, places in pairs if not prop.deforms]
            vertices = role.contact.hold(vertices, held, first=first)
        if self.pressed is None:
            return vertices
        out = vertices
        for k in range(len(vertices)):
            found = self.pressed.skin(role.actor.name, float(self.frames[start + k]))
            if found is not None:
                out = out.copy() if out is vertices else out
                out[k] = found
        return out

    def shift(self, camera: CameraSetting, frame: int) -> NDArray[np.float64]:
        """Translation to subtract from all positions so that the camera follows the first actor [m], shape (3,)."""
        if not camera.follow or not self.roles:
            return np.zeros(3)
        first = self.roles[0]
        return np.asarray(first.poses[frame : frame + 1].positions[0, 0] - first.covering.skeleton.rest[0])

    @cached_property
    def colors(self) -> NDArray[np.uint8] | None:
        """Colours of the concatenated vertices, shape (V, 3); None where all actors have the default colour."""
        from PIL import ImageColor

        if all(role.actor.color is None for role in self.roles):
            return None
        usual = Style().skin
        rows = [
            np.tile(ImageColor.getrgb(role.actor.color or usual)[:3], (len(role.covering.surface.vertices), 1))
            for role in self.roles
        ]
        return np.concatenate(rows).astype(np.uint8)

    @cached_property
    def texture(self) -> MeshTexture | None:
        """Texture atlas of all actors without a colour of their own; None if none has a texture."""
        from PIL import ImageColor

        from warpjld.render.texture import texture_atlas

        covers = []
        for role in self.roles:
            surface, color = role.covering.surface, role.actor.color
            paint = paint_of_surface(surface) if color is None else None
            red, green, blue = ImageColor.getrgb(color or Style().skin)[:3]
            covers.append((paint, len(surface.faces), (red, green, blue)))
        return texture_atlas(covers, " or ".join(role.actor.name for role in self.roles))

    def camera(self, camera: CameraSetting, size: tuple[int, int], frame: float | None = None) -> RenderCamera:
        """Render camera of a setting at a frame (the first one if left out).

        A named view is framed for all frames, so that nothing leaves the picture.
        """
        from warpjld.render import Camera as RenderCamera

        camera = camera_at(camera, float(self.frames[0]) if frame is None else frame)
        if camera.position is not None and camera.target is not None:
            sight = np.subtract(camera.target, camera.position)
            steep = abs(sight[1]) > 0.99 * np.linalg.norm(sight)
            above = (0.0, 0.0, -1.0) if steep else (0.0, 1.0, 0.0)
            if camera.roll:
                turn = Rotation.from_rotvec(camera.roll * sight / np.linalg.norm(sight))
                above = tuple(turn.apply(above).tolist())
            return RenderCamera(camera.position, camera.target, above, zoom=camera.zoom)
        view = camera.view or self.default_view
        forward, up, side = self._facing
        return RenderCamera.view(
            view, self._framing(camera), forward=forward, up=up, side=side, size=size, zoom=camera.zoom
        )

    @property
    def default_view(self) -> str:
        """Name of the view where no CAMERA was chosen."""
        return "three-quarter" if self._facing[2] else "front"

    def _framing(self, camera: CameraSetting) -> NDArray[np.float64]:
        """Points that must be visible in every frame [m], shape (n, 3)."""
        surfaces = [points - self.shift(camera, frame) for frame, points in self._samples.items()]
        spans = [(start, min(start + _TOGETHER, len(self.frames))) for start in range(0, len(self.frames), _TOGETHER)]
        shown = [self._shown(camera, *span) for span in spans]
        return np.concatenate([*surfaces, *(shown if len(shown) < 2 else map(outermost, shown))])

    def _shown(self, camera: CameraSetting, first: int, stop: int) -> NDArray[np.float64]:
        """Joints and vertices of objects at a range of frames, relative to the following camera [m], shape (n, 3)."""
        shifts = np.stack([self.shift(camera, frame) for frame in range(first, stop)])
        joints = [(role.poses[first:stop].positions - shifts[:, None]).reshape(-1, 3) for role in self.roles]
        frames = range(first, stop) if self.props else ()
        boxes = [box - shifts[frame - first] for frame in frames for box in self.solid_vertices(frame)]
        return np.concatenate([*joints, *boxes])

    @cached_property
    def _samples(self) -> dict[int, NDArray[np.float32]]:
        count = len(self.frames)
        chosen = np.unique(np.linspace(0, count - 1, min(count, _SAMPLES)).astype(int))
        return {int(frame): self.surface(int(frame)) for frame in chosen}

    @cached_property
    def _facing(self) -> tuple[NDArray[np.float64], NDArray[np.float64], Literal["left", "right"] | None]:
        """Palm normal, up direction and side of a single hand; world axes and None for anything else."""
        skeleton = self.roles[0].covering.skeleton if self.roles else None
        side = hand_side(skeleton) if skeleton is not None and len(self.roles) == 1 else None
        if skeleton is None or side is None:
            return np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]), None
        base, wrist = skeleton.index(f"{side}.middle.base"), skeleton.index(f"{side}.wrist")
        up = skeleton.rest[base] - skeleton.rest[wrist]
        # the normal segment × axis points to the back of the hand (R20)
        forward = -np.cross(skeleton.directions[base], skeleton.axes[base])
        return forward, up, side


def hand_side(skeleton: Skeleton) -> Literal["left", "right"] | None:
    """Side of a skeleton that is a single hand, else None."""
    sides: tuple[Literal["left", "right"], ...] = ("left", "right")
    found = [side for side in sides if f"{side}.middle.base" in skeleton.names]
    alone = len(found) == 1 and f"{found[0]}.wrist" in skeleton.names and len(skeleton) <= 40
    return found[0] if alone else None
