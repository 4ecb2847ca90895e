from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.severity import Severity
from pytest_garl.reports.causes import cause_of, title_of
from pytest_garl.reports.run_record import KindRecord, SavedCase, SearchRecord
from pytest_garl.reports.sentences import counted_causes
from pytest_garl.scenarios.files import dump_scenario
from tests.cases.samples import SYSTEM, case
from tests.support.results import flight_result

DOG = Severity(about="body", grade="careless", type="dog", objects=1, speed_mps=4.0)


def conditions(**values: str) -> Severity:
    return Severity(
        about="conditions",
        conditions=tuple(name.replace("_", "-") for name in values),
        values=tuple(values.values()),
        largest=next(iter(values.values()), ""),
    )


def shrunk(signature: str, severity: Severity, **fields: Any) -> Case:
    return dataclasses.replace(case(signature), severity=severity, **fields)


@pytest.mark.parametrize(
    ("signature", "severity", "title"),
    [
        (
            "II:never-seen",
            conditions(fog="visibility 10 m"),
            "fog of 10 m: the marker is never readable",
        ),
        (
            "IV:dog:plan:unseen",
            conditions(depth="range 4 m"),
            "depth (range 4 m): plans through it",
        ),
        (
            "V:no-plan:hold",
            conditions(depth="range 4 m"),
            "depth (range 4 m): has no plan any more",
        ),
        ("off:hold", conditions(fog="visibility 10 m"), "fog of 10 m: aims beside the marker"),
        (
            "II:gave-up-in-sight:approach",
            conditions(light="sun 23 degrees high"),
            "sun 23 degrees high: gives up with the marker in view on the approach",
        ),
        (
            "II:gave-up-in-sight:search:light",
            conditions(camera="6 values", jump="distance 2.5 m"),
            "camera (6 values) and jump of 2.5 m: gives up with the marker in view in the search",
        ),
        (
            "IV:dog:last-metre:unseen",
            DOG,
            "a careless dog at 4.0 m/s: collision in the last metre",
        ),
        (
            "I:decoy-helipad-h:seen",
            conditions(decoy_1="helipad-h", person_2=""),
            "decoy-1 (helipad-h) and person-2: comes down on the decoy",
        ),
        (
            "I:nothing:seen",
            conditions(),
            "nothing unusual: comes down on open ground, off the marker",
        ),
        (
            "late:not-landed:descent",
            conditions(a="1", b="2", c="3", d="4"),
            "a (1), b (2) and 2 more conditions: the time runs out below 7 m",
        ),
        ("own:my_test", conditions(fog="visibility 10 m"), ""),
    ],
)
def test_a_title_is_the_cause_and_the_ending(
    signature: str, severity: Severity, title: str
) -> None:
    assert title_of(shrunk(signature, severity)) == title


def test_what_was_not_tried_is_no_cause() -> None:
    both = conditions(fog="visibility 10 m", decoy_2="qr-code")
    perhaps = dataclasses.replace(both, untried=("decoy-2",))
    assert cause_of(perhaps) == ("fog",)
    words = "fog of 10 m, perhaps decoy-2: the marker is never readable"
    assert title_of(shrunk("II:never-seen", perhaps)) == words
    guess = shrunk("II:never-seen", dataclasses.replace(both, untried=("fog", "decoy-2")))
    assert not guess.is_shrunk
    assert telling([guess]) is None


def test_the_strength_and_the_number_of_an_object_are_no_part_of_a_cause() -> None:
    assert cause_of(conditions(decoy_1="a", fog="x")) == cause_of(conditions(fog="y", decoy_2=""))
    assert cause_of(DOG) == cause_of(dataclasses.replace(DOG, grade="chasing", speed_mps=6.0))


def test_only_an_open_and_shrunk_case_tells_a_cause() -> None:
    fog = shrunk("II:never-seen", conditions(fog="visibility 10 m"))
    raw = dataclasses.replace(fog, evidence=dataclasses.replace(fog.evidence, neighbours=0))
    fixed = dataclasses.replace(fog, status="fixed")
    other = dataclasses.replace(fog, system="another:Lander")
    cases = [raw, fixed, other, fog]
    assert telling(cases) is fog
    assert telling(cases[:3]) is None
    assert telling(cases, "court") is None


def test_a_case_that_is_not_saved_tells_a_cause_if_no_saved_one_does() -> None:
    fog = shrunk("II:never-seen", conditions(fog="visibility 10 m"))
    rain = shrunk("II:never-seen", conditions(rain="2 mm/h"))
    saved = SavedCase(path=Path("a.toml"), case=fog, known=False)
    search = record(kind("II:never-seen", 4))
    assert search.with_cases([saved], [rain]).kinds[0].case is fog
    assert search.with_cases([], [rain]).kinds[0].case is rain


def test_the_case_of_a_kinds_own_flight_tells_its_cause() -> None:
    """The twin of another kind's flight may end alike, with nothing unusual."""
    twin = shrunk("II:never-seen", conditions())
    fog, rain = (
        shrunk("II:never-seen", severity, scenario=dataclasses.replace(twin.scenario, seed=seed))
        for seed, severity in (
            (7, conditions(fog="visibility 10 m")),
            (8, conditions(rain="2 mm/h")),
        )
    )
    saved = [
        SavedCase(path=Path(f"{number}.toml"), case=each, known=False)
        for number, each in enumerate((twin, rain, fog))
    ]
    shown = record(kind("II:never-seen", 3))
    flown = dataclasses.replace(
        shown, flights=(ledger_flight(1, fog), ledger_flight(2, rain), ledger_flight(4, twin))
    )
    assert flown.with_cases(saved).kinds[0].case is fog
    assert shown.with_cases(saved).kinds[0].case is twin


def test_of_the_cases_of_a_kinds_flights_the_simplest_tells_its_cause() -> None:
    both = conditions(fog="visibility 10 m", rain="2 mm/h")
    first, second = (
        dataclasses.replace(each, scenario=dataclasses.replace(each.scenario, seed=seed))
        for seed, each in (
            (7, shrunk("II:never-seen", both)),
            (8, shrunk("II:never-seen", conditions(fog="visibility 10 m"))),
        )
    )
    saved = [SavedCase(path=Path("a.toml"), case=each, known=False) for each in (first, second)]
    flown = dataclasses.replace(
        record(kind("II:never-seen", 2)),
        flights=(ledger_flight(1, first), ledger_flight(2, second)),
    )
    assert flown.with_cases(saved).kinds[0].case is second


@pytest.mark.parametrize(("flown_fog", "told"), [(0.0, False), (0.4, True)])
def test_a_case_of_another_search_tells_no_cause_that_no_flight_has(
    flown_fog: float, told: bool
) -> None:
    plain = shrunk("II:never-seen", conditions())
    fog = dataclasses.replace(
        shrunk("II:never-seen", conditions(fog="visibility 10 m")),
        scenario=dataclasses.replace(
            plain.scenario.replace({"environment.fog": 0.9}), seed=plain.scenario.seed + 1
        ),
    )
    scenario = plain.scenario.replace({"environment.fog": flown_fog})
    own = dataclasses.replace(plain, scenario=scenario)
    flown = dataclasses.replace(record(kind("II:never-seen", 1)), flights=(ledger_flight(1, own),))
    saved = [SavedCase(path=Path("a.toml"), case=fog, known=True)]
    assert flown.with_cases(saved).kinds[0].case == (fog if told else None)
    (shown,) = flown.with_cases(saved).kinds
    assert shown.least.startswith(f"at the least, by {saved[0].name}: " if told else "unusual in ")


def ledger_flight(number: int, case: Case) -> LedgerFlight:
    return LedgerFlight(
        id=FlightId(search="s", map="lawn", slot=Slot(generation=0, index=number)),
        system=SYSTEM,
        scenario=dump_scenario(case.scenario),
        result=flight_result(),
        sha256="",
    )


def telling(cases: Sequence[Case], map: str = "lawn") -> Case | None:
    """Return the case that tells the cause of a kind on a map."""
    saved = [SavedCase(path=Path("a.toml"), case=each, known=False) for each in cases]
    key = SearchKey(system=SYSTEM, map=map)
    return kind("II:never-seen", 4).with_cases(key, saved).case


def kind(signature: str, count: int) -> KindRecord:
    raw = conditions(fog="visibility 9 m", rain="2 mm/h")
    return KindRecord(
        signature=signature,
        slots=tuple(f"lawn-g00-s{index:02d}" for index in range(1, count + 1)),
        story="Gave up.",
        severity=raw,
        severest="lawn-g00-s02",
    )


def record(*kinds: KindRecord) -> SearchRecord:
    key = SearchKey(system=SYSTEM, map="lawn")
    return SearchRecord(key=key, name=key.place, flights=(), kinds=kinds, violating=len(kinds))


def test_kinds_of_one_cause_stand_together_and_are_counted() -> None:
    search = record(
        kind("IV:dog:descent:seen", 5),
        kind("II:never-seen", 4),
        kind("V:ValueError@x", 3),
        kind("II:lost:descent", 2),
    )
    assert search.causes == 0
    fog = conditions(fog="visibility 10 m")
    cases = [
        shrunk("II:never-seen", fog),
        shrunk("II:lost:descent", fog),
        shrunk("IV:dog:descent:seen", DOG),
    ]
    told = search.with_cases([], cases)
    assert [each.signature for each in told.kinds] == [
        "II:never-seen",
        "II:lost:descent",
        "IV:dog:descent:seen",
        "V:ValueError@x",
    ]
    assert told.causes == 2
    causes = [each.cause for each in told.kinds]
    assert counted_causes(causes) == "3 of them shrunk, with 2 causes"
    assert counted_causes(causes[:3]) == "2 causes"


def test_the_least_comes_from_the_case_once_there_is_one() -> None:
    search = record(kind("II:never-seen", 4))
    (raw,) = search.kinds
    assert raw.title == ""
    assert raw.least == "unusual in lawn-g00-s02: fog (visibility 9 m), rain (2 mm/h)"
    cases = [shrunk("II:never-seen", conditions(fog="visibility 10 m"))]
    (told,) = search.with_cases([], cases).kinds
    assert told.title == "fog of 10 m: the marker is never readable"
    assert told.least == "at the least: fog alone, visibility 10 m"
