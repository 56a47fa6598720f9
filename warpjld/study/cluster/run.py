"""Trials on a Ray cluster: machines compute, this one alone writes."""

from __future__ import annotations

import os
import socket
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from warpjld.errors import InputError, MissingExtraError, WarpjldError
from warpjld.runtime.processes import LIVES
from warpjld.runtime.threads import cores
from warpjld.study.cluster.inputs import sent_inputs
from warpjld.study.cluster.node import ping
from warpjld.study.cluster.nodes import ClusterNode, LostNodeError, LostWorkerError, Nodes, differing
from warpjld.study.experiment import Experiment
from warpjld.study.pool import TrialWork
from warpjld.study.shards import Shard, Shards

__all__ = ["run_on_ray"]

_AHEAD = 2  # trials handed out for each processor of a machine
_LOOK = 1.0  # seconds of waiting at a time
_JOINS = 5.0  # seconds between looks for new machines
_PATIENCE = 60.0  # seconds that a study waits for a machine when none is left
_CANARIES = 3
_CONNECTS = 10.0  # seconds that a cluster's head has to answer
_STORE = 200_000_000  # bytes of Ray's store on this machine: trials are small


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
    """Run trials on the machines of a cluster and keep each in ``folder`` as soon as it ends.

    A machine takes part when its versions are this one's and three canary trials give there, bit for bit, what is kept
    already or what the first machine gave. A trial that ends its worker is run again when nothing else runs, twice at
    most; then it becomes a row with status "crashed". A machine that goes away costs no trial anything.

    Args:
        experiment: What to repeat.
        trials: Numbers of the trials to run.
        folder: Where `Shards` are kept.
        address: Of the cluster, or ``local`` for workers on this machine. Ray that this process has started already is
            used as it is.
        processes: Trials at once; as many as there are processors by default.
        allow_mixed: Take machines whose bits differ.
        done: Called with every finished trial and its status.
        note: Called with what is worth knowing.

    Returns:
        The machines, for the manifest.

    Raises:
        MissingExtraError: Ray is not installed.
        InputError: There is no cluster at the address, or versions differ: names the machine.
        WarpjldError: No machine is left, or a trial cannot be run or kept.
    """
    with _connected(address, processes):
        import ray

        held = ray.put(experiment)
        nodes = Nodes(uuid.uuid4().hex, held, sent_inputs(experiment.inputs(), ray.put))
        study = _Study(experiment, deque(trials), folder, nodes, processes, allow_mixed, done, note)
        study.run()
        return {"address": address, "ray": ray.__version__, "nodes": [node.about() for node in nodes.all.values()]}


@contextmanager
def _connected(address: str, processes: int | None) -> Iterator[None]:
    """Ray, started here or connected to; what runs in this process already stays as it is."""
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError:
        raise MissingExtraError("a study on a cluster", "ray") from None
    if ray.is_initialized():
        yield
        return
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    try:
        if address == "local":
            own = {"num_cpus": processes or cores(), "object_store_memory": _STORE, "include_dashboard": False}
            ray.init(address="local", **own, **quiet)
        else:
            _listens(address)
            ray.init(address=address, **quiet)
    except (ConnectionError, ValueError, RuntimeError, OSError) as error:
        said = str(error).strip().splitlines() or [type(error).__name__]
        raise InputError(f"no Ray cluster at '{address}': {said[0]}") from None
    try:
        yield
    finally:
        ray.shutdown()


def _listens(address: str) -> None:
    """Raise OSError or ValueError where nothing listens; Ray itself waits for minutes."""
    if address == "auto":
        return
    host, colon, port = address.rpartition(":")
    if "://" in address or not colon or not port.isdecimal():
        raise ValueError("want HOST:PORT of its head, as ray start says it, or auto, or local")
    socket.create_connection((host.strip("[]"), int(port)), timeout=_CONNECTS).close()


class _Study:
    """A run of trials over machines; see ``run_on_ray``."""

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
        """Machines that came meanwhile."""
        if time.monotonic() - self._looked < _JOINS:
            return
        self._looked = time.monotonic()
        for node in self._nodes.new():
            if differs := differing(node, self._own):
                self._refuse(node, f"has other versions: {differs}")
            else:
                self._try(node)

    def _try(self, node: ClusterNode) -> None:
        """Canary trials on a machine: they are kept where they were missing, and compared where they were not."""
        count = self._experiment.trials
        for trial in sorted({k * count // _CANARIES for k in range(_CANARIES)}):
            try:
                content = self._nodes.result(self._nodes.submit(trial, node), node)
            except LostWorkerError:
                continue  # it is tried again, as every trial is
            except LostNodeError:
                self._refuse(node, "went away")
                return
            kept = self._shards.read(trial)
            if kept is None:
                self._keep(trial, content, node)
                if trial in self._waiting:
                    self._waiting.remove(trial)
            elif kept.results() != Shard.unpacked(content).results():
                said = f"trial {trial} gives other bits than elsewhere"
                if not self._allow_mixed:
                    self._refuse(node, said)
                    return
                node.why = said
                self._note(f"{node}: {said}; it takes part all the same")

    def _refuse(self, node: ClusterNode, why: str) -> None:
        node.used, node.why = False, why
        self._note(f"{node} is not used: {why}")

    def _hand_out(self) -> None:
        """As much as machines can take."""
        alive = self._usable()
        room = self._most * _AHEAD if self._most else sum(_AHEAD * node.cpus for node in alive)
        while self._waiting and len(self._out) < room:
            node = min(alive, key=lambda one: one.busy / one.cpus)
            if node.busy >= _AHEAD * node.cpus:
                return
            trial = self._waiting.popleft()
            self._out[self._nodes.submit(trial, node)] = (trial, node)
            node.busy += 1

    def _usable(self) -> list[ClusterNode]:
        """Machines that take trials; waits for one where none is left."""
        began = time.monotonic()
        while not (alive := self._nodes.alive()):
            if not any(node.used for node in self._nodes.all.values()) or time.monotonic() - began > _PATIENCE:
                told = "; ".join(f"{node}: {node.why}" for node in self._nodes.all.values() if node.why)
                raise WarpjldError(f"no machine of the cluster is left to run trials on{'; ' + told if told else ''}")
            time.sleep(_LOOK)
            self._join()
        return alive

    def _take_in(self) -> None:
        """What has ended."""
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
        """A trial that may have ended its worker, when nothing else runs."""
        lives = LIVES
        while lives:
            node = min(self._usable(), key=lambda one: one.trials)
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
