"""Pads read from contact made by hand, and the files written of them."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.contact import Pair
from warpjld.fem.contact.results.nodal_contact import NodalContact, tributary_areas
from warpjld.fem.hand import FleshHand
from warpjld.simulation.report.tactile import tactile_of
from warpjld.simulation.report.tactile_files import TACTILE_COLUMNS, draw_tactile, write_tactile


@dataclass(frozen=True, eq=False)
class Touched:
    """As ``Touch`` of the contact package, as far as it is read."""

    nodal: NDArray[np.float64]
    nodal_contact: NodalContact
    name: str = "ball"


@dataclass(frozen=True, eq=False)
class Moment:
    time: float
    displacement: NDArray[np.float64]
    touches: tuple[Touched, ...] = field(default=())


def pad_nodes(hand: FleshHand, name: str) -> NDArray[np.int64]:
    return np.flatnonzero(hand.node_labels == hand.label_names.index(name))


def pressed(hand: FleshHand, name: str, pressure: float) -> Touched:
    """Even pressure on a pad, half of its nodes sticking, the others slipped by 1 mm."""
    nodes = pad_nodes(hand, name)
    count = len(hand.mesh.nodes) + 7
    quads = hand.mesh.quads(hand.skin_faces)
    x = hand.mesh.nodes[quads]
    out = np.zeros((count, 3))
    np.add.at(out, quads, 0.125 * np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])[:, None].repeat(4, axis=1))
    normal = out[nodes] / np.linalg.norm(out[nodes], axis=1)[:, None]
    area = np.zeros(count)
    area[nodes] = tributary_areas(hand.mesh, hand.skin_faces, hand.mesh.nodes)[nodes]
    nodal = np.zeros((count, 3))
    nodal[nodes] = -pressure * area[nodes, None] * normal
    held = np.where(np.arange(count) % 2 == 0, area, 0.0)
    return Touched(nodal, NodalContact(pressure * area, area, held, 1e-3 * (area - held)))


def test_pads_read_what_presses_them(hand: FleshHand) -> None:
    still = np.zeros((len(hand.mesh.nodes) + 7, 3))
    name = "left.index.distal"
    touched = pressed(hand, name, 8e3)
    found = tactile_of(hand, [Moment(1.0, still), Moment(2.0, still, (touched,))])
    p = found.pads.index(name)
    nodes = pad_nodes(hand, name)
    area = touched.nodal_contact.area
    assert not found.touching[0].any()
    np.testing.assert_array_equal(np.flatnonzero(found.touching[1]), [p])
    assert found.normal_force[1, p] == pytest.approx(8e3 * area.sum())
    np.testing.assert_allclose(found.force[1, p], touched.nodal.sum(axis=0))
    np.testing.assert_allclose(found.centre[1, p], area[nodes] @ hand.mesh.nodes[nodes] / area.sum())
    assert found.area[1, p] == pytest.approx(area.sum())
    assert found.peak[1, p] == pytest.approx(8e3)
    share = touched.nodal_contact.held.sum() / area.sum()
    assert 0.3 < share < 0.7
    assert found.sticking[1, p] == pytest.approx(share)
    assert found.slip[1, p] == pytest.approx(1e-3 * (1.0 - share))
    assert np.isnan(found.centre[1, p - 1]).all()
    assert np.isnan(found.sticking[1, p - 1])
    with pytest.raises(InputError, match="at least one instant"):
        tactile_of(hand, [])


def test_one_pair_of_several(hand: FleshHand) -> None:
    still = np.zeros((len(hand.mesh.nodes) + 7, 3))
    ball = pressed(hand, "left.index.distal", 8e3)
    plate = replace(pressed(hand, "left.thumb.distal", 5e3), name="plate")
    both = [Moment(1.0, still), Moment(2.0, still, (ball, plate))]
    touched = {only: tactile_of(hand, both, only=only).touching[1] for only in (None, "ball", "plate")}
    pads = tactile_of(hand, both).pads
    assert [pads[p] for p in np.flatnonzero(touched["ball"])] == ["left.index.distal"]
    assert [pads[p] for p in np.flatnonzero(touched["plate"])] == ["left.thumb.distal"]
    np.testing.assert_array_equal(touched[None], touched["ball"] | touched["plate"])
    with pytest.raises(InputError, match="no pair 'cup'; there are ball, plate"):
        tactile_of(hand, both, only="cup")


def test_pairs_are_known_by_their_names() -> None:
    assert Pair("pad", "ball", name="grip").label == "grip"
    assert Pair("pad", "ball").label == "pad–ball"
    assert Pair("pad", "ball").title == "contact 'pad–ball'"


def test_files(hand: FleshHand, tmp_path: Path) -> None:
    still = np.zeros((len(hand.mesh.nodes) + 7, 3))
    instants = [Moment(float(t), still, (pressed(hand, "left.thumb.distal", 1e3 * t),)) for t in (1, 2)]
    found = tactile_of(hand, instants)
    write_tactile(tmp_path / "tactile.csv", found)
    with (tmp_path / "tactile.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(found.pads)
    touched = [row for row in rows if row["touching"] == "true"]
    assert [row["pad"] for row in touched] == ["left.thumb.distal"] * 2
    assert float(touched[1]["normal_force"]) == pytest.approx(2.0 * float(touched[0]["normal_force"]))
    assert all(row["centre_x"] == "" for row in rows if row["touching"] == "false")
    described = json.loads((tmp_path / "tactile.columns.json").read_text(encoding="utf-8"))
    assert [c["name"] for c in described] == [c.name for c in TACTILE_COLUMNS]

    from warpjld.tables.files import read_table

    pytest.importorskip("pyarrow")
    write_tactile(tmp_path / "tactile.parquet", found)
    table = read_table(tmp_path / "tactile.parquet")
    assert [r["pad"] for r in table] == [r["pad"] for r in rows]
    assert table[0]["centre_x"] is None

    draw_tactile(tmp_path / "tactile.png", found)
    assert (tmp_path / "tactile.png").stat().st_size > 10_000
    assert not list(tmp_path.glob("*.part*"))
