"""What a script describes: actors and their motion, the camera, and the files to make."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from warpjld.errors import InputError
from warpjld.script.outputs import CameraSetting, Output, Shot
from warpjld.script.placement import Placement
from warpjld.simulation.specification import ContactSpecification, SourceLocation
from warpjld.skeleton.channels import CHANNELS
from warpjld.suggest import did_you_mean

if TYPE_CHECKING:
    from warpjld.covering import Covering, Parameters
    from warpjld.motion import Motion
    from warpjld.rig import Rig
    from warpjld.script.directing import KeyedLamp
    from warpjld.script.grasping import Attempt
    from warpjld.script.props import Prop
    from warpjld.skeleton import Poses, Skeleton

__all__ = ["Actor", "Scene", "SplineConstants"]


@dataclass(frozen=True)
class SplineConstants:
    """Kochanek–Bartels constants of the keys that follow (R3)."""

    tension: float = 0.0
    continuity: float = 0.0
    bias: float = 0.0


@dataclass(eq=False)
class Actor:
    """A rig on the stage.

    Attributes:
        name: Upper case.
        rig: As loaded.
        skeleton: The rig's, with the script's flexion axes and limits.
        motion: Keys given by the script.
        parameters: The covering's.
        method: The covering's.
        domains: Whether domains come from the geometry or from the rig's painted weights.
        touch: Whether skin that crosses is parted, and digits are closed only until they touch.
        recorded: Poses of a motion file and their rate [1/s], which the keys then do not override.
        motion_notes: What a reader of the result should know of that file.
        placement: Keys of the actor as a whole.
        color: Of its skin, ``#rrggbb``; None: the usual one.
        covering: The surface as bound last; ``covered`` is the method and the domains it was bound with.
    """

    name: str
    rig: Rig
    skeleton: Skeleton
    motion: Motion
    parameters: Parameters
    method: Literal["smooth", "paper"] = "smooth"
    domains: Literal["geometry", "skin"] = "geometry"
    touch: Literal["off", "on", "limit"] = "off"
    recorded: tuple[Poses, float] | None = None
    motion_notes: tuple[str, ...] = ()
    placement: Placement = field(default_factory=Placement)
    color: str | None = None
    covering: Covering | None = None
    covered: tuple[str, str] = ("", "")

    @property
    def keyed(self) -> bool:
        """Whether any joint has a key."""
        return bool(self.motion.tracks)

    def set_keys(self, channel: str, keys: Sequence[float], value: float, spline: SplineConstants) -> None:
        """Set one value [rad] at several frames of a channel such as ``left.index.base.flexion``."""
        for key in keys:
            self.motion.set_key(channel, key, value, **asdict(spline))

    def value(self, channel: str, frame: float) -> float:
        """Angle [rad] of a channel such as ``left.index.base.flexion`` at any frame; that at rest where it has no
        key."""
        joint, _, kind = channel.rpartition(".")
        initial = self.skeleton.initial[self.skeleton.names.index(joint), CHANNELS.index(kind)]
        return float(self.motion.value(channel, frame, initial))

    @property
    def key_frames(self) -> list[float]:
        """Frames that hold a key of this actor."""
        tracks = [*self.motion.tracks.values(), *self.placement.tracks.values()]
        return sorted({key.frame for track in tracks for key in track.keys})

    @property
    def span(self) -> tuple[float, float] | None:
        """First and last frame with a key, or of the recorded motion at its own rate."""
        frames = self.key_frames
        if self.recorded is not None:
            frames = [*frames, 0.0, len(self.recorded[0]) - 1.0]
        return (min(frames), max(frames)) if frames else None


def _to_stderr(line: str) -> None:
    if sys.stderr is not None:  # else print would write to stdout
        print(f"warning: {line}", file=sys.stderr)


@dataclass(eq=False)
class Scene:
    """A stage with actors, a clock, a camera, and a list of files to make.

    Attributes:
        actors: By name, in the order they came on stage.
        props: Objects by name.
        attempts: Searches and grasps made so far, for the summary.
        contact: What is said about contact.
        grips: Angles of an actor's digits before it closed them, by channel [rad].
        current: The actor that commands without a side speak to.
        first, last: Frames to make, both included; None: from the first key to the last.
        rate: Frames a second.
        spline: Constants for the keys that follow.
        camera: For the outputs that follow.
        size: Width and height of pictures and films [pixels].
        lamps: That stand on the stage, by name; none: studio light.
        backdrop: Colours behind everything, below and above.
        backdrop_picture: File of a picture there instead.
        shots: Frames and their cameras, by name.
        outputs: Files to make, relative to the output folder.
        asked: Where in a script they were asked for, by name.
        folder: The output folder.
        dry: Whether searches only leave their keys, without angles: what ``--check`` does.
        read: Files that were read, which no output may take the place of.
        within: Folders that files may be read from; None for anywhere.
        say: Where PRINT and SHOW write.
        warn: Told what is probably wrong with a rig or a motion, as it is met; ``warnings`` keeps it for the summary.
        device: Warp device of searches.

    Examples:
        >>> from warpjld.script import Interpreter
        >>> scene = wj.Scene()
        >>> Interpreter(scene).run_text("FRAMES 0 24")
        >>> scene.add("left", wj.build_hand("left", resolution=1500)).name
        'LEFT'
        >>> scene
        Scene(1 actor, 0 objects, frames 0 to 24 at 30 a second, 0 outputs)
    """

    actors: dict[str, Actor] = field(default_factory=dict)
    props: dict[str, Prop] = field(default_factory=dict)
    attempts: list[Attempt] = field(default_factory=list)
    contact: ContactSpecification = field(default_factory=ContactSpecification)
    grips: dict[str, dict[str, float]] = field(default_factory=dict)
    current: str | None = None
    first: int | None = None
    last: int | None = None
    rate: float = 30.0
    spline: SplineConstants = SplineConstants()
    camera: CameraSetting = field(default_factory=CameraSetting)
    size: tuple[int, int] = (960, 720)
    lamps: dict[str, KeyedLamp] = field(default_factory=dict)
    backdrop: tuple[str, str] | None = None
    backdrop_picture: Path | None = None
    shots: dict[str, Shot] = field(default_factory=dict)
    outputs: list[Output] = field(default_factory=list)
    asked: dict[str, SourceLocation] = field(default_factory=dict)
    folder: Path = Path("out")
    dry: bool = False
    read: list[Path] = field(default_factory=list)
    within: tuple[Path, ...] | None = None
    say: Callable[[str], None] = print
    warn: Callable[[str], None] = _to_stderr
    warnings: list[str] = field(default_factory=list)
    device: str = "cpu"

    def __repr__(self) -> str:
        counts = ((len(self.actors), "actor"), (len(self.props), "object"))
        told = ", ".join(f"{n} {what}{'s' * (n != 1)}" for n, what in counts)
        clock = f"frames {self.first} to {self.last} at {self.rate:g} a second"
        return f"Scene({told}, {clock}, {len(self.outputs)} outputs)"

    def warned(self, lines: Iterable[str]) -> None:
        """Tell warnings, and keep them."""
        for line in lines:
            self.warnings.append(line)
            self.warn(line)

    def may_read(self, path: Path) -> bool:
        """Whether a file lies in a folder that files may be read from."""
        return self.within is None or any(path.resolve().is_relative_to(allowed) for allowed in self.within)

    def add(self, name: str, rig: Rig) -> Actor:
        """Bring a rig on stage; it becomes the current actor.

        Raises:
            InputError: The name is taken.
        """
        from warpjld.covering.parameters import default_parameters
        from warpjld.motion import Motion

        name = name.upper()
        if name in self.actors:
            raise InputError(f"there is an actor {name} already; give this one another with NAME")
        actor = Actor(name, rig, rig.skeleton, Motion(), default_parameters(rig.skeleton))
        self.actors[name] = actor
        self.current = name
        self.warned(f"{name}: {doubt}" for doubt in rig.suspicious)
        return actor

    def actor(self, name: str | None = None) -> Actor:
        """The actor of that name, or the current one.

        Raises:
            InputError: There is none.
        """
        if not self.actors:
            raise InputError("there is no actor yet; begin with a line such as HAND LEFT BUILTIN")
        key = (name or self.current or "").upper()
        if key not in self.actors:
            raise InputError(f"there is no actor {name}{did_you_mean(key, self.actors)}")
        return self.actors[key]

    def prop(self, name: str) -> Prop:
        """The object of that name.

        Raises:
            InputError: There is none.
        """
        if name.upper() not in self.props:
            first = "" if self.props else "; bring one on with a line such as OBJECT APPLE BALL 0.07"
            raise InputError(f"there is no object {name}{did_you_mean(name, self.props)}{first}")
        return self.props[name.upper()]

    def placement(self, name: str) -> Placement:
        """Keys of the actor or object of that name as a whole.

        Raises:
            InputError: There is none.
        """
        if name.upper() in self.props:
            return self.props[name.upper()].placement
        if name.upper() in self.actors or not self.props:
            return self.actor(name).placement
        raise InputError(f"there is no actor or object {name}{did_you_mean(name, [*self.actors, *self.props])}")

    def actor_with(self, side: str) -> Actor:
        """The actor whose left or right limbs are meant: the current one if it has any, else the only one that has.

        Raises:
            InputError: None has, or several have and none of them is the current one.
        """
        side = side.lower()
        current = self.actor()
        if _has_side(current, side):
            return current
        others = [actor for actor in self.actors.values() if _has_side(actor, side)]
        if len(others) == 1:
            return others[0]
        if others:
            names = ", ".join(actor.name for actor in others)
            raise InputError(f"several actors have a {side} side ({names}); choose one with ACTOR")
        raise InputError(f"no actor has a {side} side; bring one on with HAND {side.upper()} BUILTIN")


def _has_side(actor: Actor, side: str) -> bool:
    return any(name.startswith(f"{side}.") for name in actor.skeleton.names)
