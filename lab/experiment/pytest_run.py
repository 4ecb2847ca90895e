"""One run of an experiment: a pytest session in a process of its own."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO

from lab.experiment.spec import ExperimentRun
from pytest_garl.errors import ExperimentError, LedgerError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.processes import end_with_parent

LAST_LINES = 15
"""Number of lines of a failed session's output in the error."""
_SEARCHED = (0, 1)
"""Exit statuses of a completed session: 1 means failing tests, that is, violations."""


def run_pytest(run: ExperimentRun, folder: Path, workers: int) -> Path:
    """Fly the searches of a run, or continue them; return the path of the ledger.

    ``folder`` takes the ledger, the flights and the session's output, which shows its progress.
    After a KeyboardInterrupt the session ends in order before the exception is raised again.
    """
    ledger, log = folder / "ledger.sqlite", folder / "pytest.log"
    folder.mkdir(parents=True, exist_ok=True)
    with log.open("wb") as output, _session(_command(run, folder, workers), output) as session:
        session.wait()
    if session.returncode not in _SEARCHED:
        lines = log.read_text(errors="replace").strip().splitlines()
        raise ExperimentError(
            "\n".join(
                [
                    f"{run.title}: pytest ended with status {session.returncode}; its output is in "
                    f"{log} and ends with:",
                    *(f"    {line}" for line in lines[-LAST_LINES:]),
                    "Fix that and run the same command to continue. If something has changed since "
                    f"the run began, remove {folder} to fly it anew.",
                ]
            )
        )
    return ledger


def _command(run: ExperimentRun, folder: Path, workers: int) -> list[str]:
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--tb=no", "-r", ""]
    words += [
        f"--garl-budget={run.budget}",
        f"--garl-method={run.search_method}",
        f"--garl-seed={run.seed}",
        f"--garl-map={','.join(run.maps)}",
        f"--garl-workers={workers}",
        f"--garl-domain={run.domain}",
        "--garl-shrink=0",
        "-o",
        f"garl_dir={folder.resolve()}",
        "-o",
        # Saved cases do not belong to the experiment.
        f"garl_cases={folder.resolve() / 'no-cases'}",
        "-o",
        "garl_probes=never",
        run.tests,
    ]
    if run.population:
        words.append(f"--garl-population={run.population}")
    if run.npcs:
        words.append(f"--garl-npcs={run.npcs}")
    return [*words, "--garl-resume"] if _has_ledger(folder / "ledger.sqlite") else words


@contextmanager
def _session(command: Sequence[str], output: IO[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    session = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=output,
        stderr=subprocess.STDOUT,
        # The terminal must not send Ctrl-C too: it is passed on once, below.
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


def _has_ledger(ledger: Path) -> bool:
    """Return whether there is a ledger to continue; an incomplete one does not count."""
    if not ledger.is_file():
        return False
    with contextlib.suppress(LedgerError), closing(Ledger(ledger)) as opened:
        return opened.facts.ledger_version is not None
    return False
