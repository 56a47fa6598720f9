"""Pictures and films of a moving surface and its skeleton, off screen, from plain arrays.

Importing this starts nothing: pyvista is loaded when the first picture is drawn.

Examples:
    >>> from tempfile import mkdtemp
    >>> hand = wj.build_hand("left", resolution=1500)
    >>> camera = wj.render.Camera.view("palmar", hand.surface.vertices)
    >>> picture = wj.render.wireframe(hand.surface.vertices, hand.surface.faces, camera, size=(80, 60))
    >>> wj.render.save_picture(Path(mkdtemp()) / "hand.png", picture).name
    'hand.png'
"""

from warpjld.render.camera import VIEWS, Camera
from warpjld.render.colors import ColorScale
from warpjld.render.files import save_picture
from warpjld.render.film import Film
from warpjld.render.numbers import Numbered, with_numbers
from warpjld.render.pictures import shaded, wireframe
from warpjld.render.scene import Image, SceneRenderer, Solid
from warpjld.render.sheet import contact_sheet, grid
from warpjld.render.style import Quality, Style

__all__ = [
    "VIEWS",
    "Camera",
    "ColorScale",
    "Film",
    "Image",
    "Numbered",
    "Quality",
    "SceneRenderer",
    "Solid",
    "Style",
    "contact_sheet",
    "grid",
    "save_picture",
    "shaded",
    "wireframe",
    "with_numbers",
]
