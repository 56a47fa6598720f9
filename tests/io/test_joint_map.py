"""Joints stated by hand win over what is recognised; sizes that no hand has are told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from warpjld import cli
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.assemble import assemble_rig
from warpjld.io.joint_map_file import read_joint_map, write_joint_map
from warpjld.skeleton import hand_joint_names


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("rigs")


@pytest.fixture(scope="module")
def hand(folder, write_glb, hand_glb) -> Path:
    """A hand in names that mean nothing."""
    made = hand_glb()
    made.names = [f"j{n}" for n in range(len(made.names))]
    return write_glb(made, folder / "hand.glb")


def own(rig, name: str) -> str:
    return dict(zip(rig.skeleton.names, rig.source_joints, strict=True))[name]


def test_what_a_map_states_wins(hand):
    plain = load_rig(hand, side="left")
    index, middle = (own(plain, f"left.{digit}.knuckle3") for digit in ("index", "middle"))
    swapped = load_rig(hand, joint_map={"left.index.knuckle3": middle, "left.middle.knuckle3": index})
    assert own(swapped, "left.index.knuckle3") == middle
    assert own(swapped, "left.middle.knuckle3") == index
    assert own(swapped, "left.ring.knuckle3") == own(plain, "left.ring.knuckle3")


def test_null_says_that_a_joint_is_not_there(hand):
    rig = load_rig(hand, joint_map={"left.index.tip": None})
    assert own(rig, "left.index.tip") == ""
    assert set(rig.skeleton.names) == set(hand_joint_names("left"))


def test_ignored_joints_are_none(hand):
    plain = load_rig(hand, side="left")
    tip = own(plain, "left.index.tip")
    rig = load_rig(hand, side="left", joint_map={"ignore": [tip]})
    assert tip not in rig.source_joints
    assert own(rig, "left.middle.tip") == own(plain, "left.middle.tip")


def test_a_map_alone_makes_a_hand_of_anything(folder, write_glb, hand_glb):
    """A hand of three fingers in names that mean nothing: no shape that is known."""
    made = hand_glb()
    keep = [j for j, name in enumerate(made.names) if ".ring." not in name and ".middle." not in name]
    names = {f"x{j}": made.names[j] for j in keep}
    parents = [-1 if made.parents[j] < 0 else keep.index(made.parents[j]) for j in keep]
    old = {j: i for i, j in enumerate(keep)}
    joints = np.vectorize(lambda j: old.get(j, 0))(made.joints)
    path = write_glb(
        replace(made, names=list(names), parents=parents, frames=made.frames[keep], joints=joints),
        folder / "three.glb",
    )
    unmapped = load_rig(path)
    assert not any(name.startswith("left.") for name in unmapped.skeleton.names)
    rig = load_rig(path, joint_map={canonical: joint for joint, canonical in names.items()})
    assert set(rig.skeleton.names) == {n for n in hand_joint_names("left") if "ring" not in n and "middle" not in n}


def test_written_maps_read_back_the_same(hand, tmp_path):
    plain = load_rig(hand, side="left")
    write_joint_map(tmp_path / "map.json", plain)
    again = load_rig(hand, joint_map=tmp_path / "map.json")
    assert again.skeleton.names == plain.skeleton.names
    assert again.sources == plain.sources
    np.testing.assert_array_equal(again.skeleton.rest, plain.skeleton.rest)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ('{"left.kneee": "a"}', "no canonical joint 'left.kneee'; did you mean left.knee?"),
        ('{"left.knee": 3}', "left.knee wants the name of a joint of the file, or null, got 3"),
        ('{"ignore": "a"}', "ignore wants a list"),
        ("[]", "want a joint map"),
        ("{", "is not JSON"),
    ],
)
def test_bad_maps_are_named(tmp_path, content, said):
    path = tmp_path / "map.json"
    path.write_text(content)
    with pytest.raises(InputError, match=said.replace("?", r"\?")) as caught:
        read_joint_map(path)
    assert caught.value.path == path


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"left.index.base": "j99"}, "the file has no joint 'j99'; did you mean j9"),
        (
            {"left.index.base": "j3", "left.index.tip": "j3"},
            "'j3' is given for both left.index.base and left.index.tip",
        ),
        ({"left.index.base": "j3", "ignore": ["j3"]}, "the joint of left.index.base is to be ignored, too"),
    ],
)
def test_maps_that_do_not_fit_a_file_are_named(hand, stated, said):
    with pytest.raises(InputError, match=said) as caught:
        load_rig(hand, joint_map=stated)
    assert Path(caught.value.path) == hand


def test_joints_of_one_name_are_numbered(folder, write_glb, hand_glb):
    made = hand_glb()
    made.names = ["joint"] * len(made.names)
    path = write_glb(made, folder / "same.glb")
    plain = load_rig(path, side="left")
    with pytest.raises(InputError, match="25 joints of the file are called 'joint': write 'joint#1'"):
        load_rig(path, joint_map={"left.index.tip": "joint"})
    source = plain.sources[plain.skeleton.index("index.tip")]
    rig = load_rig(path, joint_map={"left.index.tip": f"joint#{source + 1}"})
    assert rig.sources[rig.skeleton.index("index.tip")] == source


def test_a_body_under_other_words_is_the_same_body(data):
    """Thigh, shin and foot called Leg, Shin and Foot."""
    from warpjld.io.gltf.skin import read_gltf_rig

    source = read_gltf_rig(data / "body_mesh2motion_mannequin/human-male.glb")
    words = {"thigh": "Leg", "calf": "Shin", "foot": "Foot"}
    names = tuple(
        ("Left" if name.endswith("_l") else "Right") + words[name[:-2]] if name[:-2] in words else name
        for name in source.tree.names
    )
    plain = assemble_rig(source)
    renamed = assemble_rig(replace(source, tree=replace(source.tree, names=names)))
    assert renamed.skeleton.names == plain.skeleton.names
    assert renamed.sources == plain.sources
    np.testing.assert_array_equal(renamed.skeleton.rest, plain.skeleton.rest)
    np.testing.assert_array_equal(renamed.skeleton.axes, plain.skeleton.axes)
    assert renamed.suspicious == ()
    assert any("left.hip 'LeftLeg'" in note for note in renamed.notes)


def test_a_hand_of_implausible_size_is_told_and_scale_mends_it(folder, write_glb, hand_glb):
    made = hand_glb()
    frames = made.frames.copy()
    frames[:, :3, 3] *= 0.45
    path = write_glb(replace(made, vertices=0.45 * made.vertices, frames=frames), folder / "small.glb")
    usual = load_rig(write_glb(made, folder / "usual.glb"))
    assert usual.suspicious == ()
    small = load_rig(path)
    assert len(small.suspicious) == 1
    assert "this hand measures 0.08" in small.suspicious[0]
    assert "--scale" in small.suspicious[0]
    mended = load_rig(path, scale=1 / 0.45)
    assert mended.suspicious == ()
    np.testing.assert_allclose(mended.skeleton.rest, usual.skeleton.rest, atol=1e-6)


def main(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    return int(ended.value.code or 0)


def smaller(folder, write_glb, hand_glb) -> Path:
    made = hand_glb()
    frames = made.frames.copy()
    frames[:, :3, 3] *= 0.4
    return write_glb(replace(made, vertices=0.4 * made.vertices, frames=frames), folder / "smaller.glb")


def test_the_map_and_the_size_reach_commands(folder, write_glb, hand_glb, tmp_path, capsys):
    path = smaller(folder, write_glb, hand_glb)
    assert main(["inspect", str(path), "--no-picture", "-q", "--write-map", str(tmp_path / "m.json")]) == 0
    assert "suspicious: size: this hand measures" in capsys.readouterr().err
    content = json.loads((tmp_path / "m.json").read_text())
    assert content["left.index.base"] == "left.index.base"
    assert main(["inspect", str(path), "--no-picture", "--map", str(tmp_path / "missing.json")]) == 1
    assert "missing.json: cannot be read" in capsys.readouterr().err
    assert main(["inspect", "builtin:left", "--no-picture", "--map", str(tmp_path / "m.json")]) == 1
    assert "--map only work for files" in capsys.readouterr().err


def test_the_map_and_the_size_reach_scripts(folder, write_glb, hand_glb, tmp_path, capsys):
    path = smaller(folder, write_glb, hand_glb)
    (tmp_path / "m.json").write_text('{"left.index.tip": null}')
    script = tmp_path / "a.jld"
    script.write_text(f'HAND LEFT "{path}" MAP "m.json"\nHAND RIGHT "{path}" SCALE 2.5 NAME mended\n')
    assert main(["run", str(script), "--check", "-o", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().err
    assert "LEFT: size: this hand measures" in told
    assert "MENDED: size" not in told
    script.write_text(f'HAND LEFT "{path}" MAP "none.json"\n')
    assert main(["run", str(script), "--check", "-o", str(tmp_path / "out")]) == 1


def test_the_map_and_the_size_reach_studies(folder, write_glb, hand_glb, tmp_path, capsys):
    path = smaller(folder, write_glb, hand_glb)
    (tmp_path / "m.json").write_text('{"left.index.tip": null}')
    study = tmp_path / "a.toml"
    text = 'seed = 1\ntrials = 2\n[[objects]]\nbuiltin = "ball"\n[[hands]]\nmap = "m.json"\n'
    study.write_text(f'{text}file = "{path}"\n')
    assert main(["study", str(study), "--check", "-q"]) == 0
    assert "suspicious: smaller: size: this hand measures" in capsys.readouterr().err
    study.write_text(f'{text}file = "{path}"\nscale = 2.5\n')
    assert main(["study", str(study), "--check", "-q"]) == 0
    assert "suspicious" not in capsys.readouterr().err
