"""Studies on Ray: the same table as on this machine, whatever happens to workers and machines."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.study.dice import Dice, edit_trial
from tests.study.heard import Heard
from warpjld.errors import InputError, MissingExtraError, WarpjldError
from warpjld.study import run_study
from warpjld.study.cluster.session import connected

ray = pytest.importorskip("ray", reason="Ray is not installed")

_ROOT = Path(__file__).resolve().parents[2]
_RESULTS = ("table.csv", "poses.npz")


@pytest.fixture(scope="module", autouse=True)
def undrawn() -> Iterator[None]:
    """Studies without summaries, whose drawing would take a third of these tests' processor time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warpjld.study.run.write_summary", lambda *how: [])
        yield


@pytest.fixture(scope="module")
def workers() -> Iterator[None]:
    """Ray with two workers, for all tests of this file that are not slow."""
    with connected("local", 2):
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A hundred trials in one process of this machine."""
    folder = tmp_path_factory.mktemp("whole")
    run_study(Dice(trials=100), folder, processes=1, table="csv")
    return folder


@pytest.fixture(scope="module")
def thousand(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A thousand."""
    folder = tmp_path_factory.mktemp("thousand")
    run_study(Dice(), folder, processes=1, table="csv")
    return folder


def _same(one: Path, other: Path) -> bool:
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in _RESULTS)


def _manifest(folder: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((folder / "manifest.json").read_text())["last_run"]
    return content


@pytest.mark.usefixtures("workers")
def test_stopped_half_way_with_a_worker_killed_and_resumed(whole: Path, tmp_path: Path) -> None:
    finished = 0

    def stop(what: str, done: int, total: int) -> None:
        nonlocal finished
        finished = done
        if done == 50:
            raise KeyboardInterrupt

    dice = Dice(trials=100, fatal_once=str(tmp_path / "mark"))
    with pytest.raises(KeyboardInterrupt):
        run_study(dice, tmp_path / "a", table="csv", ray="local", report=stop)
    assert finished == 50
    assert not (tmp_path / "a" / "table.csv").exists()
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    result = run_study(dice, tmp_path / "a", table="csv", ray="local")
    assert result.ran == 50
    assert (tmp_path / "mark").exists()  # one worker was killed, by trial 7
    assert _same(tmp_path / "a", whole)
    (node,) = _manifest(tmp_path / "a")["cluster"]["nodes"]
    assert node["trials"] >= 50
    assert node["cpu"]
    assert node["versions"]["numpy"]
    # processes of this machine go on from there as well
    assert run_study(Dice(trials=100), tmp_path / "b", processes=1, table="csv").ran == 50
    assert _same(tmp_path / "b", whole)


@pytest.mark.usefixtures("workers")
def test_a_trial_that_always_kills_its_worker_is_a_row(whole: Path, tmp_path: Path) -> None:
    run_study(Dice(trials=20, fatal=11), tmp_path, table="csv", ray="local")
    lines, calm = ((folder / "table.csv").read_text().splitlines() for folder in (tmp_path, whole))
    assert lines[12].startswith('11,"(11,)",crashed,')
    assert lines[:12] + lines[13:] == calm[:12] + calm[13:21]


@pytest.mark.usefixtures("workers")
def test_a_machine_whose_bits_differ_is_refused(tmp_path: Path) -> None:
    run_study(Dice(trials=9), tmp_path, processes=1, table="csv")
    kept = tmp_path / "trials" / "0000" / "0000004.json"  # of twelve trials 0, 4 and 8 are the canaries
    edit_trial(kept, lambda content: content["row"].update(thrown=content["row"]["thrown"] + 1e-15))
    with pytest.raises(WarpjldError, match=r"no machine of the cluster is left.*: trial 4 gives other bits"):
        run_study(Dice(trials=12), tmp_path, table="csv", ray="local")
    result = run_study(Dice(trials=12), tmp_path, table="csv", ray="local", allow_mixed=True)
    assert result.ran == 3
    assert "trial 4 gives other bits than elsewhere; it is used nevertheless" in result.notes[0]
    assert _manifest(tmp_path)["cluster"]["nodes"][0]["why"] == "trial 4 gives other bits than elsewhere"


@pytest.mark.usefixtures("workers")
def test_other_versions_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from warpjld.study.cluster import run

    said = run.ping()
    monkeypatch.setattr(run, "ping", lambda: {**said, "versions": {**said["versions"], "numpy": "9.9"}})
    with pytest.raises(InputError, match=r"has other versions: numpy .* there, 9.9 here; install the same everywhere"):
        run_study(Dice(trials=2), tmp_path, table="csv", ray="local")


@pytest.mark.usefixtures("workers")
def test_a_worker_that_starts_after_the_program_was_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.study.cluster.nodes.sources", lambda: "as they were")
    with pytest.raises(WarpjldError, match=r"cannot be run on .*: the program's files have changed since the study"):
        run_study(Dice(trials=2), tmp_path, table="csv", ray="local")


@pytest.mark.usefixtures("workers")
def test_inputs_travel_by_hash_and_libraries_have_one_thread(tmp_path: Path) -> None:
    file = tmp_path / "in" / "scene.gltf"
    file.parent.mkdir()
    said = json.dumps({"buffers": [{"uri": "data.bin"}]})
    file.write_text(said)
    (file.parent / "data.bin").write_text("beside")
    run_study(Heard(file), tmp_path / "a", table="csv", ray="local")
    with (tmp_path / "a" / "table.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert [row["status"] for row in rows] == ["heard"] * 4
    assert {(row["said"], row["beside"], row["threads"]) for row in rows} == {(said, "beside", "1,1")}
    (first,) = {row["path"] for row in rows}
    assert Path(first).name == "scene.gltf"
    assert not Path(first).is_relative_to(tmp_path)
    (file.parent / "data.bin").write_text("other")  # other bytes, another place
    run_study(Heard(file, trials=1), tmp_path / "b", table="csv", ray="local")
    with (tmp_path / "b" / "table.csv").open() as table:
        row = next(csv.DictReader(table))
    assert row["beside"] == "other"
    assert row["path"] != first


@pytest.mark.slow
def test_a_machine_that_goes_away_costs_nothing(tmp_path: Path, thousand: Path) -> None:
    from ray.cluster_utils import Cluster

    ray.shutdown()
    small = {"num_cpus": 1, "object_store_memory": 100_000_000}
    cluster = Cluster(initialize_head=True, head_node_args={**small, "include_dashboard": False})
    other = cluster.add_node(**small)
    cluster.wait_for_nodes()
    removed = False

    def remove(what: str, done: int, total: int) -> None:
        nonlocal removed
        if done > 300 and not removed:
            removed = True
            cluster.remove_node(other, allow_graceful=False)

    try:
        run_study(Dice(pause=0.02), tmp_path, table="csv", ray=cluster.address, report=remove)
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert removed
    assert _same(tmp_path, thousand)
    nodes = _manifest(tmp_path)["cluster"]["nodes"]
    assert len(nodes) == 2
    assert all(node["trials"] > 50 for node in nodes)


@pytest.mark.slow
def test_killed_half_way_on_ray_and_resumed(tmp_path: Path, thousand: Path) -> None:
    program = (
        "import sys; from tests.study.dice import Dice; from warpjld.study import run_study; "
        "run_study(Dice(pause=0.005), sys.argv[1], table='csv', ray='local', processes=2)"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), str(_ROOT / "kernels")])}
    study = subprocess.Popen([sys.executable, "-c", program, str(tmp_path)], cwd=_ROOT, env=environment)
    deadline = time.monotonic() + 200.0
    while len(list((tmp_path / "trials").glob("*/*.json"))) < 500:
        assert study.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    study.send_signal(signal.SIGKILL)
    study.wait()
    assert 0 < run_study(Dice(), tmp_path, table="csv", processes=1).ran <= 500
    assert _same(tmp_path, thousand)


def test_no_cluster_at_an_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray, "is_initialized", lambda: False)
    for address, said in (("127.0.0.1:9", ".*"), ("ray://head:10001", "want HOST:PORT"), ("head", "want HOST:PORT")):
        with pytest.raises(InputError, match=rf"no Ray cluster at '{address}': {said}"):
            run_study(Dice(trials=2), tmp_path, table="csv", ray=address)


def test_without_ray_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(MissingExtraError, match=r"warpjld\[ray\]"):
        run_study(Dice(trials=1), tmp_path, table="csv", ray="local")
