"""Connection to Ray: a session that exists, a cluster's, or one of this machine alone."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from warpjld.errors import InputError, MissingExtraError
from warpjld.runtime.processes import THREAD_VARIABLES
from warpjld.runtime.threads import cores

__all__ = ["connected"]

_CONNECTS = 10.0  # time for the cluster's head to answer [s]
_STORE = 200_000_000  # size of Ray's object store on this machine [bytes]; trials are small
_ONE_THREAD = dict.fromkeys(THREAD_VARIABLES, "1")

_NICENESS = "RAY_worker_niceness"  # by how much Ray's workers stand back; those of one machine are the work itself

_inheriting = False  # whether the session is one of ``connected``, whose workers inherited the variables


@contextmanager
def connected(address: str, processes: int | None = None) -> Iterator[dict[str, Any]]:
    """Context with a Ray connection: one that exists already, a new one to a cluster, or one of this machine.

    Workers of a new session of this machine inherit the variables that bound libraries to one thread, and have the
    priority of this process. Those of others are given the variables by a runtime environment, for which Ray starts
    each worker anew.

    Args:
        address: Address of the cluster, or ``local``.
        processes: Workers of this machine; by default one a processor.

    Yields:
        Options of tasks: the runtime environment, if they need one.

    Raises:
        MissingExtraError: Ray is not installed.
        InputError: There is no cluster at the address.
    """
    global _inheriting
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError:
        raise MissingExtraError("a study on a cluster", "ray") from None
    given = {"runtime_env": {"env_vars": _ONE_THREAD}}
    if ray.is_initialized():
        yield {} if _inheriting else given
        return
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    local = address == "local"
    try:
        if local:
            own = {"num_cpus": processes or cores(), "object_store_memory": _STORE, "include_dashboard": False}
            with _variables({**_ONE_THREAD, _NICENESS: os.environ.get(_NICENESS, "0")}):
                ray.init(address="local", **own, **quiet)
        else:
            _listens(address)
            ray.init(address=address, **quiet)
    except (ConnectionError, ValueError, RuntimeError, OSError) as error:
        lines = str(error).strip().splitlines() or [type(error).__name__]
        raise InputError(f"no Ray cluster at '{address}': {lines[0]}") from None
    _inheriting = local
    try:
        yield {} if local else given
    finally:
        _inheriting = False
        ray.shutdown()


@contextmanager
def _variables(wanted: Mapping[str, str]) -> Iterator[None]:
    """Environment variables for processes that are started within."""
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _listens(address: str) -> None:
    """Check that something listens at the address, since Ray itself would wait for minutes.

    Raises:
        OSError: Nothing listens there.
        ValueError: Not an address.
    """
    if address == "auto":
        return
    host, colon, port = address.rpartition(":")
    if "://" in address or not colon or not port.isdecimal():
        raise ValueError("want HOST:PORT of its head, as ray start says it, or auto, or local")
    socket.create_connection((host.strip("[]"), int(port)), timeout=_CONNECTS).close()
