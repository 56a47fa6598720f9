"""Machines of a Ray cluster: discovery, version comparison, submission of trials, loss of workers and machines."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from warpjld.errors import WarpjldError
from warpjld.study.cluster.node import MATCHING, Sent, ping, sources, trial_bytes

__all__ = ["ClusterNode", "LostNodeError", "LostWorkerError", "Nodes", "differing"]

_ANSWER = 120.0  # time for a machine to start a worker and answer [s]
_STILL_THERE = 15.0  # the same after it has lost a worker [s]
_MISSED = 60.0  # time within which Ray notices that a machine is gone [s]


class LostWorkerError(Exception):
    """A worker process died while it ran a trial."""


class LostNodeError(Exception):
    """A machine left the cluster while it ran a trial."""


@dataclass
class ClusterNode:
    """One machine of the cluster.

    Attributes:
        key: Ray's node id.
        host: Host name.
        cpus: Number of trials it runs at once.
        cpu: Model of its processor.
        versions: Versions of the packages in ``MATCHING``.
        used: Whether it is given trials.
        why: Why it is not, or what was noted about it.
        trials: Number of trials it has done.
        busy: Number of trials submitted and not yet returned.
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
        """Its description in the manifest."""
        return {name: value for name, value in asdict(self).items() if name != "busy"}


class Nodes:
    """Machines of the cluster that Ray is connected to.

    Args:
        key: Key of the experiment.
        held: Reference of the experiment in the object store.
        sent: Its input files.
        environment: Options of tasks that set their environment; see ``connected``.
    """

    def __init__(self, key: str, held: Any, sent: tuple[Sent, ...], environment: Mapping[str, Any]) -> None:
        import ray

        how = {"num_cpus": 1, "max_retries": 0, **environment}
        self._trial, self._ping = ray.remote(**how)(trial_bytes), ray.remote(**how)(ping)
        self._arguments = (key, sources(), [held], sent)
        self.all: dict[str, ClusterNode] = {}

    def new(self) -> list[ClusterNode]:
        """Machines that joined since the last call and have answered a ping."""
        import ray

        found = [info for info in ray.nodes() if info["Alive"] and info["NodeID"] not in self.all]
        nodes = [
            ClusterNode(info["NodeID"], info["NodeManagerHostname"], int(info["Resources"].get("CPU", 0.0)))
            for info in found
        ]
        nodes = sorted((node for node in nodes if node.cpus > 0), key=lambda node: node.key != self._own())
        asked = [(node, self._on(self._ping, node).remote()) for node in nodes]
        for node, answer in asked:
            about = self._answer(answer, node, _ANSWER)
            node.cpu, node.versions = about["cpu"], {**about["versions"], "python": about["python"]}
            self.all[node.key] = node
        return nodes

    def alive(self) -> list[ClusterNode]:
        """Machines that can be given trials."""
        import ray

        there = {info["NodeID"] for info in ray.nodes() if info["Alive"]}
        return [node for node in self.all.values() if node.used and node.key in there]

    def submit(self, trial: int, node: ClusterNode) -> Any:
        """Submit a trial to a machine; the reference of its packed shard."""
        return self._on(self._trial, node).remote(*self._arguments, trial)

    def result(self, reference: Any, node: ClusterNode) -> bytes:
        """Wait for a trial; its packed shard.

        Raises:
            LostWorkerError: Its worker died.
            LostNodeError: The machine is gone.
            WarpjldError: The trial could not be started there.
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
        """Whether a machine that has just lost a worker is alive: it answers, or Ray has not reported it gone."""
        import ray

        began = time.monotonic()
        while time.monotonic() - began < _MISSED:
            try:
                self._answer(self._on(self._ping, node).remote(), node, _STILL_THERE)
            except WarpjldError:
                if all(info["NodeID"] != node.key or not info["Alive"] for info in ray.nodes()):
                    return False
            else:
                return True
        return True

    def _answer(self, reference: Any, node: ClusterNode, patience: float) -> dict[str, Any]:
        import ray

        try:
            about: dict[str, Any] = ray.get(reference, timeout=patience)
        except ray.exceptions.RayError as error:
            raise WarpjldError(f"{node} does not answer as warpjld does: {_first_line(error)}") from error
        return about

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
    """Text about versions in which a machine differs from this one; empty if there are none."""
    return ", ".join(
        f"{name} {node.versions.get(name)} there, {own.get(name)} here"
        for name in MATCHING
        if node.versions.get(name) != own.get(name)
    )
