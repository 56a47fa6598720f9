"""Scheduling of trials on a Ray cluster; only the driver writes results."""

from __future__ import annotations

import time
import uuid
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from warpjld.errors import InputError, WarpjldError
from warpjld.runtime.processes import LIVES
from warpjld.study.cluster.inputs import sent_inputs
from warpjld.study.cluster.node import ping
from warpjld.study.cluster.nodes import ClusterNode, LostNodeError, LostWorkerError, Nodes, differing
from warpjld.study.cluster.session import connected
from warpjld.study.experiment import Experiment
from warpjld.study.pool import TrialWork
from warpjld.study.shards import Shard, Shards

__all__ = ["run_on_ray"]

_AHEAD = 2  # trials submitted per processor of a machine
_LOOK = 1.0  # longest wait for a result before other work is looked at [s]
_JOINS = 5.0  # interval between looks for new machines [s]
_PATIENCE = 60.0  # time to wait for a machine when none is left [s]
_CANARIES = 3  # trials by which a new machine is compared with the others


def run_on_ray(
    experiment: Experiment,
    trials: Sequence[int],
    folder: Path,
    *,
    address: str,
    processes: int | None = None,
    allow_mixed: bool = False,
    done: Callable[[int, str], None],
    note: Callable[[str], None],
) -> dict[str, Any]:
    """Run trials on the machines of a cluster and write each to ``folder`` as soon as it ends.

    A machine is used if its versions are the same as here, and three canary trials give, bit for bit, the results that
    are on disk or that the first machine gave. A trial whose worker dies is run again when nothing else runs, at most
    twice; then it becomes a row with status "crashed". Trials of a machine that leaves the cluster are run elsewhere.

    Args:
        experiment: The experiment.
        trials: Numbers of the trials to run.
        folder: Folder of the `Shards`.
        address: Address of the cluster, or ``local`` for workers on this machine. A Ray session that this process has
            started already is used as it is.
        processes: Number of trials at once; by default one per processor.
        allow_mixed: Also use machines whose results differ in bits.
        done: Called with every finished trial and its status.
        note: Called with messages for the user.

    Returns:
        Description of the machines, for the manifest.

    Raises:
        MissingExtraError: Ray is not installed.
        InputError: There is no cluster at the address, or versions differ: names the machine.
        WarpjldError: No machine is left, or a trial cannot be run or written.
    """
    with connected(address, processes) as environment:
        import ray

        held = ray.put(experiment)
        nodes = Nodes(uuid.uuid4().hex, held, sent_inputs(experiment.inputs(), ray.put), environment)
        study = _Study(experiment, deque(trials), folder, nodes, processes, allow_mixed, done, note)
        study.run()
        return {"address": address, "ray": ray.__version__, "nodes": [node.about() for node in nodes.all.values()]}


class _Study:
    """State of a run of trials on a cluster; see ``run_on_ray``."""

    def __init__(
        self,
        experiment: Experiment,
        waiting: deque[int],
        folder: Path,
        nodes: Nodes,
        most: int | None,
        allow_mixed: bool,
        done: Callable[[int, str], None],
        note: Callable[[str], None],
    ) -> None:
        self._experiment, self._waiting, self._nodes, self._most = experiment, waiting, nodes, most
        self._shards, self._work = Shards(folder), TrialWork(experiment, folder)
        self._allow_mixed, self._done, self._note = allow_mixed, done, note
        self._out: dict[Any, tuple[int, ClusterNode]] = {}
        self._suspects: list[int] = []
        self._looked = 0.0
        self._own = ping()["versions"]

    def run(self) -> None:
        for node in self._nodes.new():
            if differs := differing(node, self._own):
                raise InputError(f"{node} has other versions: {differs}; install the same everywhere")
            self._try(node)
        while self._waiting or self._out:
            self._join()
            self._hand_out()
            self._take_in()
        for trial in self._suspects:
            self._alone(trial)

    def _join(self) -> None:
        """Admit machines that joined meanwhile."""
        if time.monotonic() - self._looked < _JOINS:
            return
        self._looked = time.monotonic()
        for node in self._nodes.new():
            if differs := differing(node, self._own):
                self._refuse(node, f"has other versions: {differs}")
            else:
                self._try(node)

    def _try(self, node: ClusterNode) -> None:
        """Run canary trials on a machine: compare results that are on disk already, write those that are not."""
        count = self._experiment.trials
        for trial in sorted({k * count // _CANARIES for k in range(_CANARIES)}):
            try:
                content = self._nodes.result(self._nodes.submit(trial, node), node)
            except LostWorkerError:
                continue  # it will be run again, as every trial
            except LostNodeError:
                self._refuse(node, "went away")
                return
            kept = self._shards.read(trial)
            if kept is None:
                self._keep(trial, content, node)
                if trial in self._waiting:
                    self._waiting.remove(trial)
            elif kept.results() != Shard.unpacked(content).results():
                finding = f"trial {trial} gives other bits than elsewhere"
                if not self._allow_mixed:
                    self._refuse(node, finding)
                    return
                node.why = finding
                self._note(f"{node}: {finding}; it is used nevertheless")

    def _refuse(self, node: ClusterNode, why: str) -> None:
        node.used, node.why = False, why
        self._note(f"{node} is not used: {why}")

    def _hand_out(self) -> None:
        """Submit as many trials as the machines can take."""
        alive = self._usable()
        room = self._most * _AHEAD if self._most else sum(_AHEAD * node.cpus for node in alive)
        while self._waiting and len(self._out) < room:
            node = min(alive, key=lambda candidate: candidate.busy / candidate.cpus)
            if node.busy >= _AHEAD * node.cpus:
                return
            trial = self._waiting.popleft()
            self._out[self._nodes.submit(trial, node)] = (trial, node)
            node.busy += 1

    def _usable(self) -> list[ClusterNode]:
        """Machines that can be given trials; waits for one if none is left.

        Raises:
            WarpjldError: None came within ``_PATIENCE``.
        """
        began = time.monotonic()
        while not (alive := self._nodes.alive()):
            if not any(node.used for node in self._nodes.all.values()) or time.monotonic() - began > _PATIENCE:
                reasons = "; ".join(f"{node}: {node.why}" for node in self._nodes.all.values() if node.why)
                raise WarpjldError(
                    f"no machine of the cluster is left to run trials on{'; ' + reasons if reasons else ''}"
                )
            time.sleep(_LOOK)
            self._join()
        return alive

    def _take_in(self) -> None:
        """Collect finished trials."""
        import ray

        ready, _ = ray.wait(list(self._out), num_returns=1, timeout=_LOOK) if self._out else ([], [])
        for reference in ready:
            trial, node = self._out.pop(reference)
            node.busy -= 1
            try:
                self._keep(trial, self._nodes.result(reference, node), node)
            except LostNodeError:
                self._waiting.appendleft(trial)
            except LostWorkerError:
                self._suspects.append(trial)

    def _alone(self, trial: int) -> None:
        """Run a trial whose worker died again, while nothing else runs."""
        lives = LIVES
        while lives:
            node = min(self._usable(), key=lambda candidate: candidate.trials)
            try:
                self._keep(trial, self._nodes.result(self._nodes.submit(trial, node), node), node)
            except LostNodeError:
                continue
            except LostWorkerError:
                lives -= 1
                continue
            return
        self._done(trial, self._work.bury(trial))

    def _keep(self, trial: int, content: bytes, node: ClusterNode) -> None:
        try:
            self._shards.put(trial, content)
        except OSError as error:
            raise WarpjldError(f"trial {trial} cannot be kept: {error}") from error
        node.trials += 1
        self._done(trial, str(Shard.unpacked(content).row["status"]))
