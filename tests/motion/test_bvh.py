"""BVH files: analytic positions of known rotations, channel orders, and mistakes with their lines."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.motion.bvh import read_bvh

ARM = """HIERARCHY
ROOT Hips
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Arm
  {
    OFFSET 10 0 0
    CHANNELS 3 Yrotation Zrotation Xrotation
    End Site
    {
      OFFSET 5 0 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
0 0 0 0 0 0 0 0 0
1 2 3 90 0 0 0 0 0
0 0 0 0 0 90 30 20 -40
"""


def write(folder: Path, text: str) -> Path:
    path = folder / "motion.bvh"
    path.write_text(text)
    return path


def test_known_rotations_give_known_positions(tmp_path: Path) -> None:
    clip = read_bvh(write(tmp_path, ARM))
    assert clip.names == ("Hips", "Arm", "Arm end")
    assert clip.rate == 30.0
    np.testing.assert_array_equal(clip.rest, [[1, 2, 3], [11, 2, 3], [16, 2, 3]])
    np.testing.assert_allclose(clip.positions[0], [[0, 0, 0], [10, 0, 0], [15, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(clip.positions[1], [[1, 2, 3], [1, 12, 3], [1, 17, 3]], atol=1e-12)
    root = Rotation.from_euler("Y", 90, degrees=True)
    arm = root * Rotation.from_euler("YZX", [30, 20, -40], degrees=True)
    np.testing.assert_allclose(clip.positions[2, 1], root.apply([10, 0, 0]), atol=1e-12)
    np.testing.assert_allclose(clip.positions[2, 2], root.apply([10, 0, 0]) + arm.apply([5, 0, 0]), atol=1e-12)


def test_case_spaces_and_position_channels_of_inner_joints(tmp_path: Path) -> None:
    text = ARM.replace("\n", "\r\n").replace("End Site", "END SITE").replace("Frames:", "FRAMES:")
    text = text.replace("CHANNELS 3 Y", "CHANNELS 4 Xposition Y").replace("0 0 0 0 0 0 0 0 0", "0 0 0 0 0 0 7 0 0 0")
    text = text.replace("90 0 0 0 0 0", "90 0 0 7 0 0 0").replace("0 90 30 20 -40", "0 90 7 30 20 -40")
    clip = read_bvh(write(tmp_path, text))
    np.testing.assert_allclose(clip.positions[0, 1], [7, 0, 0], atol=1e-12)


def test_another_rate_keeps_the_ends(tmp_path: Path) -> None:
    clip = read_bvh(write(tmp_path, ARM))
    double = clip.at_rate(60.0)
    assert len(double) == 5
    np.testing.assert_allclose(double.positions[::2], clip.positions, atol=1e-9)
    half = Rotation.from_quat(double.rotations[1, 0]).as_rotvec(degrees=True)
    np.testing.assert_allclose(half, [0, 0, 45], atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("HIERARCHY", "HIERARCHIE", 1, "expected 'HIERARCHY'"),
        ("OFFSET 10 0 0", "OFFSET 10 0", 8, "OFFSET of 'Arm': want 3 numbers, got 2"),
        ("OFFSET 10 0 0", "OFFSET 10 o 0", 8, "'o' is not a number"),
        ("OFFSET 10 0 0", "", 14, "'Arm' of line 6 has no OFFSET"),
        ("CHANNELS 3 Yrotation", "CHANNELS 4 Yrotation", 9, "want their number"),
        ("CHANNELS 3 Yrotation", "CHANNELS 3 Yrotatoin", 9, "no channel 'Yrotatoin'"),
        ("    End Site", "    Offset 1 1 1\n    Site", 11, "unexpected 'Site'"),
        ("ROOT Hips", "JOINT Hips", 2, "JOINT stands outside a ROOT"),
        ("Frames: 3", "Frames: many", 17, "want 'Frames:'"),
        ("Frames: 3", "Frames: -3", 17, "want 'Frames:'"),
        ("Frames: 3", "Frames: ²", 17, "want 'Frames:'"),
        ("Frames: 3", f"Frames: {'9' * 5000}", 17, "want 'Frames:'"),
        ("Frames: 3", "Number: 3", 17, "want 'Frames:' and its value, not 'Number: 3'"),
        ("CHANNELS 3 Yrotation", "CHANNELS ³ Yrotation", 9, "want their number"),
        ("CHANNELS 3 Yrotation", f"CHANNELS {'3' * 5000} Yrotation", 9, "want their number"),
        ("Frame Time: 0.0333333", "Frame Time: 0", 18, "above 0"),
        ("1 2 3 90 0 0 0 0 0", "1 2 3 90 0 0 0 0", 20, "frame 1: want 9 numbers, got 8"),
        ("1 2 3 90 0 0 0 0 0", "1 2 3 nan 0 0 0 0 0", 20, "'nan' is not finite"),
        ("  }\n}\nMOTION", "  }\nMOTION", 15, "'Hips' of line 2 is not closed"),
    ],
)
def test_mistakes_are_named_with_their_line(tmp_path: Path, old: str, new: str, line: int, message: str) -> None:
    assert old in ARM
    with pytest.raises(InputError, match=message) as caught:
        read_bvh(write(tmp_path, ARM.replace(old, new, 1)))
    assert caught.value.line == line


@pytest.mark.parametrize(
    ("announced", "note"),
    [
        (2, "3 frames, not the 2"),
        (4, "3 frames, not the 4"),
        (0, "3 frames, not the 0"),
        (999999999999, "3 frames, not the 999999999999"),
        ("3.0", ""),
        (3, ""),
    ],
)
def test_the_frames_that_are_there_are_read(tmp_path: Path, announced: int | str, note: str) -> None:
    clip = read_bvh(write(tmp_path, ARM.replace("Frames: 3", f"Frames: {announced}")))
    assert len(clip) == 3
    np.testing.assert_array_equal(clip.positions, read_bvh(write(tmp_path, ARM)).positions)
    assert (len(clip.notes) == 1 and note in clip.notes[0]) if note else clip.notes == ()


def test_a_frame_cut_off_is_left_out_with_a_note_and_a_missing_motion_is_refused(tmp_path: Path) -> None:
    clip = read_bvh(write(tmp_path, ARM.replace("30 20 -40\n", "30 20")))
    assert len(clip) == 2
    assert "the last frame is cut off and left out: 8 of 9 numbers" in clip.notes[0]
    with pytest.raises(InputError, match="frame 0: want 9 numbers, got 8"):
        read_bvh(write(tmp_path, ARM.partition("0 0 0 0 0 0 0 0 0")[0] + "0 0 0 0 0 0 0 0"))
    with pytest.raises(InputError, match="expected frame 0 of 3"):
        read_bvh(write(tmp_path, ARM.partition("0 0 0 0 0 0 0 0 0")[0]))


def test_marks_tabs_comments_and_missing_blanks_do_not_matter(tmp_path: Path) -> None:
    text = ARM.replace("Frames: 3", "Frames:3").replace("Frame Time: 0.0333333", "Frame Time:0.0333333 // 30/s")
    text = text.replace("  OFFSET 10 0 0", "\tOFFSET\t10\t0\t0 # to the elbow").replace("ROOT", "// by hand\n\nROOT")
    path = tmp_path / "motion.bvh"
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    clip, plain = read_bvh(path), read_bvh(write(tmp_path, ARM))
    assert (clip.names, clip.rate, clip.notes) == (plain.names, plain.rate, ())
    np.testing.assert_array_equal(clip.positions, plain.positions)


HEAD, ROWS = ARM.partition("MOTION")[0], ARM.partition("0.0333333\n")[2]
WRITINGS = {
    "UTF-16": ARM.encode("utf-16"),
    "old Mac": ARM.replace("\n", "\r").encode(),
    "padded with zeros": ARM.encode() + bytes(512),
    "braces on the line before": re.sub(r"\n *([{}])", r" \1", ARM).encode(),
    "one line": (" ".join(HEAD.split()) + ARM[len(HEAD) - 1 :]).encode(),
    "rows broken": ARM.replace(ROWS, re.sub(r"((?:\S+\s+){4})", r"\1\n", ROWS)).encode(),
    "rows on one line": ARM.replace(ROWS, " ".join(ROWS.split())).encode(),
    "decimal commas": re.sub(r"(-?\d+)\.?(\d*)(?=[ \n])", r"\1,\g<2>0", ROWS).join([ARM[: -len(ROWS)], ""]).encode(),
    "decimal commas in the frame time": ARM.replace("0.0333333", "0,0333333").encode(),
    "commas between": ARM.replace("OFFSET 10 0 0", "OFFSET 10, 0, 0").encode(),
    "other blanks": ARM.replace("Frames: 3", "Frames : 3").replace("Frame Time: ", "FrameTime ").encode(),
    "EndSite": ARM.replace("End Site", "EndSite").encode(),
}


@pytest.mark.parametrize("how", WRITINGS)
def test_ways_of_writing_the_same(tmp_path: Path, how: str) -> None:
    path = tmp_path / "other.bvh"
    path.write_bytes(WRITINGS[how])
    clip, want = read_bvh(path), read_bvh(write(tmp_path, ARM))
    np.testing.assert_array_equal(clip.positions, want.positions)
    np.testing.assert_array_equal(clip.rotations, want.rotations)
    assert (clip.names, clip.rate, clip.warnings) == (want.names, want.rate, ())


def test_channels_of_scale_are_read_over_and_told_where_they_change(tmp_path: Path) -> None:
    lines = ARM.replace("CHANNELS 3 Yrotation", "CHANNELS 4 Xscale Yrotation").splitlines()
    for scale in (1, 2):
        for at, line in enumerate(lines[-3:]):
            words = line.split()
            lines[len(lines) - 3 + at] = " ".join([*words[:6], str(1 + at * (scale - 1)), *words[-3:]])
        clip, want = read_bvh(write(tmp_path, "\n".join(lines))), read_bvh(write(tmp_path, ARM))
        np.testing.assert_array_equal(clip.rotations, want.rotations)
        assert clip.warnings == (("the motion scales Arm: scale is not followed",) if scale == 2 else ())


def test_frames_that_last_long_are_doubted_and_a_single_one_may_last_no_time(tmp_path: Path) -> None:
    slow = read_bvh(write(tmp_path, ARM.replace("0.0333333", "30")))
    assert slow.warnings == ("a frame lasts 30 s, as the file says: are other units meant?",)
    pose = ARM[: -len(ROWS)] + ROWS.splitlines()[1] + "\n"
    assert read_bvh(write(tmp_path, pose.replace("Frames: 3", "Frames: 1").replace("0.0333333", "0"))).rate == 30.0


def test_positions_below_the_root_replace_offsets_or_add_to_them(tmp_path: Path) -> None:
    text = ARM.replace("CHANNELS 3 Y", "CHANNELS 6 Xposition Yposition Zposition Y")

    def moved(x: float) -> str:
        rows = text.replace("0 0 0 0 0 0 0 0 0", f"0 0 0 0 0 0 {x} 0 0 0 0 0")
        rows = rows.replace("1 2 3 90 0 0 0 0 0", f"1 2 3 90 0 0 {x} 0 0 0 0 0")
        return rows.replace("0 0 0 0 0 90 30 20 -40", f"0 0 0 0 0 90 {x} 0 0 30 20 -40")

    replacing, adding = read_bvh(write(tmp_path, moved(9.5))), read_bvh(write(tmp_path, moved(-0.5)))
    np.testing.assert_allclose(replacing.positions[0, 1], [9.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(replacing.positions, adding.positions, atol=1e-12)
    assert replacing.notes == ()
    assert "additions to their OFFSETs" in adding.notes[0]


def test_empty_and_missing_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the file ends here"):
        read_bvh(write(tmp_path, ""))
    with pytest.raises(InputError, match="cannot be read"):
        read_bvh(tmp_path / "none.bvh")


def test_real_recording(data: Path) -> None:
    clip = read_bvh(data / "motion_cmu_walk_bvh" / "cmu_12_01_walk.bvh")
    assert clip.positions.shape == (524, 38, 3)
    assert clip.rate == pytest.approx(120, abs=0.01)
    lengths = np.linalg.norm(clip.positions[:, 1:] - clip.positions[:, clip.parents[1:]], axis=-1)
    rest = np.linalg.norm(clip.rest[1:] - clip.rest[clip.parents[1:]], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(rest, lengths.shape), atol=1e-9)
