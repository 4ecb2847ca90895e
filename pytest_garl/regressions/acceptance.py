"""Accepted cases: those in git's index, and those that `garl cases accept` has marked."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.regressions.case import Case


@dataclass(frozen=True, slots=True, kw_only=True)
class Acceptance:
    """The files of a folder that git knows; ``problem`` says why git could not be asked."""

    cases: Path
    committed: frozenset[str]
    problem: str = ""

    def accepts(self, path: Path, case: Case) -> bool:
        """Return whether a case is accepted, so that its failure is expected."""
        return case.accepted or path.relative_to(self.cases).as_posix() in self.committed


def read_acceptance(cases: Path) -> Acceptance:
    """Ask git which files of a folder are in its index."""
    if not cases.is_dir():
        return Acceptance(cases=cases, committed=frozenset())
    command = ["git", "-C", str(cases), "ls-files", "-z"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        return Acceptance(cases=cases, committed=frozenset(), problem=f"git: {error.strerror}")
    if done.returncode:
        problem = done.stderr.strip().partition("\n")[0]
        return Acceptance(cases=cases, committed=frozenset(), problem=problem)
    return Acceptance(cases=cases, committed=frozenset(done.stdout.split("\0")[:-1]))
