"""Model of the studio, independent of its panels: document, scene, current frame, selection, solved contact."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, WarpjldError
from warpjld.script.scene import Actor, Scene
from warpjld.script.staging import frame_numbers
from warpjld.skeleton import CHANNELS
from warpjld.studio.document import ScriptDocument
from warpjld.studio.key_lines import number, with_keys
from warpjld.studio.making import Pressed
from warpjld.studio.performance import Performance
from warpjld.studio.surfaces import Coloring, Shown, Surfaces

__all__ = ["StudioState"]

_SHORTEST = 48  # frames of the timeline where there are hardly any keys
_MESSAGES = 100  # kept for the pane of messages


class StudioState:
    """A script being made. Every change of it goes through ``write`` (typed) or ``do`` (by mouse).

    Args:
        document: The script.
        folder: The output folder.
        within: Folders that files may be read from; None for anywhere.
        device: Warp device of the covering.
        wait: Whether a script with grasp searches is run only up to the first of them until ``begin``.

    Attributes:
        document: The script.
        frame: The frame that is shown.
        error: Error of the script or of the last command; None without one.
        broken: Whether the script as it stands cannot be run.
        messages: What commands said last.
        coloring: What skin is coloured by.
        joint: Selected joint of the actor that sliders move; None without a selection.
        solved: The contact that was solved last.
        preview: Script text and a scene that is shown instead of its own, until the script changes; None without one.
        defer: Function that runs a text with grasp searches in the background and then calls a continuation; None: such
            texts are run at once, or wait for ``begin``.
    """

    def __init__(
        self,
        document: ScriptDocument,
        folder: Path = Path("out"),
        *,
        within: Sequence[Path] | None = None,
        device: str = "cpu",
        wait: bool = False,
    ) -> None:
        self.document = document
        self.folder = folder
        self.frame = 0.0
        self.error: WarpjldError | None = None
        self.broken = False
        self.messages: deque[str] = deque(maxlen=_MESSAGES)
        self.coloring: Coloring = "skin"
        self.joint: str | None = None
        self.solved: Pressed | None = None
        self.preview: tuple[str, Scene] | None = None
        self.defer: Callable[[str, Callable[[], object]], None] | None = None
        self.surfaces = Surfaces(device)
        self.performance = Performance(folder, say=self.messages.append, within=within)
        self._actor: str | None = None
        self._angles: tuple[object, dict[str, float]] | None = None
        self._waiting = wait
        self._run()

    # ---- state shown --------------------------------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """Scene described by the script; if the script is broken, that of the lines before the error."""
        return self.performance.scene

    @property
    def actor(self) -> Actor | None:
        """The actor that sliders move: the chosen one, else the script's current one."""
        if self._actor in self.scene.actors:
            return self.scene.actors[self._actor]
        return self.scene.actor() if self.scene.actors else None

    def choose(self, actor: str) -> None:
        """Let sliders move this actor."""
        self._actor = self.scene.actor(actor).name

    @property
    def span(self) -> tuple[int, int]:
        """First and last frame of the timeline."""
        try:
            frames = frame_numbers(self.scene)
        except InputError:
            frames = np.zeros(1)
        first, last = int(min(frames[0], 0)), int(max(frames[-1], 0))
        fixed = self.scene.first is not None
        return (int(frames[0]), int(frames[-1])) if fixed and last > first else (first, max(last, first + _SHORTEST))

    @property
    def keys(self) -> list[float]:
        """Frames with keys of any actor or object, ascending."""
        scene = self.scene
        found = [key for actor in scene.actors.values() for key in actor.key_frames]
        return sorted({*found, *(key for prop in scene.props.values() for key in prop.key_frames)})

    def neighbours(self) -> dict[str, float]:
        """Frames of the nearest keys ``before`` and ``after`` the current frame, where they exist."""
        before = [key for key in self.keys if key < self.frame][-1:]
        after = [key for key in self.keys if key > self.frame][:1]
        return {which: keys[0] for which, keys in (("before", before), ("after", after)) if keys}

    def channels(self) -> dict[str, tuple[float, float]]:
        """Movable channels of the actor, with their limits [degrees]."""
        actor = self.actor
        if actor is None or actor.recorded is not None:
            return {}
        limits = np.degrees(actor.skeleton.limits)
        return {
            f"{name}.{channel}": (float(limits[j, c, 0]), float(limits[j, c, 1]))
            for j, name in enumerate(actor.skeleton.names)
            for c, channel in enumerate(CHANNELS)
            if limits[j, c, 0] < limits[j, c, 1]
        }

    def angles(self, frame: float | None = None) -> dict[str, float]:
        """Values of the movable channels at a frame, by default the current one, clamped to their limits [degrees]."""
        actor = self.actor
        at = self.frame if frame is None else frame
        if actor is None:
            return {}
        key = (self.document.text, actor, at)  # a scene changes only with its text
        if self._angles is None or self._angles[0] != key:
            values = {
                name: float(np.clip(np.degrees(actor.value(name, at)), low, high))
                for name, (low, high) in self.channels().items()
            }
            self._angles = key, values
        return dict(self._angles[1])

    def shown(self) -> list[Shown]:
        """Surfaces at the current frame, of the preview, the contact solution of this script, or else the scene."""
        if self.preview is not None and self.preview[0] == self.document.text:
            return self.surfaces.at(self.preview[1], self.frame, self.coloring)
        solved = self.pressed
        if solved is None:
            return self.surfaces.at(self.scene, self.frame, self.coloring)
        return self.surfaces.at(solved.scene, self.frame, self.coloring, solved.surfaces)

    def contacts(self) -> NDArray[np.float32]:
        """Contact points at the current frame [m], shape (n, 3); empty if its contact is not solved."""
        solved = self.pressed
        if solved is None:
            return np.zeros((0, 3), np.float32)
        return self.surfaces.contacts(solved.scene, self.frame, solved.surfaces)

    @property
    def pressed(self) -> Pressed | None:
        """Solved contact, if it was solved for the current script."""
        solved = self.solved
        return solved if solved is not None and solved.text == self.document.text else None

    def copied_scene(self) -> Scene:
        """Independent copy of the scene, for background jobs.

        Raises:
            WarpjldError: The script has an error.
        """
        if self.broken and self.error is not None:
            raise self.error
        return self.performance.copied()

    def begin(self, defer: Callable[[str, Callable[[], object]], None]) -> None:
        """Run texts with grasp searches by ``defer`` from now on, and first the document if it has waited for this."""
        self.defer = defer
        waited, self._waiting = self._waiting, False
        if waited and not self.broken:
            self._run()

    # ---- edits of the script -------------------------------------------------------------------------------------

    def write(self, text: str, kind: Hashable = None) -> None:
        """Replace the script by a typed text, which is kept even if it has errors, and run it."""
        self.document.edit(text, kind)
        self._run()

    def do(self, lines: str, kind: Hashable = None) -> bool:
        """Append lines to the script and run it; returns False, with the script unchanged, if they fail."""
        body = self.document.text.rstrip("\n")
        return self.put(f"{body}\n{lines}\n" if body else f"{lines}\n", kind)

    def put(self, text: str, kind: Hashable = None) -> bool:
        """Replace the script by a text and run it; returns False, with the script unchanged, if it fails.

        A text with grasp searches is run in the background; it replaces the script at the end of the search, unless the
        script was changed meanwhile.
        """
        if self.broken:
            assert self.error is not None
            self.messages.append("the script has an error: correct its text before editing it with the mouse")
            return False
        before = self.document.text
        try:
            if self._deferred(text, lambda: self._put_later(before, text, kind)):
                self.error = None
                return True
            self.performance.run(text, self.document.path)
        except WarpjldError as error:
            self.performance.run(self.document.text, self.document.path)
            self.error = error
            return False
        self.document.edit(text, kind)
        self.error = None
        return True

    def set_angles(self, angles: Mapping[str, float], kind: Hashable = None) -> bool:
        """Set keys of channels at the current frame [degrees], clamped to their limits."""
        limits, actor = self.channels(), self.actor
        if actor is None:
            return False
        held = {name: _within(angles[name], *limits[name]) for name in angles if name in limits}
        other = None if self.scene.current == actor.name else actor.name
        return self.put(with_keys(self.document.text, held, self.frame, actor=other), kind)

    def key_all(self) -> bool:
        """Set keys of all channels at the current frame to their current values."""
        return self.set_angles(self.angles())

    def undo(self) -> bool:
        """Undo the last change; returns False if there is none."""
        done = self.document.undo()
        if done:
            self._run()
        return done

    def redo(self) -> bool:
        """Redo the change that was undone last; returns False if there is none."""
        done = self.document.redo()
        if done:
            self._run()
        return done

    def open(self, document: ScriptDocument, within: Sequence[Path] | None = None) -> None:
        """Open another script; ``within`` replaces the folders that files may be read from, if given."""
        if within is not None:
            self.performance = Performance(self.folder, say=self.messages.append, within=within)
        self.document = document
        self.frame, self._actor = 0.0, None
        self._run()

    def fail(self, error: WarpjldError, text: str) -> None:
        """Report that a deferred text failed; the script is marked as broken if this is its text."""
        self.error, self.broken = error, text == self.document.text

    def _put_later(self, before: str, text: str, kind: Hashable) -> None:
        if self.document.text == before:
            self.put(text, kind)
        else:
            self.messages.append("a search has ended, but the script was changed meanwhile: its result is not used")

    def _deferred(self, text: str, then: Callable[[], object]) -> bool:
        """Start running a text in the background if it has grasp searches, or let it wait; returns whether it did."""
        if self.defer is None and not self._waiting:
            return False
        if not self.performance.searches(text, self.document.path):
            return False
        if self.defer is not None:
            self.defer(text, then)
        return True

    def _run(self) -> None:
        try:
            if self._deferred(self.document.text, self._run):
                self.error, self.broken = None, False
                self.performance.run(self.document.text, self.document.path, searching=False)  # what is known so far
                return
            self.performance.run(self.document.text, self.document.path)
        except WarpjldError as error:
            self.error, self.broken = error, True
        else:
            self.error, self.broken = None, False


def _within(degrees: float, low: float, high: float) -> float:
    """The nearest angle within limits that a line can say: to a hundredth."""
    value = round(min(max(degrees, low), high), 2)
    if value > high:
        value -= 0.01
    return float(number(value + 0.01 if value < low else value))
