"""The driver of Ray: a child process of pytest that has a cluster fly the ledger's slots.

It is the only module that imports Ray, and it does so when it runs.
"""

from __future__ import annotations

import logging
import os
import secrets
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pytest_garl.errors import PoolError
from pytest_garl.execution.ledger_queue import WorkQueue
from pytest_garl.execution.processes import Parent, WorkerReport, run_worker
from pytest_garl.execution.ray.actor import ActorWorkspace
from pytest_garl.execution.ray.scheduler import RayScheduler
from pytest_garl.process_tree import any_command_contains

CONNECT_S = 180.0
"""How long Ray may take to connect and to upload the project; Ray itself has no limit."""
CLUSTER_SHUTDOWN_S = 10.0
"""How long the processes of a cluster started here may take to end."""
STORE_BYTES = 128 * 2**20
"""Object store of a cluster started here: it holds records of flights, about 100 kB each."""


def main(parent: Parent, ledger: str, root: str, workers: str) -> None:
    """Fly until the parent process ends; ``workers`` is 0 for all CPUs of the cluster."""
    # Ray sets a handler that does the same when it is connected.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(number))
    path = Path(ledger)
    address = os.environ.get("RAY_ADDRESS") or "local"
    if address == "local":
        cluster = own_cluster(int(workers))
    else:
        cluster = joined_cluster(address, Path(root), path.parent)
    with cluster as (ray, workspace, cpus):
        scheduler = RayScheduler(ray, WorkQueue.open(path), workspace, int(workers) or cpus)
        try:
            while parent.lives():
                scheduler.turn()
        finally:
            scheduler.close()


@contextmanager
def own_cluster(workers: int) -> Iterator[tuple[Any, ActorWorkspace, int]]:
    """Start a cluster on this machine that ends with the block.

    Yields Ray, the actors' folders and the number of CPUs; raises PoolError.
    """
    # A cluster listens on the network; the token keeps other clients out.
    os.environ.setdefault("RAY_AUTH_MODE", "token")
    os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))
    cpus = workers or os.cpu_count() or 1
    # Not in TMPDIR: a socket's path has 107 characters at most, and Ray's take 60.
    folder = tempfile.mkdtemp(prefix="garl-ray-", dir=os.environ.get("RAY_TMPDIR", "/tmp"))
    try:
        with _connected(
            "local",
            num_cpus=cpus,
            include_dashboard=False,
            object_store_memory=STORE_BYTES,
            _temp_dir=folder,
            # If memory is short, the kernel ends the largest process, the flight, as without Ray.
            _system_config={"memory_monitor_refresh_ms": 0},
        ) as ray:
            yield ray, ActorWorkspace(scratch=folder), cpus
    finally:
        _remove(folder)


def _remove(folder: str) -> None:
    """Remove a cluster's folder when no process writes there any more.

    The command lines of the cluster's processes contain the folder, and so does that of a worker in
    flight.  A worker ends soon after its actor, but would create the folder again for its record.
    """
    until = time.monotonic() + CLUSTER_SHUTDOWN_S
    while any_command_contains(folder) and time.monotonic() < until:
        time.sleep(0.05)
    shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def joined_cluster(
    address: str, root: Path, folder: Path
) -> Iterator[tuple[Any, ActorWorkspace, int]]:
    """Join a cluster for as long as the block lasts, and give it a copy of the project at ``root``.

    Files that git ignores are not copied, nor is ``folder``, which holds the flights.  Raises
    PoolError.
    """
    root, folder, here = root.resolve(), folder.resolve(), Path.cwd()
    excludes = [f"/{folder.relative_to(root)}"] if folder.is_relative_to(root) else []
    working_dir = str(here.relative_to(root)) if here.is_relative_to(root) else "."
    copied = {"working_dir": str(root), "excludes": excludes}
    with _connected(address, runtime_env=copied) as ray:
        cpus = int(ray.cluster_resources().get("CPU", 1))
        yield ray, ActorWorkspace(project=str(root), working_dir=working_dir), cpus


@contextmanager
def _connected(address: str, **options: Any) -> Iterator[Any]:
    timer = threading.Timer(CONNECT_S, _give_up, (address,))
    timer.daemon = True
    timer.start()
    import ray

    try:
        ray.init(address, log_to_driver=False, logging_level=logging.ERROR, **options)
    except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        raise PoolError(unreachable(address, str(error))) from error
    finally:
        timer.cancel()
    try:
        yield ray
    finally:
        ray.shutdown()


def unreachable(address: str, reason: str) -> str:
    """Return why there is no cluster, and what to do."""
    if address == "local":
        return f"Ray cannot start a cluster on this machine: {reason.strip()}"
    return (
        f"RAY_ADDRESS={address}: {reason.strip()}\nExpected the head of a cluster, such as "
        f"10.0.0.1:6379, of which this machine is a node, with Ray {version('ray')}, Python "
        f"{sys.version_info.major}.{sys.version_info.minor}, and the same RAY_AUTH_MODE and token "
        "as here"
    )


def _give_up(address: str) -> None:
    """End the process from a thread: the call of Ray does not return."""
    reason = unreachable(address, f"no cluster after {CONNECT_S:g} s")
    Parent.of_this_process().report(WorkerReport(cannot_go_on=reason))
    os._exit(1)


if __name__ == "__main__":
    run_worker(main, "the driver of Ray")
