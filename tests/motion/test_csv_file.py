"""Motions in tables: what is read, what is refused and where, and the way back."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tests.motion.skeletons import hand
from warpjld.errors import InputError
from warpjld.motion import Motion, read_csv, write_csv


def write(folder: Path, text: str) -> Path:
    path = folder / "motion.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_sparse_cells_are_no_keys(tmp_path: Path) -> None:
    path = write(tmp_path, "frame,index.base.flexion,wrist.pivot,root.y\n0,0,,0\n10,45,5,\n\n20,90,,0.25\n")
    motion = read_csv(path, skeleton=hand(), rate=30)
    assert motion.rate == 30
    assert motion.frame_range == (0, 20)
    assert [k.frame for k in motion.tracks["wrist.pivot"].keys] == [10]
    assert motion.value("index.base.flexion", 5.0) == pytest.approx(np.radians(22.5))
    assert motion.value("root.y", 10.0) == pytest.approx(0.125)


def test_aliases_and_byte_order_mark(tmp_path: Path) -> None:
    path = write(tmp_path, "\ufeffFrame, metacarpus.flexion, Joint 12.Flexion\n1, 10, 30\n")
    motion = read_csv(path, skeleton=hand())
    assert set(motion.tracks) == {
        "ring.carpometacarpal.flexion",
        "pinky.carpometacarpal.flexion",
        "index.base.flexion",
    }


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("time,index.base.flexion\n0,1\n", ":1:1", "first heading must be 'frame', not 'time'"),
        ("frame;index.base.flexion\n0;1,5\n1;2.5\n", ":3:2", "'2.5': a decimal point, but line 2 has the other"),
        ("frame;index.base.flexion\n0;1.5\n1;2,5\n", ":3:2", "'2,5': a decimal comma, but line 2 has the other"),
        ("frame;index.base.flexion\n0;1.234,5\n", ":2:2", "want numbers without thousands separators"),
        ("frame;index.base.flexion\n0;1,234,567\n", ":2:2", "want numbers without thousands separators"),
        ("frame,index.base.flexion\n0,1,5\n", ":2", "decimal commas need semicolons"),
        ("time;index.base.flexion\n0;1\n", ":1:1", "first heading must be 'frame', not 'time'"),
        ("sep=;\nframe,index.base.flexion\n0,1\n", ":2:1", "first heading must be 'frame', not 'frame,index"),
        ("frame,index.base.flexion,indx.knuckle2.flexion\n0,1,2\n", ":1:3", "did you mean index.knuckle2"),
        ("frame,index.base.flexion,left.index.base.flexion\n0,1,2\n", ":1:3", "the same channel"),
        ("frame,index.base.flexion\n0,1\n5,fast\n", ":3:2", "'fast' is not a number"),
        ("frame,index.base.flexion\n0,1\n5,inf\n", ":3:2", "not a finite number"),
        ("frame,index.base.flexion\n0,1\n,2\n", ":3:1", "no frame number"),
        ("frame,index.base.flexion\n0,1\n0,2\n", ":3:1", "stands here twice"),
        ("frame,index.base.flexion\n4,1\n3,2\n", ":3:1", "does not come after frame 4"),
        ("frame,index.base.flexion\n4,1,7\n", ":2", "3 cells under 2 headings"),
        ("frame\n4\n", ":1", "no channels"),
        ("frame,index.base.flexion\n4,\n", "", "no keys"),
        ("", "", "empty"),
    ],
)
def test_mistakes_are_named_with_their_place(tmp_path: Path, text: str, place: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_csv(write(tmp_path, text), skeleton=hand())
    assert f"motion.csv{place}: " in str(caught.value)


def test_missing_and_binary_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read_csv(tmp_path / "none.csv")
    (tmp_path / "motion.csv").write_bytes(b"\x81\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        read_csv(tmp_path / "motion.csv")


channels = st.sampled_from(["index.base.flexion", "left.thumb.base.abduction", "wrist.pivot", "root.z"])


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(
    keys={("index.base.flexion", 0): 0.0, ("index.base.flexion", 1): 3.0, ("index.base.flexion", 3): 3.0 - 4e-16},
    tension=0.0,
)
@given(
    st.dictionaries(st.tuples(channels, st.integers(0, 40)), st.floats(-3, 3), min_size=1, max_size=12),
    st.sampled_from([0.0, 0.4]),
)
def test_writing_and_reading_give_the_same_motion(tmp_path: Path, keys: dict, tension: float) -> None:
    motion = Motion(tension=tension)
    for (channel, frame), value in keys.items():
        motion.set_key(channel, frame, value)
    write_csv(tmp_path / "out.csv", motion)
    again = read_csv(tmp_path / "out.csv")
    assert list(tmp_path.iterdir()) == [tmp_path / "out.csv"]
    for channel in motion.tracks:
        np.testing.assert_allclose(again.value(channel, motion.frames), motion.value(channel, motion.frames), atol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        "frame;index.base.flexion;root.y\r\n0;0;0,25\r\n10;22,5;\r\n20;;0,5\r\n",
        "frame\tindex.base.flexion\troot.y\n0\t0\t0.25\n10\t22.5\n20\t\t0.5\n",
        '\ufeff"Frame";"index.base.flexion";"root.y"\n"0";"0";"0,25"\n"10";"22,5";""\n"20";"";"0,5"\n',
        'frame, "index.base.flexion", root.y\n0, 0, "0,25"\n10, "22,5",\n20,,"0,5"\n',
        "frame;index.base.flexion;root.y;;\r\n0;0;0,25;;\r\n10;22,5;;;\r\n20;;0,5;;\r\n;;;;\r\n",
        "Frame;Index . Base . Flexion;root.y;\n0.0;0;0,25;\n10.0;22,5;;\n20.0;;0,5;\n",
        "\ufeffsep=;\nframe;index.base.flexion;root.y\n0;0;.25\n10;22.5;\n20;;.5\n",
    ],
)
def test_tables_as_spreadsheets_of_any_country_write_them(tmp_path: Path, text: str) -> None:
    motion = read_csv(write(tmp_path, text), skeleton=hand())
    assert [(k.frame, np.degrees(k.value)) for k in motion.tracks["index.base.flexion"].keys] == [
        (0, 0),
        (10, pytest.approx(22.5)),
    ]
    assert [(k.frame, k.value) for k in motion.tracks["root.y"].keys] == [(0, 0.25), (20, 0.5)]


def test_a_minus_sign_of_typography_is_one(tmp_path: Path) -> None:
    motion = read_csv(write(tmp_path, "frame;index.base.flexion\n0;0\n10;\N{MINUS SIGN}2,5\n"), skeleton=hand())
    assert np.degrees(motion.tracks["index.base.flexion"].keys[1].value) == pytest.approx(-2.5)
