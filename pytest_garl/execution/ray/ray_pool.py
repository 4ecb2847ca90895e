"""The Ray pool flies on a Ray cluster.  One child process, the driver, is connected to it."""

from __future__ import annotations

import importlib.util
import math
import re
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import PoolError
from pytest_garl.execution.ledger_queue import WorkQueue
from pytest_garl.execution.local_pool import ProcessPool
from pytest_garl.execution.pool import Pool
from pytest_garl.execution.worker_failure import WorkerExit

INSTALL_COMMAND = "pip install 'pytest-garl[ray]'"
CONNECT_TIMEOUT_S = 5.0
"""How long the head of a cluster may take to accept a connection."""


def ray_pool(queue: WorkQueue, workers: int | None, root: Path) -> Pool:
    """Return a pool that flies ``workers`` slots at a time; None means one for each CPU.

    If RAY_ADDRESS is set, it names the cluster, which gets a copy of the project at ``root``.  If
    not, the pool starts a cluster on this machine and ends it.
    """
    return ProcessPool(queue, RayDriver(workers=workers, root=root))


def check_ray(address: str) -> None:
    """Raise PoolError if Ray is not installed, or if nothing answers at ``address``."""
    if importlib.util.find_spec("ray") is None:
        raise PoolError(f"Ray is not installed; {INSTALL_COMMAND}, or fly without garl_pool=ray")
    endpoint = re.fullmatch(r"(?P<host>[^/]+):(?P<port>\d+)", address)
    if endpoint is None:
        # Only Ray can resolve "auto" and ray://…
        return
    try:
        socket.create_connection(
            (endpoint["host"], int(endpoint["port"])), CONNECT_TIMEOUT_S
        ).close()
    except (OSError, OverflowError) as error:
        raise PoolError(
            f"RAY_ADDRESS={address}: nobody answers there ({error}). Is the cluster up (`ray "
            "status`)? Expected the host and port of its head, such as 10.0.0.1:6379; without "
            "RAY_ADDRESS a cluster on this machine is started"
        ) from error


@dataclass(frozen=True, slots=True, kw_only=True)
class RayDriver:
    """The driver of Ray, one process for all pytest processes of a run.

    It claims slots and sends them to the cluster.  Ray's threads, signal handlers and warnings
    stay in the driver, outside pytest's process.
    """

    workers: int | None
    root: Path
    shutdown_s: float = 30.0
    """How long the driver may take to end; shutting down a cluster takes a second or two."""

    @property
    def max_workers(self) -> int:
        """One driver; it limits the number of flights itself."""
        return 1

    def command(self, ledger: Path) -> Sequence[str]:
        """Return the module that the driver runs, and its arguments."""
        return [
            "pytest_garl.execution.ray.driver",
            str(ledger),
            str(self.root),
            str(self.workers or 0),
        ]

    def silence_s(self, queue: WorkQueue, pid: int) -> float:
        """Return no limit: the driver runs no landing system, and does not beat."""
        return math.inf

    def handle_exit(self, queue: WorkQueue, pid: int, ended: WorkerExit) -> bool:
        """Release all slots: no landing system runs in the driver, so none caused its exit."""
        queue.release(pid)
        return False
