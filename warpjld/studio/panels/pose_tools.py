"""Panel for whole hand poses: coarse sliders, pose library, copy and paste, blending with neighbouring keys."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.names import check_name
from warpjld.script.pose_files import SHIPPED, hand_channels, load_pose, save_pose, shipped_pose
from warpjld.studio.hand_pose import COARSE, coarse_angles, coarse_share, mixed, of_side, on_side
from warpjld.studio.key_lines import number
from warpjld.studio.pose_pictures import pose_sheet

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["PoseToolsPanel"]

_FOLDER = "poses"  # beside the script
_PUSH = 0.25  # amount by which a button blends towards another pose


class PoseToolsPanel:
    """Tools that pose a hand as a whole."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._copied: dict[str, float] = {}
        gui = room.server.gui
        self.side = gui.add_dropdown("Hand", ("left", "right"), initial_value="left")
        self.coarse = {name: self._slider(name) for name in COARSE}
        with gui.add_folder("Poses", expand_by_default=False):
            self.pose = gui.add_dropdown("Pose", SHIPPED, initial_value="relaxed")
            self.share = gui.add_slider("Percent", min=0, max=100, step=5, initial_value=100)
            self.apply = gui.add_button("Apply pose")
            self.pictures = gui.add_button("Pictures of the poses")
            self.sheet = gui.add_image(np.full((8, 8, 3), 255, np.uint8), visible=False)
            self.name = gui.add_text("Save as", "my-pose")
            self.save = gui.add_button("Save pose")
        self.copy = gui.add_button_group("Pose", ("copy", "paste", "paste flipped"))
        self.push = gui.add_button_group("Push", ("relax", "to last key", "to next key"))
        self.apply.on_click(lambda _: room.post(self._apply))
        self.pictures.on_click(lambda _: room.post(self._picture))
        self.save.on_click(lambda _: room.post(self._save))
        self.copy.on_click(lambda event: self._copy(event.target.value))
        self.push.on_click(lambda event: self._push(event.target.value))
        self.side.on_update(lambda event: room.by_hand(event, lambda: None))

    def refresh(self) -> None:
        """Update the coarse sliders and the list of poses."""
        state, waits = self._room.state, self._room.worker.waits
        sides = [side for side in ("left", "right") if any(name.startswith(f"{side}.") for name in state.channels())]
        if sides and self.side.value not in sides:
            self.side.value = sides[0]
        angles = state.angles()
        for name, slider in self.coarse.items():
            share = coarse_share(name, angles, self.side.value)
            if share is not None and not waits(("coarse", name)) and abs(slider.value - 100.0 * share) > 1.0:
                slider.value = float(round(100.0 * share))
        poses = (*SHIPPED, *sorted(f"{_FOLDER}/{path.name}" for path in self._folder().glob("*.json")))
        if tuple(self.pose.options) != poses:
            self.pose.options = poses

    def _slider(self, name: str) -> Any:
        room = self._room
        slider = room.server.gui.add_slider(name.capitalize(), min=0.0, max=100.0, step=1.0, initial_value=0.0)

        def bend() -> None:
            angles = coarse_angles(name, slider.value / 100.0, self.side.value)
            room.state.set_angles(angles, kind=("coarse", name, room.state.frame))

        slider.on_update(lambda event: room.by_hand(event, bend, key=("coarse", name)))
        return slider

    def _folder(self) -> Path:
        return self._room.state.document.path.parent / _FOLDER

    def _apply(self) -> None:
        name = self.pose.value
        which = name.upper() if name in SHIPPED else f'"{name}"'
        share = "" if self.share.value == 100 else f" SHARE {number(self.share.value)}"
        self._room.state.do(f"POSE {self.side.value.upper()} {which} {number(self._room.state.frame)}{share}")

    def _picture(self) -> None:
        """Render the contact sheet of all poses in the background, and show it."""
        own = {name: load_pose(self._folder().parent / name) for name in self.pose.options if name not in SHIPPED}
        poses = {name: shipped_pose(name) for name in SHIPPED} | {Path(name).stem: one for name, one in own.items()}

        def show(sheet: NDArray[np.uint8]) -> None:
            self.sheet.image = sheet
            self.sheet.visible = True

        self._room.progress.start("the pictures", lambda progress: pose_sheet(poses), show)

    def _save(self) -> None:
        state = self._room.state
        name = check_name(self.name.value.strip(), "the pose's name")
        if "/" in name or "\\" in name:
            raise InputError(f"'{name}': want a plain name; poses are kept in the folder {_FOLDER}")
        if state.actor is None:
            raise InputError("there is no hand whose pose could be saved")
        channels = hand_channels(state.actor, self.side.value)
        angles = {c: v for c, v in of_side(state.angles(), self.side.value).items() if c in channels}
        self._folder().mkdir(exist_ok=True)
        save_pose(self._folder() / f"{name}.json", angles)
        state.messages.append(f"saved {_FOLDER}/{name}.json")

    def _copy(self, what: str) -> None:
        state, side = self._room.state, self.side.value
        other = "right" if side == "left" else "left"

        def copy() -> None:
            self._copied = of_side(state.angles(), side)

        def paste(where: str) -> None:
            target = state.actor
            if target is not None and not any(name.startswith(f"{where}.") for name in state.channels()):
                state.choose(state.scene.actor_with(where).name)
            state.set_angles(on_side(self._copied, where))

        self._room.post(copy if what == "copy" else lambda: paste(side if what == "paste" else other))

    def _push(self, what: str) -> None:
        state = self._room.state

        def push() -> None:
            if what == "relax":
                state.do(f"POSE {self.side.value.upper()} RELAXED {number(state.frame)} SHARE {number(100 * _PUSH)}")
                return
            before = what == "to last key"
            keys = [key for key in state.keys if (key < state.frame if before else key > state.frame)]
            if keys:
                there = state.angles(keys[-1] if before else keys[0])
                state.set_angles(mixed(state.angles(), there, _PUSH))

        self._room.post(push)
