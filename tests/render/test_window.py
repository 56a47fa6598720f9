from __future__ import annotations

import os
import sys

import pytest

from warpjld.errors import WarpjldError
from warpjld.render import window


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    if sys.platform != "linux":
        pytest.skip("only Linux draws through X")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)


@pytest.mark.usefixtures("no_display")
def test_missing_libraries_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(window, "_LIBRARIES", {"libdoes-not-exist.so.1": "vtkEGLRenderWindow"})
    with pytest.raises(WarpjldError, match="libegl1"):
        window.open_window((32, 32))
    assert "VTK_DEFAULT_OPENGL_WINDOW" not in os.environ


@pytest.mark.usefixtures("no_display")
def test_choice_of_the_user_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    monkeypatch.setattr(window, "_LIBRARIES", {})
    window.open_window((32, 32)).close()
    assert os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkEGLRenderWindow"
