"""Pages that play by themselves, opened as files in a real browser."""

from __future__ import annotations

from base64 import b64decode
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from tests.studio.conftest import until
from warpjld.cli.run import run_command

pytest.importorskip("viser", reason="viser is not installed")

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


CANVAS = """() => [...document.querySelectorAll('canvas')]
  .sort((a, b) => b.width * b.height - a.width * a.height)[0].toDataURL()"""


def pixels(page: Any) -> np.ndarray:
    """What is drawn, shape (H, W, 3); read from the canvas: a page that plays on a busy machine has no time for
    screenshots."""
    data = page.evaluate(CANVAS).partition(",")[2]
    return np.asarray(Image.open(BytesIO(b64decode(data))).convert("RGB"), np.int16)


def skin(page: Any) -> int:
    """How many pixels are reddish, as skin is."""
    seen = pixels(page)
    return int((seen[..., 0] > seen[..., 2] + 15).sum())


def made(script: Path, out: Path) -> Path:
    """The page that ``warpjld run --html`` makes of a script."""
    result = CliRunner().invoke(run_command, [str(script), "-o", str(out), "--html"])
    assert result.exit_code == 0, result.output
    return out / f"{script.stem}.html"


def plays(browser: Any, path: Path) -> None:
    """It shows a hand that moves, and asks nothing of anybody."""
    page = browser.new_page(viewport={"width": 420, "height": 360})
    page.set_default_timeout(60_000)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    try:
        page.goto(path.as_uri())
        page.locator("canvas").first.wait_for(state="attached")
        until(lambda: skin(page) > 1000, "the hand is drawn")
        seen = pixels(page)

        def moved() -> bool:
            now = pixels(page)
            return now.shape == seen.shape and int((np.abs(now - seen).max(axis=-1) > 20).sum()) > 300

        until(moved, "the hand moves")
        assert all(url.startswith(("file:", "data:", "blob:")) for url in asked)
    finally:
        page.close()


@pytest.mark.slow
def test_a_page_of_a_script_is_seen_and_plays(browser: Any, tmp_path: Path) -> None:
    script = tmp_path / "curl.jld"
    script.write_text("HAND LEFT BUILTIN RESOLUTION 1500\nPOSE LEFT FLAT 0\nPOSE LEFT FIST 40\n")
    plays(browser, made(script, tmp_path / "out"))


@pytest.mark.slow
def test_the_fist_is_a_page_below_10_megabytes_that_plays(browser: Any, tmp_path: Path) -> None:
    page = made(EXAMPLES / "fist.jld", tmp_path / "out")
    assert page.stat().st_size < 10e6
    plays(browser, page)
