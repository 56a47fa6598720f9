"""The machines of a cluster: which there are, whether they compute the same, and trials handed to them."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, field
from typing import Any

from warpjld.errors import WarpjldError
from warpjld.runtime.processes import THREAD_VARIABLES
from warpjld.study.cluster.node import MATCHING, Sent, ping, trial_bytes

__all__ = ["ClusterNode", "LostNodeError", "LostWorkerError", "Nodes", "differing"]

_ANSWER = 120.0  # seconds that a machine has to start a worker and answer
_STILL_THERE = 15.0  # likewise, where one has just lost a worker
_MISSED = 60.0  # seconds within which Ray misses a machine that is gone


class LostWorkerError(Exception):
    """A trial ended its worker."""


class LostNodeError(Exception):
    """The machine went away, which is no fault of the trial."""


@dataclass
class ClusterNode:
    """One machine.

    Attributes:
        key: Ray's name of it.
        host: Its own name.
        cpus: Trials it takes at once.
        cpu: Model of its processor.
        versions: Of what computes there.
        used: Whether it is given trials.
        why: Why not.
        trials: How many it has done.
        busy: How many it has been handed and not given back.
    """

    key: str
    host: str
    cpus: int
    cpu: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    used: bool = True
    why: str = ""
    trials: int = 0
    busy: int = 0

    def __str__(self) -> str:
        return f"{self.host} ({self.key[:8]}{', ' + self.cpu if self.cpu else ''})"

    def about(self) -> dict[str, Any]:
        """For the manifest."""
        return {name: value for name, value in asdict(self).items() if name != "busy"}


class Nodes:
    """Machines of the cluster that Ray is connected to.

    Args:
        key: Of the experiment.
        held: Reference of the experiment.
        sent: Its inputs.
    """

    def __init__(self, key: str, held: Any, sent: tuple[Sent, ...]) -> None:
        import ray

        variables = dict.fromkeys(THREAD_VARIABLES, "1")
        how = {"num_cpus": 1, "max_retries": 0, "runtime_env": {"env_vars": variables}}
        self._trial, self._ping = ray.remote(**how)(trial_bytes), ray.remote(**how)(ping)
        self._arguments = (key, [held], sent)
        self.all: dict[str, ClusterNode] = {}

    def new(self) -> list[ClusterNode]:
        """Machines that were not there before; they are known from now on, and have answered a ping."""
        import ray

        found = [one for one in ray.nodes() if one["Alive"] and one["NodeID"] not in self.all]
        nodes = [
            ClusterNode(one["NodeID"], one["NodeManagerHostname"], int(one["Resources"].get("CPU", 0.0)))
            for one in found
        ]
        nodes = sorted((node for node in nodes if node.cpus > 0), key=lambda node: node.key != self._own())
        asked = [(node, self._on(self._ping, node).remote()) for node in nodes]
        for node, answer in asked:
            said = self._answer(answer, node, _ANSWER)
            node.cpu, node.versions = said["cpu"], {**said["versions"], "python": said["python"]}
            self.all[node.key] = node
        return nodes

    def alive(self) -> list[ClusterNode]:
        """Machines that take trials."""
        import ray

        there = {one["NodeID"] for one in ray.nodes() if one["Alive"]}
        return [node for node in self.all.values() if node.used and node.key in there]

    def submit(self, trial: int, node: ClusterNode) -> Any:
        """Hand a trial to a machine; returns the reference of its bytes."""
        return self._on(self._trial, node).remote(*self._arguments, trial)

    def result(self, reference: Any, node: ClusterNode) -> bytes:
        """Bytes of a trial, waited for.

        Raises:
            LostWorkerError: The trial ended its worker.
            LostNodeError: The machine is gone.
            WarpjldError: The trial could not even begin there.
        """
        import ray
        import ray.exceptions as lost

        try:
            content: bytes = ray.get(reference)
        except lost.RayTaskError as error:
            raise WarpjldError(f"a trial cannot be run on {node}: {_first_line(error.cause)}") from error
        except (lost.WorkerCrashedError, lost.OutOfMemoryError) as error:
            if self._lives(node):
                raise LostWorkerError from error
            raise LostNodeError from error
        except lost.RuntimeEnvSetupError as error:
            raise WarpjldError(f"{node} cannot set up its workers: {_first_line(error)}") from error
        except lost.RayError as error:
            raise LostNodeError from error
        return content

    def _lives(self, node: ClusterNode) -> bool:
        """Whether a machine that has just lost a worker is there: it answers, or Ray still has not missed it."""
        import ray

        began = time.monotonic()
        while time.monotonic() - began < _MISSED:
            try:
                self._answer(self._on(self._ping, node).remote(), node, _STILL_THERE)
            except WarpjldError:
                if all(one["NodeID"] != node.key or not one["Alive"] for one in ray.nodes()):
                    return False
            else:
                return True
        return True

    def _answer(self, reference: Any, node: ClusterNode, patience: float) -> dict[str, Any]:
        import ray

        try:
            said: dict[str, Any] = ray.get(reference, timeout=patience)
        except ray.exceptions.RayError as error:
            raise WarpjldError(f"{node} does not answer as warpjld does: {_first_line(error)}") from error
        return said

    @staticmethod
    def _own() -> str:
        import ray

        return str(ray.get_runtime_context().get_node_id())

    @staticmethod
    def _on(remote: Any, node: ClusterNode) -> Any:
        from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

        return remote.options(scheduling_strategy=NodeAffinitySchedulingStrategy(node_id=node.key, soft=False))


def _first_line(error: object) -> str:
    text = str(error).strip().splitlines()
    return text[-1][:200] if text else type(error).__name__


def differing(node: ClusterNode, own: dict[str, Any]) -> str:
    """Versions of a machine that are not this one's, as words; "" where none."""
    return ", ".join(
        f"{name} {node.versions.get(name)} there, {own.get(name)} here"
        for name in MATCHING
        if node.versions.get(name) != own.get(name)
    )
