from __future__ import annotations

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.render import Camera, Quality, contact_sheet, grid

SIZE = (60, 80)


def test_grid_keeps_its_pictures() -> None:
    red, blue = (np.full((40, 50, 3), color, np.uint8) for color in ((200, 0, 0), (0, 0, 200)))
    sheet = grid([[red, blue], [blue]], captions=["one", "two"], row_captions=["first row", "second"], title="All")
    assert sheet.shape[0] % 2 == sheet.shape[1] % 2 == 0
    assert (sheet == (200, 0, 0)).all(axis=2).sum() == 40 * 50
    assert (sheet == (0, 0, 200)).all(axis=2).sum() == 2 * 40 * 50
    assert (sheet.max(axis=2) < 90).sum() > 50  # ink


def test_grid_refuses() -> None:
    with pytest.raises(InputError, match="at least one"):
        grid([])
    with pytest.raises(InputError, match="one size"):
        grid([[np.zeros((4, 4, 3), np.uint8), np.zeros((4, 5, 3), np.uint8)]])


def test_contact_sheet_has_a_cell_a_frame_and_look(finger) -> None:  # type: ignore[no-untyped-def]
    camera = Camera.view("three-quarter", finger.frames, size=SIZE)
    sheet = contact_sheet(
        finger.frames[:5],
        finger.faces,
        camera,
        joints=finger.joints[:5],
        segments=finger.segments,
        numbers=[0, 10, 20, 30, 40],
        columns=3,
        size=SIZE,
        quality=Quality.draft(),
    )
    white = (sheet == 255).all(axis=2)
    columns = np.flatnonzero(np.diff(np.r_[True, white[2:20].all(axis=0), True].astype(int)) == -1)
    rows = np.flatnonzero(np.diff(np.r_[True, white[:, 2:20].all(axis=1), True].astype(int)) == -1)
    assert (len(columns), len(rows)) == (3, 4)  # two looks, five frames in threes


def test_contact_sheet_refuses(finger) -> None:  # type: ignore[no-untyped-def]
    camera = Camera.view("palmar", finger.frames, size=SIZE)
    with pytest.raises(InputError, match=r"vertices: want shape \(frames, n, 3\)"):
        contact_sheet(finger.frames[0], finger.faces, camera)
    with pytest.raises(InputError, match="numbers: want 6"):
        contact_sheet(finger.frames, finger.faces, camera, numbers=[1])
    with pytest.raises(InputError, match="joints: want 6"):
        contact_sheet(finger.frames, finger.faces, camera, joints=finger.joints[:2])
