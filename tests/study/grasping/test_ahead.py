"""Trials that are alike close together, and end bit for bit as alone."""

from pathlib import Path

import numpy as np
import pytest

from warpjld.study.experiment import BatchedExperiment, generator
from warpjld.study.grasping.plan import load_plan
from warpjld.study.grasping.trial import GraspExperiment
from warpjld.study.pool import TrialWork

PLAN = """
title = "Alike"
trials = 40
seed = 3
scales = [0.9, 1.1]
[[hands]]
builtin = "left"
resolution = 1500
[[objects]]
builtin = "ball"
diameter = 0.065
[wrist]
elevation = [-60, 60]
gap = [0.0, 0.02]
[measuring]
penetration = 0.001
"""


@pytest.fixture
def experiment(tmp_path: Path) -> GraspExperiment:
    (tmp_path / "plan.toml").write_text(PLAN)
    return GraspExperiment(load_plan(tmp_path / "plan.toml"))


def test_a_trial_ends_alone_as_beside_others(experiment) -> None:
    assert isinstance(experiment, BatchedExperiment)
    trials = [k for k in range(experiment.trials) if experiment.alike(k) == experiment.alike(1)][:3]
    alone = {k: experiment.run(k, generator(experiment.seed, k)) for k in trials}
    experiment.look_ahead(trials)
    assert len(experiment._ahead) == len(trials)
    for k in reversed(trials):
        beside = experiment.run(k, generator(experiment.seed, k))
        assert (beside.status, beside.message, beside.values) == (alone[k].status, alone[k].message, alone[k].values)
        assert beside.arrays.keys() == alone[k].arrays.keys()
        for name, array in beside.arrays.items():
            assert array.tobytes() == alone[k].arrays[name].tobytes(), name
    assert not experiment._ahead


def test_blocks_hold_what_is_alike_and_every_trial_once(experiment, tmp_path: Path) -> None:
    work = TrialWork(experiment, tmp_path)
    blocks = work.blocks(range(5, 40), 2)
    assert sorted(k for block in blocks for k in block) == list(range(5, 40))
    assert all(len({experiment.alike(k) for k in block}) == 1 for block in blocks)
    assert max(map(len, blocks)) == 4
    assert work.blocks([7, 9], 2) == [[7], [9]]


def test_what_fails_ahead_fails_alone(experiment, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("no")

    monkeypatch.setattr(GraspExperiment, "_closed", broken)
    experiment.look_ahead([1, 3])
    assert not experiment._ahead
    with pytest.raises(RuntimeError):
        experiment.run(1, np.random.default_rng(0))
