"""One run of an experiment: a pytest session in a process of its own."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO

from pytest_garl.errors import ExperimentError, LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queries import SearchProgress
from pytest_garl.execution.processes import end_with_parent
from pytest_garl.experiments.spec import Run

PROGRESS_EVERY_S = 0.5
"""Time between two looks at the ledger of a running session."""
LAST_LINES = 15
"""So much of a failed session's output is shown."""
_SEARCHED = (0, 1)
"""Exit statuses of a session that went to its end: violations are failing tests."""


def search(
    run: Run, folder: Path, workers: int, tick: Callable[[Sequence[SearchProgress]], None]
) -> Path:
    """Fly a run's searches, or go on with them; return the ledger.

    ``folder`` takes the ledger, the flights and the session's output; ``tick`` is told how far it
    is.  Interrupted, the session ends in order before the KeyboardInterrupt goes on.
    """
    ledger, log = folder / "ledger.sqlite", folder / "pytest.log"
    folder.mkdir(parents=True, exist_ok=True)
    with log.open("wb") as output, _session(_command(run, folder, workers), output) as session:
        while session.poll() is None:
            tick(_progress(ledger))
            with contextlib.suppress(subprocess.TimeoutExpired):
                session.wait(PROGRESS_EVERY_S)
    if session.returncode not in _SEARCHED:
        lines = log.read_text(errors="replace").strip().splitlines()
        raise ExperimentError(
            "\n".join(
                [
                    f"{run.title}: pytest ended with status {session.returncode}; its output is in "
                    f"{log} and ends with:",
                    *(f"    {line}" for line in lines[-LAST_LINES:]),
                    "Mend that, and the same command goes on. Where something has changed since "
                    f"the run began, remove {folder} to fly it anew.",
                ]
            )
        )
    return ledger


def _command(run: Run, folder: Path, workers: int) -> list[str]:
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--tb=no", "-r", ""]
    words += [
        f"--garl-budget={run.budget}",
        f"--garl-method={run.search}",
        f"--garl-seed={run.seed}",
        f"--garl-map={','.join(run.maps)}",
        f"--garl-workers={workers}",
        "--garl-shrink=0",
        "-o",
        f"garl_dir={folder.resolve()}",
        "-o",
        # Saved cases are none of the experiment's flights.
        f"garl_cases={folder.resolve() / 'no-cases'}",
        run.tests,
    ]
    if run.npcs:
        words.append(f"--garl-npcs={run.npcs}")
    return [*words, "--garl-resume"] if _begun(folder / "ledger.sqlite") else words


@contextmanager
def _session(command: Sequence[str], output: IO[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    session = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        # Ctrl-C is passed on once, below, and not by the terminal as well.
        start_new_session=True,
        preexec_fn=functools.partial(end_with_parent, os.getpid()),
    )
    try:
        yield session
    except KeyboardInterrupt:
        session.send_signal(signal.SIGINT)
        session.wait()
        raise
    finally:
        if session.poll() is None:
            session.kill()
            session.wait()


def _begun(ledger: Path) -> bool:
    """Whether there is a ledger to go on with; one that was killed while it was made is none."""
    if not ledger.is_file():
        return False
    with contextlib.suppress(LedgerError), closing(Ledger(ledger)) as opened:
        return opened.fact("ledger") is not None
    return False


def _progress(ledger: Path) -> Sequence[SearchProgress]:
    """Return how far the searches are; nothing while the ledger is being made."""
    if ledger.is_file():
        with contextlib.suppress(LedgerError), closing(Ledger(ledger)) as opened:
            return opened.queries.progress()
    return ()
