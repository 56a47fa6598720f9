"""Pictures of the gallery: the examples run, their contact sheets or one picture kept.

    python docs/make_gallery.py [NAME …]        # all of them: about half an hour on two cores

Written to ``docs/pictures/``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from PIL import Image

from warpjld.runtime.quiet import silence_warp
from warpjld.script import Interpreter, Scene
from warpjld.script.outputs import ContactSheet, Picture
from warpjld.script.plugin import load_commands
from warpjld.script.runner import run_scene

ROOT = Path(__file__).resolve().parents[1]
PICTURES = ROOT / "docs" / "pictures"
WANTED = {
    "count": "count.png",
    "wave": "wave.png",
    "two_hands": "two_hands.png",
    "user_command": "grip.png",
    "grasp_ball": "grasp_ball.png",
    "grasp_auto": "grasp_auto.png",
    "reach": "reach.png",
    "press_plate": "pressure_on_skin.png",
}
"""Of every example the picture that is kept."""
_WIDTH = 1400  # pixels at most


def main(names: list[str]) -> None:
    """Make the pictures of these examples; of all where none is named."""
    silence_warp()
    for name in names or WANTED:
        make(name, WANTED[name])


def make(name: str, kept: str) -> None:
    """Run an example for one picture alone."""
    if name == "user_command":
        load_commands(ROOT / "examples" / "user_command.py")
    with tempfile.TemporaryDirectory() as folder:
        scene = Scene(folder=Path(folder), say=lambda text: None)
        Interpreter(scene).run_file(ROOT / "examples" / f"{name}.jld")
        scene.outputs = [one for one in scene.outputs if one.name == kept and isinstance(one, ContactSheet | Picture)]
        scene.size = (840, 630)
        run_scene(scene, Path(folder))
        picture = Image.open(Path(folder) / kept).convert("RGB")
    if picture.width > _WIDTH:
        picture = picture.resize((_WIDTH, round(picture.height * _WIDTH / picture.width)), Image.Resampling.LANCZOS)
    picture.save(PICTURES / f"{name}.jpg", quality=88, optimize=True)
    print(PICTURES / f"{name}.jpg", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
