"""What the scenarios of each way found, and how well the model predicted."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import pytest

from pytest_garl.execution.facts import SearchKey
from pytest_garl.execution.flight_id import FlightId, Slot
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.result import Origin
from pytest_garl.npcs.director import RULE
from pytest_garl.npcs.director_progress import (
    DirectorProgress,
    EventProgress,
    total,
    total_of_events,
)
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.reports.run_record import SearchRecord
from pytest_garl.reports.search_origins import (
    MoverRecord,
    StrikeRecord,
    model_record,
    mover_record,
    origin_records,
    strike_record,
)
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.scenarios.groups import EVENT_MOMENTS
from pytest_garl.scenarios.story import GRADES, STORY_MOMENTS
from pytest_garl.search.model import PROPERTIES
from pytest_garl.search.objectives import SAFE_MARGINS
from pytest_garl.verdicts.verdict import Margin
from tests.support.results import flight_result
from tests.support.stories import scenario_with

DOG, BIRD = "IV:dog:descent:seen", "IV:bird:descent:seen"
CONTROL, DRAWN = Origin(how="control"), Origin(how="stratified")


def child(near: float, fails: float) -> Origin:
    """Return a child of which a model expects the same proximity for each property."""
    names: Sequence[str] = PROPERTIES
    expected = dict.fromkeys(names, near)
    return Origin(how="bred", parents=("lawn-g00-s00",), expected=expected, fails=fails)


def flight(generation: int, index: int, signature: str = "", near: float = 0.0) -> LedgerFlight:
    margins = tuple(
        Margin(property=name, value=safe * (1 - near), unit="1")
        for name, safe in SAFE_MARGINS.items()
    )
    return LedgerFlight(
        id=FlightId(search="s", map="lawn", slot=Slot(generation=generation, index=index)),
        system="my_landing:Mine",
        scenario="",
        result=flight_result(signature, margins=margins),
        sha256="",
    )


MADE: Sequence[tuple[LedgerFlight, Origin]] = (
    (flight(0, 0, DOG), CONTROL),
    (flight(0, 1), CONTROL),
    (flight(1, 0, DOG), child(0.2, 0.5)),
    (flight(1, 1, BIRD), DRAWN),
    (flight(2, 0, BIRD), child(0.2, 0.25)),
    (flight(2, 1, "off"), child(0.2, 0.5)),
)


def test_each_way_is_told_with_the_kinds_that_it_found_first() -> None:
    found = [(e.how, e.flights, e.violating, e.kinds, e.first) for e in origin_records(MADE)]
    assert found == [("control", 2, 1, 1, 1), ("stratified", 1, 1, 1, 1), ("bred", 3, 3, 3, 1)]


def test_a_method_that_does_not_tell_has_no_records() -> None:
    assert origin_records(()) == ()
    assert model_record(()) is None
    assert model_record(MADE[:2]) is None


def test_expected_violations_stand_beside_those_that_came() -> None:
    record = model_record(MADE)
    assert record is not None
    assert (record.flights, record.expected, record.violating) == (3, 1.25, 3)


def test_errors_are_those_of_children_and_of_the_mean_of_what_the_model_knew() -> None:
    made = (
        (flight(0, 0, near=0.0), CONTROL),
        (flight(0, 1, near=0.2), CONTROL),
        # Nobody knows this flight when the next generation is bred.
        (flight(1, 0, near=0.9), DRAWN),
        (flight(2, 0, near=0.5), child(0.45, 0.0)),
        (flight(3, 0, near=0.4), child(0.45, 0.0)),
    )
    record = model_record(made)
    assert record is not None
    assert record.error == pytest.approx(0.05)
    later_mean = (0.0 + 0.2 + 0.9) / 3
    assert record.error_of_mean == pytest.approx((0.4 + abs(0.4 - later_mean)) / 2)


def test_the_summary_tells_it_in_one_line() -> None:
    key = SearchKey(system="my_landing:Mine", map="lawn")
    flights = tuple(each for each, _ in MADE)
    search = SearchRecord(key=key, name=key.place, flights=flights, kinds=(), violating=0)
    assert "origins" not in search.told
    told = dataclasses.replace(search, origins=origin_records(MADE), model=model_record(MADE))
    assert told.told["origins"] == (
        "new kinds: 1 in 2 random flights, 1 in 1 stratified ones, 1 in 3 bred ones "
        "(3 of these violate; the model expected 1.2)"
    )
    drawn = dataclasses.replace(told, origins=told.origins[:2], model=None)
    assert drawn.told["origins"] == "new kinds: 1 in 2 random flights, 1 in 1 stratified ones"


def with_story(grade: str, moment: str, *, name: str = "dog-1") -> LedgerFlight:
    values = {"grade": GRADES.index(grade), "phase": STORY_MOMENTS.index(moment)}
    scenario = scenario_with(name, (-8.0, 0.0), 2.0, values)
    return dataclasses.replace(flight(0, 0), scenario=dump_scenario(scenario))


STORIES = (
    with_story("chasing", "decided"),
    with_story("curious", "decided", name="person-1"),
    with_story("careless", "decided"),
    with_story("chasing", "met"),
    with_story("curious", "3 m"),
    with_story("careless", "touchdown"),
)


def test_npcs_are_told_by_who_says_when_they_begin() -> None:
    graded = policy_spec("graded")
    assert mover_record((each, graded) for each in STORIES) == MoverRecord(
        director=2, rule=2, gene=2, policy=0, interfering=4, directed=2
    )


def test_a_forced_grade_decides_for_all_npcs_or_for_none() -> None:
    forced = mover_record((each, policy_spec("chasing")) for each in STORIES[2:4])
    assert forced == MoverRecord(director=0, rule=2, gene=0, policy=0, interfering=2, directed=0)
    careless = mover_record((each, policy_spec("careless")) for each in STORIES[:2])
    assert careless == MoverRecord(director=0, rule=2, gene=0, policy=0, interfering=0, directed=0)
    hostile = mover_record((each, policy_spec("hostile")) for each in STORIES)
    assert hostile == MoverRecord(director=0, rule=0, gene=0, policy=6, interfering=0, directed=0)


def test_who_moved_the_npcs_is_told_in_one_line() -> None:
    key = SearchKey(system="my_landing:Mine", map="lawn")
    search = SearchRecord(key=key, name=key.place, flights=(), kinds=(), violating=0)
    assert "movers" not in search.told
    told = dataclasses.replace(
        search, movers=mover_record((each, policy_spec("graded")) for each in STORIES)
    )
    assert told.told["movers"] == (
        "who said when NPCs begin: the learned director for 2, the rule (just in time) for 2, "
        "their genes for 2; the director decided in 2 of 4 flights with an NPC that knows of the "
        "UAV"
    )
    movers = mover_record([(STORIES[0], policy_spec("dqn"))])
    moved = dataclasses.replace(search, movers=movers, npcs=("dqn",))
    assert moved.told["movers"] == "who said when NPCs begin: the policy dqn for 1"


def test_the_summary_says_how_good_the_director_was_in_all_generations() -> None:
    quiet = DirectorProgress(
        npcs=0, learned=0, shipped=0, rule=0, best=0, seen=0, expected=0, met=0
    )
    first, second = (
        DirectorProgress(
            npcs=npcs,
            learned=learned,
            shipped=0.1,
            rule=0.05,
            best=0.5,
            seen=seen,
            expected=seen / 2,
            met=1,
        )
        for npcs, learned, seen in ((5, 0.1, 1), (15, 0.3, 2))
    )
    assert total([quiet]) is None
    assert total([quiet, first]) == first
    key = SearchKey(system="m:S", map="lawn")
    search = SearchRecord(key=key, name=key.place, flights=(), kinds=(), violating=0)
    assert "director" not in search.told
    assert "director" not in dataclasses.replace(search, director=first).told, "too few to say"
    told = dataclasses.replace(search, director=total([first, quiet, second]))
    assert told.told["director"] == (
        "what the timing of 20 NPCs is worth, in preventable collisions per 100: 25.0 as the "
        "director decides that learns from earlier flights, 20.0 more than by the fixed rule "
        f"(there {RULE.margin_s:g} s before the UAV); 10.0 with the weights that ship, 50.0 at "
        "best; of 3 seen coming it expected 1.5 to meet the UAV, and 2 did"
    )
    worse = dataclasses.replace(search, director=dataclasses.replace(second, learned=0.0123))
    assert (
        "1.2 as the director decides that learns from earlier flights, 3.8 less than by "
        in (worse.told["director"])
    )


def with_event(moment: str, event: str = "cover") -> LedgerFlight:
    after = {f"{event}.after": EVENT_MOMENTS.index(moment), f"{event}.lasts_s": 2.0}
    scenario = scenario_with("dog-1", (-8.0, 0.0), 2.0, {}).replace(after)
    return dataclasses.replace(flight(0, 0), scenario=dump_scenario(scenario))


def test_events_are_told_by_who_says_when_they_strike() -> None:
    key = SearchKey(system="my_landing:Mine", map="lawn")
    search = SearchRecord(key=key, name=key.place, flights=(), kinds=(), violating=0)
    flown = [
        (with_event("decided"), ()),
        (with_event("decided"), ("cover",)),
        (with_event("decided"), ("jump", "outage")),
        (with_event("decided", "outage"), ("jump", "outage")),
        (with_event("3 m"), ("cover",)),
        (with_event("start", "burst"), ()),
        (STORIES[0], ("cover",)),
    ]
    found = strike_record(flown)
    assert found == StrikeRecord(director=2, rule=2, gene=2)
    assert strike_record(flown[6:]) is None
    assert "strikes" not in search.told
    assert dataclasses.replace(search, strikes=found).told["strikes"] == (
        "who said when events strike: the learned director for 2, the rule (at 3 m) for 2, their "
        "genes for 2"
    )


def test_the_summary_says_how_good_the_director_of_events_was() -> None:
    quiet = EventProgress(
        flights=8, learned=0.1, rule=0.1, best=0.2, struck=0, expected=0, violated=0
    )
    first = dataclasses.replace(quiet, struck=4, expected=1.0, violated=2)
    second = EventProgress(
        flights=24, learned=0.3, rule=0.1, best=0.4, struck=8, expected=2.5, violated=2
    )
    assert total_of_events([quiet]) is None
    key = SearchKey(system="m:S", map="lawn")
    search = SearchRecord(key=key, name=key.place, flights=(), kinds=(), violating=0)
    assert "event director" not in search.told
    few = dataclasses.replace(search, event_director=total_of_events([first]))
    assert "event director" not in few.told, "too few to say"
    told = dataclasses.replace(search, event_director=total_of_events([first, second]))
    assert told.told["event director"] == (
        "what the strikes of events in 32 flights are worth, in violations per 100: 25.0 as the "
        "director decides that learns from earlier flights, 15.0 more than by the fixed rule (at 3 "
        "m); 35.0 at best; of 12 that struck it expected 3.5 to end with a violation, and 4 did"
    )
    level = dataclasses.replace(second, struck=12, learned=0.1004)
    assert (
        "10.0 as the director decides that learns from earlier flights, as much as by the "
        in (dataclasses.replace(search, event_director=level).told["event director"])
    )
