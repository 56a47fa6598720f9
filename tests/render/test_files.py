from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from warpjld.errors import InputError
from warpjld.render import save_picture

PICTURE = np.random.default_rng(0).integers(0, 255, (20, 30, 3), np.uint8)


def test_png_is_lossless_and_alone(tmp_path: Path) -> None:
    path = save_picture(tmp_path / "new" / "a.png", PICTURE)
    np.testing.assert_array_equal(np.asarray(Image.open(path)), PICTURE)
    assert [p.name for p in path.parent.iterdir()] == ["a.png"]


def test_refuses(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown kind of picture '\.xyz'.*\.png"):
        save_picture(tmp_path / "a.xyz", PICTURE)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        save_picture(tmp_path / "file" / "a.png", PICTURE)
