"""A search in a ledger that is flown slot by slot, by an instant simulator with few violations."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.ledger_queue import Claim
from pytest_garl.execution.result import FlightResult
from pytest_garl.scenarios.files import dump_scenario, parse_scenario
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.simplification import empty_scenario
from tests.cases.samples import JOB, LAWN, case, violating_scenario
from tests.support.results import flight_result

NOTHING_UNUSUAL = empty_scenario(violating_scenario(), LAWN)
LIMITS = {"fog": 0.05, "rain": 0.07, "snow": 0.03, "road_wetness": 0.06}
"""Values of the environment above which a flight fails; the first of them names the signature."""


def corpus_of(*signatures: str, scenario: Scenario | None = None) -> Any:
    """Return what stands for the saved cases of these signatures.

    They have no cause, or that of a scenario.
    """
    found = [
        (
            SimpleNamespace(path=Path(f"{signature}.toml")),
            dataclasses.replace(case(signature), scenario=scenario or NOTHING_UNUSUAL),
        )
        for signature in signatures
    ]
    return SimpleNamespace(expected_cases=lambda system, map: found)


def scenario_of(seed: int, cause: str) -> Scenario:
    """Return a scenario that fails for a cause, or does not fail."""
    weather = {f"environment.{name}": 0.14 if name == cause else 0.0 for name in LIMITS}
    return violating_scenario(seed).replace(weather)


def result_of(scenario: Scenario) -> FlightResult:
    """Return the result of a flight."""
    for name, limit in LIMITS.items():
        if scenario[f"environment.{name}"] > limit:
            signature = f"off:of-{name}"
            return flight_result(
                signature, outcome="landed", primary="distance", violation_type="off"
            )
    return flight_result()


class RunningSearch:
    """A search whose generations are added and flown one after the other."""

    def __init__(self, ledger: Ledger, wanted: int = 24) -> None:
        self.ledger = ledger
        ledger.add_search("search", JOB.system.name, "lawn", wanted, JOB.dumps())

    def add_generation(self, generation: int, causes: Sequence[str]) -> None:
        """Add a generation with a slot for each cause of a violation; "" violates nothing."""
        texts = {
            slot: dump_scenario(scenario_of(100 * generation + slot, cause))
            for slot, cause in enumerate(causes)
        }
        self.ledger.add_slots("search", generation, texts)

    def scenario(self, generation: int, slot: int) -> Scenario:
        """Return the scenario of a slot."""
        text = self.ledger.scenario(self._id(generation, slot))
        assert text is not None
        return parse_scenario(text)

    def fly(self, *slots: tuple[int, int]) -> None:
        """Record the results of slots, which are generation and index, in this order."""
        claims = {}
        while (claim := self.ledger.queue.claim(None)) is not None:
            claims[claim.flight.key[1:]] = claim
        for each in slots:
            record(self.ledger, claims.pop(each))
        for claim in claims.values():
            self.ledger.queue.give_back(claim)

    def _id(self, generation: int, slot: int) -> FlightId:
        return FlightId(search="search", map="lawn", slot=Slot(generation=generation, index=slot))


def record(ledger: Ledger, claim: Claim) -> None:
    """Record the flight of a claim."""
    ledger.queue.record(claim, result_of(parse_scenario(claim.scenario)), "cd" * 32, 1.0)


class UnpunctualPool:
    """Stands for workers, each flight of which takes a random time; ``on_flown`` follows each."""

    in_process = False

    def __init__(
        self, ledger: Ledger, workers: int, seed: int, on_flown: Callable[[Claim], None]
    ) -> None:
        self._ledger, self._workers, self._on_flown = ledger, workers, on_flown
        self._random = random.Random(seed)
        self._flying: list[Claim] = []

    def turn(self) -> None:
        """Give each worker that is free a slot; end one flight or none."""
        while len(self._flying) < self._workers:
            claim = self._ledger.queue.claim(None)
            if claim is None:
                break
            self._flying.append(claim)
        if self._flying and self._random.random() < 0.7:
            claim = self._flying.pop(self._random.randrange(len(self._flying)))
            record(self._ledger, claim)
            self._on_flown(claim)

    def close(self) -> None:
        """Give back the slots in flight."""
        for claim in self._flying:
            self._ledger.queue.give_back(claim)
        self._flying.clear()
