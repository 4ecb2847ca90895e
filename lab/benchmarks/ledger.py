"""The time of the ledger per flight, with a result of usual size: claim and record."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.result import FlightResult
from pytest_garl.verdicts.verdict import Margin, Verdict


def main(flights: int = 2000) -> None:
    """Print the mean time per flight."""
    result = FlightResult(
        outcome="landed",
        final_distance_m=1.0,
        elapsed_s=30.0,
        collisions=(),
        undecided="",
        closest_call="",
        closest_body="",
        verdict=Verdict(
            outcome="landed",
            primary=None,
            violation_type=None,
            signature="",
            paper_violation=False,
            margins=(Margin(property="time", value=1.0, unit="s"),) * 4,
            story="x" * 300,
        ),
        crash=None,
    )
    with tempfile.TemporaryDirectory() as folder:
        ledger = Ledger.create(Path(folder) / "ledger.sqlite", {})
        ledger.add_search("s", "system", "court", flights, "{}" * 500)
        ledger.add_slots("s", 0, dict.fromkeys(range(flights), "x" * 900))
        began = time.perf_counter()
        for _ in range(flights):
            claim = ledger.queue.claim()
            assert claim is not None
            ledger.queue.count("idle_s", 0.001)
            ledger.queue.record(claim, result, "0" * 64, 1.0)
        each = (time.perf_counter() - began) / flights
        print(f"ledger: {1e3 * each:.2f} ms per flight")


if __name__ == "__main__":
    main()
