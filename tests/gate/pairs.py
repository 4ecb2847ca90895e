"""Pairs of flights that no test flies, and the gate's answer to them."""

from __future__ import annotations

from pytest_garl.gate.comparison import Comparison, compare
from pytest_garl.gate.pairs import FlightSummary, Pair

LANDED = FlightSummary(outcome="landed", signature="")
ABORTED = FlightSummary(outcome="gave_up", signature="", no_landing="blocked")
NEEDLESS = FlightSummary(
    outcome="gave_up", signature="II:gave-up-in-sight:descent", no_landing="needless"
)
DOG = FlightSummary(outcome="collision", signature="IV:dog:descent:seen", paper_violation=True)
CAT = FlightSummary(outcome="collision", signature="IV:cat:descent:seen", paper_violation=True)
LOST = FlightSummary(outcome="not_landed", signature="II:lost:descent", paper_violation=True)
UNSURE = FlightSummary(outcome="inconclusive", signature="")
SAME = FlightSummary(outcome="landed", signature="", sha256="ab" * 32)
Counted = tuple[int, FlightSummary, FlightSummary]


def pairs_of(*counted: Counted) -> list[Pair]:
    counted_pairs = [(base, head) for count, base, head in counted for _ in range(count)]
    return [
        Pair(name=f"lawn-{index}", base=base, head=head)
        for index, (base, head) in enumerate(counted_pairs)
    ]


def gate(
    *counted: Counted,
    level: float = 0.05,
    expected_signatures: tuple[str, ...] = (),
    beside: tuple[FlightSummary, ...] = (),
) -> Comparison:
    """Compare pairs; ``beside`` are the neighbours of each whose neighbours are asked for."""
    pairs = pairs_of(*counted)
    asked = compare(pairs, level=level, expected_signatures=expected_signatures).pairs_to_confirm
    neighbours = {pair.name: beside for pair in asked} if beside else {}
    return compare(
        pairs, level=level, expected_signatures=expected_signatures, neighbours=neighbours
    )
