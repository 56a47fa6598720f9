"""The scene that a script builds: actors and their motion, objects, cameras, lamps, and the files to make."""

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
    """Kochanek–Bartels constants of a key (R3)."""

    tension: float = 0.0
    continuity: float = 0.0
    bias: float = 0.0


@dataclass(eq=False)
class Actor:
    """An actor: a rig in the scene, with its motion and settings.

    Attributes:
        name: Its name, in upper case.
        rig: The rig as loaded.
        skeleton: The rig's skeleton with the script's flexion axes and limits.
        motion: Keys of joint angles set by the script.
        parameters: Parameters of the covering.
        method: Method of the covering.
        domains: Whether domains come from the geometry or from the rig's painted weights.
        touch: Contact for display: whether skin is separated (``on``), and digits also stop at contact (``limit``).
        recorded: Poses of a motion file and their rate [1/s], used instead of keys.
        motion_notes: Notes on that file for the summary.
        placement: Keys of the actor as a whole.
        color: Colour of its skin, ``#rrggbb``; None: the default.
        covering: The covering made last; ``covered`` is the method and domains it was made with.
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
        """Set a value [rad] at several frames of a channel such as ``left.index.base.flexion``."""
        for key in keys:
            self.motion.set_key(channel, key, value, **asdict(spline))

    def value(self, channel: str, frame: float) -> float:
        """Angle [rad] of a channel such as ``left.index.base.flexion`` at any frame; the rest angle without keys."""
        joint, _, kind = channel.rpartition(".")
        initial = self.skeleton.initial[self.skeleton.names.index(joint), CHANNELS.index(kind)]
        return float(self.motion.value(channel, frame, initial))

    @property
    def key_frames(self) -> list[float]:
        """Frames that hold a key of this actor."""
        tracks = [*self.motion.tracks.values(), *self.placement.tracks.values()]
        return sorted({frame for track in tracks for frame in track.frames})

    @property
    def span(self) -> tuple[float, float] | None:
        """First and last frame with a key or of the recorded motion (at its own rate); None without motion."""
        frames = self.key_frames
        if self.recorded is not None:
            frames = [*frames, 0.0, len(self.recorded[0]) - 1.0]
        return (min(frames), max(frames)) if frames else None


def _to_stderr(line: str) -> None:
    if sys.stderr is not None:  # else print would write to stdout
        print(f"warning: {line}", file=sys.stderr)


@dataclass(eq=False)
class Scene:
    """Everything that a script describes: actors, objects, times, cameras, contact, and the files to make.

    Attributes:
        actors: Actors by name, in the order they were added.
        props: Objects by name.
        attempts: Results of searches and grasps, for the summary.
        contact: Specification of the contact simulation.
        grips: Angles of an actor's digits before GRASP closed them, by actor and channel [rad].
        current: Name of the actor that commands without an actor or side apply to.
        first, last: Frames to compute, both included; None: from the first key to the last.
        rate: Frames per second.
        spline: Spline constants for the keys set next.
        camera: Camera for the outputs added next.
        size: Width and height of pictures and films [pixels].
        lamps: Lamps by name; none: default lighting.
        backdrop: Background colours, below and above; None: default.
        backdrop_picture: Picture file that replaces the background colours; None without one.
        shots: Shots by name.
        outputs: Files to make, relative to the output folder.
        asked: Position in a script of the command that added each output, by the output's name.
        folder: The output folder.
        dry: Whether searches only set keys without computing angles, as ``--check`` does.
        read: Files that were read, which outputs may not overwrite.
        within: Folders that files may be read from; None: anywhere.
        say: Function that receives the lines of PRINT and SHOW.
        warn: Function that receives warnings about rigs and motions; ``warnings`` keeps them for the summary.
        warnings: Warnings so far.
        device: Warp device of searches.
        idle: Channels of fingers that GRASP … AUTO bent although they take no part, by actor; they do not tighten.

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
    idle: dict[str, set[str]] = field(default_factory=dict)

    def __repr__(self) -> str:
        counts = ((len(self.actors), "actor"), (len(self.props), "object"))
        contents = ", ".join(f"{n} {what}{'s' * (n != 1)}" for n, what in counts)
        clock = f"frames {self.first} to {self.last} at {self.rate:g} a second"
        return f"Scene({contents}, {clock}, {len(self.outputs)} outputs)"

    def warned(self, lines: Iterable[str]) -> None:
        """Issue warnings and keep them for the summary."""
        for line in lines:
            self.warnings.append(line)
            self.warn(line)

    def may_read(self, path: Path) -> bool:
        """Whether a file may be read (see ``within``)."""
        return self.within is None or any(path.resolve().is_relative_to(allowed) for allowed in self.within)

    def add(self, name: str, rig: Rig) -> Actor:
        """Add a rig as an actor; it becomes the current actor.

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
            first = "" if self.props else "; add one with a line such as OBJECT APPLE BALL 0.07"
            raise InputError(f"there is no object {name}{did_you_mean(name, self.props)}{first}")
        return self.props[name.upper()]

    def placement(self, name: str) -> Placement:
        """Placement keys of the actor or object of that name.

        Raises:
            InputError: There is none.
        """
        if name.upper() in self.props:
            return self.props[name.upper()].placement
        if name.upper() in self.actors or not self.props:
            return self.actor(name).placement
        raise InputError(f"there is no actor or object {name}{did_you_mean(name, [*self.actors, *self.props])}")

    def actor_with(self, side: str) -> Actor:
        """The actor with limbs on a side: the current one if it has that side, else the only other one that has.

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
        if unknown := [
            actor.name for actor in self.actors.values() if not any(_has_side(actor, s) for s in ("left", "right"))
        ]:
            raise InputError(
                f"no actor has a {side} side: neither hand nor body was recognised in {', '.join(unknown)}; state its "
                "joints with MAP (see `warpjld inspect`)"
            )
        raise InputError(f"no actor has a {side} side; add one with HAND {side.upper()} BUILTIN")


def _has_side(actor: Actor, side: str) -> bool:
    return any(name.startswith(f"{side}.") for name in actor.skeleton.names)
