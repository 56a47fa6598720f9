"""Command KEYS: move, copy or delete all keys of an actor or an object at a frame, or change their splines."""

from __future__ import annotations

from dataclasses import asdict, replace

from warpjld.motion import Key, Track
from warpjld.script.arguments import Arguments
from warpjld.script.registry import command
from warpjld.script.scene import Scene, SplineConstants


@command(
    "KEYS",
    syntax=(
        "KEYS <MOVE/COPY> <key> <other key> [<actor or object>], KEYS DELETE <key> [<actor or object>] "
        "or KEYS SPLINE <key> <tension> <continuity> <bias> [<actor or object>]"
    ),
    help="Move, copy or delete all keys of an actor (the current one) or object at a frame, or change their splines.",
    group="Animation",
)
def keys(scene: Scene, arguments: Arguments) -> None:
    """Move, copy or delete all keys at a frame, or change their spline constants (R3, R4)."""
    what = arguments.choice("what to do with the keys", ("MOVE", "COPY", "DELETE", "SPLINE"))
    frame = arguments.number("the key (a frame)")
    other = arguments.number("the other key (a frame)") if what in ("MOVE", "COPY") else frame
    constants = None
    if what == "SPLINE":
        parts = ("the tension", "the continuity", "the bias")
        constants = SplineConstants(*(arguments.number(part, minimum=-1, maximum=1) for part in parts))
    name = arguments.name("an actor's or an object's name") if arguments else scene.actor().name
    owners = _tracks(scene, name)
    if not any(_key(track, frame) for tracks in owners for track in tracks.values()):
        raise arguments.error(f"{name.upper()} has no key at {frame:g}", arguments.position)
    for tracks in owners:
        _change(tracks, what, frame, other, constants)


def _tracks(scene: Scene, name: str) -> list[dict[str, Track]]:
    """Tracks of the placement of an actor or object, after those of the joints if it is an actor."""
    placement = scene.placement(name)
    joints = [scene.actors[name.upper()].motion.tracks] if name.upper() in scene.actors else []
    return [*joints, placement.tracks]


def _key(track: Track, frame: float) -> Key | None:
    return next((key for key in track.keys if key.frame == frame), None)


def _change(tracks: dict[str, Track], what: str, frame: float, other: float, constants: SplineConstants | None) -> None:
    for channel in [*tracks]:
        track = tracks[channel]
        found = _key(track, frame)
        if found is None:
            continue
        if constants is not None:
            track.set(replace(found, **asdict(constants)))
        if what in ("MOVE", "DELETE"):
            track.remove(frame)
        if what in ("MOVE", "COPY"):
            track.set(replace(found, frame=other))
        if not track.keys:
            del tracks[channel]
