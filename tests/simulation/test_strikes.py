"""A director lets events strike in flight, and a scenario with its decision flies the same."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import inf
from typing import Any, ClassVar

import pytest

from pytest_garl.flight.flight import Flight
from pytest_garl.npcs.policies.stationary import Stationary
from pytest_garl.scenarios.groups import EVENT_MOMENTS, EVENTS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.fly import fly
from pytest_garl.simulation.landing_moments import LandingMoments, RecordedMoments, decided_genes
from pytest_garl.simulation.npc_policy import Outlook, PolicySpec
from pytest_garl.simulation.strikes import outlooks_of
from tests.simulation.test_landing_moments import Descends
from tests.support.flights import EMPTY, STAND, nominal

DECIDED = float(EVENT_MOMENTS.index("decided"))
ACTS = {
    "jump": {"distance_m": 2.5, "towards_deg": 90.0},
    "outage": {"lasts_s": 1.3},
    "burst": {"lasts_s": 2.0, "latency_ms": 700.0},
    "cover": {"lasts_s": 1.7, "share_percent": 100.0},
}


class Told:
    """Lets events strike at a time, and notes what it was shown."""

    at_s: ClassVar[float] = inf
    shown: ClassVar[list[Outlook]] = []

    def strikes(self, outlook: Outlook, waiting: Sequence[str]) -> Collection[str]:
        self.shown.append(outlook)
        return waiting if outlook.time_s >= self.at_s else ()


class Policy(Stationary):
    event_director = Told


TELLS = PolicySpec(name="tells", factory=f"{__name__}:Policy")


@pytest.fixture(autouse=True)
def nothing_told() -> None:
    Told.at_s = inf
    Told.shown.clear()


def waiting(event: str) -> Any:
    genes = {f"{event}__{name}": value for name, value in ACTS[event].items()}
    return nominal(**{f"{event}__after": DECIDED, f"{event}__from_s": 7.0}, **genes)


def flown(scenario: Scenario, npcs: PolicySpec) -> Flight:
    return fly(scenario, Descends, npcs, map=EMPTY, time_limit_s=18.0)


def struck_s(flight: Flight, event: str) -> float:
    return RecordedMoments(flight).of_event(event)[-1]


def test_every_event_can_wait_for_a_decision_which_no_delay_follows() -> None:
    assert {*ACTS} == {*EVENTS}
    for event in EVENTS:
        assert waiting(event).decided_events == (event,)
        assert waiting(event)[f"{event}.from_s"] == 0


@pytest.mark.sim
@pytest.mark.parametrize("event", EVENTS)
def test_a_scenario_with_the_decision_flies_the_same(event: str) -> None:
    Told.at_s = 13.5
    scenario = waiting(event)
    live = flown(scenario, TELLS)
    assert 13.5 - 1e-6 <= struck_s(live, event) <= 13.502
    again = scenario.replace(dict(decided_genes(scenario, live, TELLS)))
    assert not again.decided_events
    repeated = flown(again, STAND)
    assert repeated.sha256 == live.sha256
    assert repeated.steps == live.steps
    assert live.steps != flown(nominal(), STAND).steps, "it does something"


@pytest.mark.sim
def test_an_event_that_never_strikes_repeats_as_one_that_comes_too_late() -> None:
    scenario = waiting("jump")
    live = flown(scenario, TELLS)
    assert struck_s(live, "jump") == inf
    again = scenario.replace(dict(decided_genes(scenario, live, TELLS)))
    assert again["jump.from_s"] == 300
    assert flown(again, STAND).sha256 == live.sha256


@pytest.mark.sim
def test_without_a_director_events_strike_at_3_m() -> None:
    scenario = waiting("jump")
    live = flown(scenario, STAND)
    low_s = dict(live.moments)["3 m"]
    assert low_s <= struck_s(live, "jump") < low_s + 0.51
    again = scenario.replace(dict(decided_genes(scenario, live, STAND)))
    assert again["jump.after"] == EVENT_MOMENTS.index("readable") or again["jump.from_s"] < 0.5
    assert flown(again, STAND).sha256 == live.sha256


@pytest.mark.sim
@pytest.mark.parametrize("event", ["jump", "outage"])
def test_a_record_tells_what_a_director_was_shown(event: str) -> None:
    Told.at_s = 12.0
    live = flown(waiting(event), TELLS)
    shown = list(Told.shown)
    assert any(outlook.is_readable for outlook in shown)
    assert shown[-1].time_s == 12.0
    assert list(outlooks_of(live))[: len(shown)] == shown


def test_a_decision_is_a_time_after_the_latest_moment_in_digits_of_a_file() -> None:
    moments = LandingMoments()
    moments.update(1 / 240, 9.0)
    moments.update(1001 / 240, 7.9)
    moments.strike("cover", 4.5)
    moments.strike("outage", 150.0)
    began_s = moments.began_s[1]
    assert moments.of_event("cover")[-1] == began_s + 0.33
    assert moments.of_event("outage")[-1] == began_s + 145.83
    assert moments.of_event("jump")[-1] == inf
    assert ("decided cover", began_s + 0.33) in moments.record
