from __future__ import annotations

import dataclasses
from typing import Any

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.execution.severity import Severity
from pytest_garl.reports.causes import cause_of, counted_causes, telling_case, title_of
from pytest_garl.reports.search_summary import SearchSummary, ViolationKind
from tests.cases.samples import SYSTEM, case

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
            "a (1), b (2) and 2 more conditions: the time runs out in the descent",
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
    assert telling_case([guess], SYSTEM, "lawn", "II:never-seen") is None


def test_the_strength_and_the_number_of_an_object_are_no_part_of_a_cause() -> None:
    assert cause_of(conditions(decoy_1="a", fog="x")) == cause_of(conditions(fog="y", decoy_2=""))
    assert cause_of(DOG) == cause_of(dataclasses.replace(DOG, grade="chasing", speed_mps=6.0))


def test_only_an_open_and_shrunk_case_tells_a_cause() -> None:
    fog = shrunk("II:never-seen", conditions(fog="visibility 10 m"))
    raw = dataclasses.replace(fog, evidence=dataclasses.replace(fog.evidence, neighbours=0))
    fixed = dataclasses.replace(fog, status="fixed")
    other = dataclasses.replace(fog, system="another:Lander")
    cases = [raw, fixed, other, fog]
    assert telling_case(cases, SYSTEM, "lawn", "II:never-seen") is fog
    assert telling_case(cases[:3], SYSTEM, "lawn", "II:never-seen") is None
    assert telling_case(cases, SYSTEM, "court", "II:never-seen") is None


def kind(signature: str, count: int) -> ViolationKind:
    raw = conditions(fog="visibility 9 m", rain="2 mm/h")
    return ViolationKind(
        signature=signature,
        count=count,
        first="lawn-g00-s01",
        story="Gave up.",
        headline="gave up",
        severity=raw,
        severest="lawn-g00-s02",
    )


def summary(*kinds: ViolationKind) -> SearchSummary:
    return SearchSummary(
        system=SYSTEM, map="lawn", files=(), flights=(), kinds=kinds, violating=len(kinds)
    )


def test_kinds_of_one_cause_stand_together_and_are_counted() -> None:
    search = summary(
        kind("IV:dog:descent:seen", 5),
        kind("II:never-seen", 4),
        kind("V:ValueError@x", 3),
        kind("II:lost:descent", 2),
    )
    assert search.causes == ""
    fog = conditions(fog="visibility 10 m")
    cases = [
        shrunk("II:never-seen", fog),
        shrunk("II:lost:descent", fog),
        shrunk("IV:dog:descent:seen", DOG),
    ]
    told = search.with_cases(cases)
    assert [each.signature for each in told.kinds] == [
        "II:never-seen",
        "II:lost:descent",
        "IV:dog:descent:seen",
        "V:ValueError@x",
    ]
    assert told.causes == "3 of them shrunk, with 2 causes"
    assert counted_causes([each.case for each in told.kinds[:3]]) == "2 causes"


def test_the_least_comes_from_the_case_once_there_is_one() -> None:
    search = summary(kind("II:never-seen", 4))
    (raw,) = search.kinds
    assert raw.title == ""
    assert raw.least == "unusual in lawn-g00-s02: fog (visibility 9 m), rain (2 mm/h)"
    (told,) = search.with_cases([shrunk("II:never-seen", conditions(fog="visibility 10 m"))]).kinds
    assert told.title == "fog of 10 m: the marker is never readable"
    assert told.least == "at the least: fog alone, visibility 10 m"
