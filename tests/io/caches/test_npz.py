from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.geometry.surface import Surface
from warpjld.io.caches import Cache


def test_holds_the_source_mesh(export: Callable[[str], Cache], surface: Surface, clip: np.ndarray) -> None:
    (path,) = export("a.npz").files
    with np.load(path) as arrays:
        np.testing.assert_array_equal(arrays["vertices"], clip[:, surface.weld])
        assert arrays["vertices"].dtype == np.float32
        np.testing.assert_array_equal(arrays["rest"], surface.vertices.astype(np.float32)[surface.weld])
        np.testing.assert_array_equal(arrays["faces"], surface.source_faces)
        np.testing.assert_array_equal(arrays["uv"], surface.uv)
        np.testing.assert_array_equal(arrays["frames"], np.arange(3, 10))
        assert arrays["rate"] == 24
