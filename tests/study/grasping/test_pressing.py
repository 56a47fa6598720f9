"""Studies that solve contact: what they combine, and one hand that presses one handle."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.grasp.hand_object_gaps import HandObjectGaps
from warpjld.skeleton import DIGITS, poses_from_angles
from warpjld.study.grasping import GraspExperiment, load_plan
from warpjld.study.grasping.grip_plots import GRIP_SHARES, finger_shares, write_grip_plots
from warpjld.study.grasping.load import hand_of, opened_hand, thing_of
from warpjld.study.grasping.plan import GraspPlan
from warpjld.study.grasping.press_grasp import _without_share
from warpjld.study.grasping.reach import digits_short_of
from warpjld.study.pool import perform
from warpjld.tables.files import read_table

_EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "grip_pressure.toml"

_PLAN = """seed = 3
trials = 1
posture = "cylinder"
[[hands]]
name = "hand"
builtin = "right"
resolution = 1500
[[objects]]
name = "handle"
builtin = "cylinder"
diameter = 0.04
height = 0.12
mass = 0.1
[wrist]
best_of = 32
[contact]
weights = [5, 10]
element = 0.008
"""


def _plan(folder: Path, old: str = "", new: str = "") -> GraspPlan:
    (folder / "plan.toml").write_text(_PLAN.replace(old, new))
    return load_plan(folder / "plan.toml")


def test_the_example_combines_six_hands_handles_and_weights() -> None:
    plan = load_plan(_EXAMPLE)
    assert plan.combinations == plan.trials
    tried = {(*(one.name for one in plan.combination(k)[:2]), plan.weight(k)) for k in range(plan.trials)}
    assert len(tried) == plan.trials
    assert {one.name for one in plan.hands} == {f"{sex} {p} %" for sex in ("female", "male") for p in (5, 50, 95)}
    sizes = [dict(one.sizes)["diameter"] for one in plan.objects]
    assert (min(sizes), max(sizes)) == (0.025, 0.06)


def test_weights_hang_on_the_same_grasp_and_ask_for_what_friction_needs(tmp_path: Path) -> None:
    plan = _plan(tmp_path)
    assert plan.pressing is not None
    assert [plan.weight(k) for k in range(4)] == [5.0, 10.0, 5.0, 10.0]
    assert plan.pressing.force(6.0, 0.5) == pytest.approx(1.5 * 12.0)  # half of each newton pressed holds
    assert plan.pressing.kept(12.0, asked=12.5)
    assert not plan.pressing.kept(6.9, asked=12.5)
    experiment = GraspExperiment(plan)
    seeds = [experiment._search_seed(k, np.random.default_rng(k)) for k in range(4)]
    assert seeds[0] == seeds[1] != seeds[2] == seeds[3]
    assert experiment.plan(1)["weight"] == 10.0
    assert "weight" in experiment.groups
    assert {"press", "force_thumb", "share_index"} <= {one.name for one in experiment.columns}


def test_without_contact_a_study_is_what_it_was(tmp_path: Path) -> None:
    plan = _plan(tmp_path, "[contact]\nweights = [5, 10]\nelement = 0.008\n")
    experiment = GraspExperiment(plan)
    assert "pressing" not in plan.identity()
    assert "palm" not in plan.identity()["wrist"]
    assert not {"weight", "press"} & {one.name for one in experiment.columns}
    seeds = {experiment._search_seed(k, np.random.default_rng(k)) for k in range(4)}
    assert len(seeds) == 4  # every trial its own


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("weights = [5, 10]\n", "", r"contact.weights: is missing"),
        ("[5, 10]", "[5, 0]", r"contact.weights: want .* above 0"),
        ("element = 0.008", "element = 0.8", r"contact.element: want .* up to 0.02"),
        ("element = 0.008", 'element = 0.008\nshare = "force"', r"contact.share: want one of angles, muscles"),
        ("element", "elements", r"contact.elements: unknown key; did you mean element\?"),
        ("best_of = 32", "palm = true", r"wrist.palm: is for best_of"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        _plan(tmp_path, old, new)


def test_shares_of_the_fingers() -> None:
    published = {f"force_{finger}": force for finger, force in GRIP_SHARES.items()}
    assert sum(GRIP_SHARES.values()) == pytest.approx(115.0, abs=0.5)
    (shares,) = finger_shares([published, dict.fromkeys(published, 0.0)])  # one that presses, one that does not
    np.testing.assert_allclose(shares, np.array(list(GRIP_SHARES.values())) / 114.9)


def test_plots_of_grips(tmp_path: Path) -> None:
    plan = _plan(tmp_path)
    count = len(hand_of(plan.hands[0]).rig.surface.vertices)
    names = [one.name for one in GraspExperiment(plan).columns]
    row = dict.fromkeys(names, 0.5) | {"hand": "hand", "object": "handle", "press": "REACHED"}
    arrays = {"hand/pressure": np.linspace(0.0, 1e4, count)[None], "hand/pressure.trials": np.array([0])}
    drawn = write_grip_plots(tmp_path, plan, [row, row | {"press": "LIMIT"}], arrays)
    assert [path.name for path in drawn] == ["grips.png", "pressure.png"]
    assert all(path.stat().st_size > 10_000 for path in drawn)
    assert write_grip_plots(tmp_path, plan, [row | {"press": "LIMIT"}], arrays) == []


def test_digits_that_stay_short_of_the_handle(tmp_path: Path) -> None:
    """The tip of the little finger lies in the handle; the index and middle fingers bend on beside it."""
    plan = _plan(tmp_path)
    choice, wanted, scale, _ = plan.combination(0)
    hand, thing = hand_of(choice), thing_of(wanted, scale, plan.measuring.density)
    skeleton = hand.rig.skeleton
    angles, none = opened_hand(choice, "cylinder").angles, np.array([0.0, 0.0, 0.0, 1.0])
    tip = poses_from_angles(skeleton, angles[None]).positions[0, skeleton.index("right.pinky.tip")]

    def gaps(position: np.ndarray) -> dict[str, float]:
        poses = poses_from_angles(skeleton, angles[None], root_position=position[None], root_rotation=none[None])
        both = HandObjectGaps(hand.covering, thing.body)
        (found,) = both.gaps(hand.covering.deform(poses))
        return {name.rpartition(".")[2]: gap for name, gap in zip(both.parts, found, strict=True)}

    beside = digits_short_of(hand, thing, angles, -tip, none, most=1e-9)
    assert "pinky" not in beside
    at_rest = gaps(-tip)
    assert beside == pytest.approx({digit: at_rest[digit] for digit in beside}, abs=1e-6)
    assert {"index", "middle"} <= set(beside)
    bent = digits_short_of(hand, thing, angles, -tip, none, most=np.radians(20.0))
    assert set(bent) <= set(beside)
    assert all(0.0 < bent[digit] <= beside[digit] for digit in bent)
    far = digits_short_of(hand, thing, angles, np.array([0.0, 1.0, 0.0]), none, most=0.1)
    assert set(far) == set(DIGITS)
    assert min(far.values()) > 0.7
    assert _without_share({"pinky": 0.0023}, ("thumb", "pinky")) == "pinky 2.3 mm short, thumb touching"
    assert _without_share({}, ("thumb", "index"), ("index",)) == "thumb touching, index on bone"


@pytest.mark.slow
def test_digits_on_a_handle_use_the_same_share_of_their_muscles(tmp_path: Path) -> None:
    _plan(tmp_path, "element = 0.008", 'element = 0.006\nshare = "muscles"')
    experiment = GraspExperiment(load_plan(tmp_path / "plan.toml"))
    row, _ = perform(experiment, 0)
    assert (row["press"], row["success"]) == ("REACHED", True), row["message"]
    assert row["force"] == pytest.approx(12.5, rel=0.05)
    forces = np.array([row[f"force_{digit}"] for digit in ("thumb", "index", "middle", "ring", "pinky")])
    shares = np.array([row[f"share_{digit}"] for digit in ("thumb", "index", "middle", "ring", "pinky")])
    pressing = shares > 0.1 * shares.max()  # others do not reach the handle
    assert pressing.sum() >= 4
    np.testing.assert_allclose(shares[pressing], shares[pressing].mean(), rtol=0.1)
    assert forces.max() < 0.5 * forces.sum()


@pytest.mark.slow
def test_a_hand_presses_a_handle(tmp_path: Path) -> None:
    _plan(tmp_path, "0.008", "0.006")  # m; coarser elements leave too little flesh over the bones
    out = tmp_path / "out"
    command = ["study", str(tmp_path / "plan.toml"), "-o", str(out)]
    with pytest.raises(SystemExit) as ended:
        main([*command, "--processes", "1", "--quiet"])
    assert ended.value.code == 0
    (row,) = read_table(out / "table.parquet")
    assert (row["press"], row["success"], row["asked_force"]) == ("REACHED", True, 12.5)
    assert row["force"] == pytest.approx(12.5, rel=0.05)  # at the last frame, not in the search alone
    digits = ("thumb", "index", "middle", "ring", "pinky")
    assert row["pressed_area"] == pytest.approx(sum(row[f"pressed_area_{part}"] for part in (*digits, "palm")))
    assert row["muscle_share"] == max(row[f"share_{digit}"] for digit in digits) == row[f"share_{row['strained']}"]
    # forces of digits are vectors' lengths: what presses is at least as much
    assert row["normal_force"] > 0.8 * row["force"]
    pressure = np.load(out / "poses.npz")["hand/pressure"][0]
    assert pressure.min() >= 0.0
    assert pressure.max() > 1e3  # Pa
    assert (out / "grips.png").exists()
    assert (out / "pressure.png").exists()

    with pytest.raises(SystemExit) as ended:
        main([*command, "--rerun", "0", "--quiet"])
    assert ended.value.code == 0
    again = json.loads((out / "rerun" / "0" / "row.json").read_text())
    assert again["differences"] == []
