"""What it means when a flying process dies: once more alone, then a finding."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pytest_garl.scenarios.maps import load_map
from pytest_garl.search.child import ALONE_FACTOR
from pytest_garl.search.job import broken_result, loads
from pytest_garl.search.ledger import Claim, Ledger


@dataclass(frozen=True, slots=True, kw_only=True)
class Death:
    """How a process ended: its exit status (a signal's negative), its last words on either way.

    ``words`` is what its watchdog wrote, ``complaint`` what was said on stderr.
    """

    status: int
    words: str
    complaint: str

    @property
    def hung(self) -> bool:
        """Whether its own watchdog ended it, because a call took too long."""
        return self.words.startswith("Timeout")


def settle(ledger: Ledger, claim: Claim, death: Death) -> None:
    """Decide what a death means for the slot that was in flight."""
    if claim.attempt == 1:
        # A slow machine, or its lack of memory, is no violation: once more, alone.
        ledger.fly_alone(claim, "hung" if death.hung else "died")
        ledger.count("retried")
    else:
        ledger.record(claim, _finding(claim, death), "", 0.0)


def _finding(claim: Claim, death: Death) -> dict[str, Any]:
    job = loads(claim.job)
    diagonal = load_map(job.map, tuple(Path(folder) for folder in job.map_folders)).diagonal_m
    if death.hung:
        limit_s = ALONE_FACTOR * job.timeout_s
        text = f"one call took longer than {limit_s:g} s of wall time, twice"
        return broken_result("hung", "Timeout", text, death.words, diagonal)
    how = f"signal {-death.status}" if death.status < 0 else f"exit status {death.status}"
    text = f"its process ended with {how}, twice"
    return broken_result("died", how.replace(" ", "-"), text, death.complaint, diagonal)
