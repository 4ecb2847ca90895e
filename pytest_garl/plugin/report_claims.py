"""Claims of items: which item reports a slot or a failure that several items find.

The claims are facts of the ledger, so that all processes of a session agree.  ``Ledger`` drops them
when a run is resumed, because its tests run again.
"""

from __future__ import annotations

from dataclasses import dataclass

from pytest_garl.execution.ledger import SESSION_FACT, Ledger
from pytest_garl.plugin.target import Target


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportClaims:
    """Lets an item claim a slot or a failure, and notes which items have run."""

    ledger: Ledger

    def claim_slot(self, target: Target, nodeid: str) -> bool:
        """Claim a slot for an item; return whether no other item claimed it earlier."""
        key = f"{SESSION_FACT}slot {target.search} {target.slot.id(target.map)}"
        return bool(self.ledger.first_fact(key, nodeid) == nodeid)

    def claim_failure(self, key: str, slot: str, nodeid: str) -> str:
        """Claim a failure for an item; return the slot of the item that claimed it earlier, if any.

        ``key`` identifies the failure in all processes.
        """
        first_slot, first_nodeid = self.ledger.first_fact(_failure_fact(key), [slot, nodeid])
        return "" if first_nodeid == nodeid else str(first_slot)

    def reporting_slot(self, key: str, nodeid: str) -> str:
        """Return the slot of another item that has claimed a failure; empty if there is none."""
        first = self.ledger.fact(_failure_fact(key))
        return str(first[0]) if first is not None and first[1] != nodeid else ""

    def note_ran(self, nodeid: str) -> None:
        """Note that a test has run; its claims are in the ledger by then."""
        self.ledger.note_fact(f"{SESSION_FACT}ran {nodeid}", value=True)

    def has_run(self, nodeid: str) -> bool:
        """Return whether a test has run in any process."""
        return bool(self.ledger.fact(f"{SESSION_FACT}ran {nodeid}"))


def _failure_fact(key: str) -> str:
    return f"{SESSION_FACT}failure {key}"
