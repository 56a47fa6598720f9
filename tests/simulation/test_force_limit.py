"""A finger that closes on a plate far beyond what its flesh bears: it stops, or is called crushed where it may not."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.hand.kept import kept_hand
from warpjld.io import load_rig
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.script.runner import run_scene
from warpjld.simulation.solve.digit_loads import DigitLoad
from warpjld.simulation.solve.force_limit import ForceLimits, Stop

FINGER = """
OBJECT PLATE BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165
MOVE LEFT 0 0 -0.001 0
FINGER1 LEFT INDEX FLEXION AT 0 0
FINGER1 LEFT INDEX FLEXION AT 4 7
FLESH LEFT INDEX ELEMENT 0.004
FRAMES 0 4
"""


def test_a_digit_stops_where_its_skin_bears_no_more(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(FINGER + "PRESS 0 4 BEARS 60000\nEXPORT 'e.npz'")
    found = run_contact(scene, tmp_path)
    rows = [row for row in found.rows if row.digit == "index"]
    last = rows[-1]
    assert found.verdict.status == "CONVERGED"
    assert found.verdict.text.startswith("realistic")
    assert max(row.peak_kpa for row in rows) < 60.0 * 1.01
    assert last.peak_kpa > 0.7 * 60.0  # as far as it may
    # what was asked and not reached is told, and what was reached are the keys
    asked, reached = 7.0, scene.actor().motion.value("left.index.base.flexion", 4.0)
    assert last.short_deg == pytest.approx(asked - 57.29577951 * float(reached), abs=1e-5)
    assert last.short_deg > 0.5
    (stop,) = found.verdict.stops
    assert stop.startswith("LEFT index stops at frame ")
    assert stop.endswith("° short: its skin is pressed with 60 kPa")


@pytest.mark.slow
def test_muscles_end_it_where_they_are_weaker(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(FINGER + "STRENGTH LEFT INDEX 0.5\nPRESS 0 4")
    found = run_contact(scene, tmp_path)
    last = [row for row in found.rows if row.digit == "index"][-1]
    assert found.verdict.text.startswith("realistic")
    assert 0.7 < last.share < 1.03
    (stop,) = found.verdict.stops
    assert stop.endswith("its muscles can do no more")


BESIDE = """
FRAMES 0 10
FINGER1 LEFT INDEX ABDUCTION AT 0 0
FINGER1 LEFT INDEX ABDUCTION AT 10 -16
FINGER1 LEFT MIDDLE ABDUCTION AT 0 0
FINGER1 LEFT MIDDLE ABDUCTION AT 10 8
FRICTION LEFT LEFT 0
FLESH LEFT INDEX MIDDLE ELEMENT {0} ITSELF ON
PRESS 0 10 EVERY 2
"""


@pytest.mark.slow
@pytest.mark.parametrize(("hand", "element"), [("builtin", 0.005), ("hand_webxr_generic", 0.004)])
def test_fingers_that_squeeze_each_other_stop_where_their_interossei_do(
    hand: str, element: float, data: Path, tmp_path: Path
) -> None:
    rig = kept_hand("left") if hand == "builtin" else load_rig(data / hand / "left.glb")
    scene = Scene(say=lambda text: None)
    scene.add("left", rig)
    Interpreter(scene).run_text(BESIDE.format(element))
    found = run_contact(scene, tmp_path)
    assert found.verdict.status == "CONVERGED"
    assert found.verdict.text.startswith("realistic")
    assert any(stop.endswith("the muscles that move it sideways can do no more") for stop in found.verdict.stops)
    index, middle = ([row for row in found.rows if row.digit == name][-1] for name in ("index", "middle"))
    # 0.18 of 59 N is what the index does with its pad; between the fingers the lever is shorter
    assert 0.5 * 10.6 < index.force_n < 3.0 * 10.6
    assert index.force_n == pytest.approx(middle.force_n, rel=1e-3)
    assert index.short_deg > 1.0
    reached = scene.actor().motion.value("left.index.base.abduction", 10.0)
    assert float(reached) == pytest.approx(math.radians(index.short_deg - 16.0), abs=1e-5)


def test_a_rigid_one_is_refused_before_it_is_solved_where_its_bone_lies_in_the_plate(
    run: Callable[[str], Scene], tmp_path: Path
) -> None:
    scene = run(
        FINGER.replace("AT 4 7", "AT 4 14")
        + "PRESS 0 4 EVERY 4 RIGID\nEXPORT 'e.npz'\nPICTURE 4 'p.png' PRESSURE\nSIZE 160 120"
    )
    with pytest.raises(
        InputError, match=r"contact was not solved: no equilibrium: at frame [\d.]+: the bone of LEFT index is"
    ):
        run_scene(scene, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert summary["press"]["status"] == "BLOCKED"
    assert "mm inside PLATE, which cannot give way" in summary["press"]["verdict"]
    assert (tmp_path / "e.npz").is_file()  # what can be made is
    assert summary["failed"]["p.png"].startswith("contact was solved at no frame: there is no pressure at frame 4")


def test_what_has_stopped_is_kept_for_a_run_that_goes_on() -> None:
    load = DigitLoad("LEFT", "left.index", 12.0, 0.2, 2.9e5, 0.5, "CAN")
    content = {
        "caps": [["LEFT", "left.index", 0, 2.0, 3.0, [[7, [0.3, 0.31]], [8, [0.5, 0.5]]]]],
        "loads": [asdict(load)],
        "stuck": [["LEFT", "left.index", -1]],
        "stops": [asdict(Stop("LEFT", "left.index", 26.5, "its muscles can do no more"))],
    }
    limits = ForceLimits({}, 3e5, {}, None)  # type: ignore[arg-type]
    limits.restore(json.loads(json.dumps(content)))
    assert json.loads(json.dumps(limits.content())) == content
    assert load.share(3e5) == pytest.approx(2.9 / 3.0)
    assert load.bound(3e5) == "its skin is pressed with 300 kPa"
    assert replace(load, unopposed=1.2).bound(3e5) == "nothing opposes it, it would push CAN away"
