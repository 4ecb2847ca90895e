"""Tables of one flight: what was not nominal, events, nearest bodies, the system's words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from pytest_garl.cases.description import describe_scenario_on
from pytest_garl.flight.flight import Flight, Step
from pytest_garl.messages import printable, shortened
from pytest_garl.scenarios.groups import QUANTITIES, WEATHER
from pytest_garl.scenarios.light import NOON_DEG
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.quantities import unit_of
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.units import GENE_OF_WEATHER

MOST_ROWS = 120
"""A landing system that says something else in each frame fills no page."""
MOST_CHARS = 4000
_FAR_M = 3.0
"""Records say 3 m for a body that was never nearer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionRow:
    """What was not nominal: its name in files, the value in words, the nominal value."""

    name: str
    value: str
    nominal: str


def condition_rows(scenario: Scenario, map: Map, policy: str) -> tuple[ConditionRow, ...]:
    """Return the conditions, the marker's place and the NPCs of a scenario."""
    return tuple(
        ConditionRow(name=name, value=words, nominal=_nominal(name))
        for name, words in describe_scenario_on(scenario, map, policy)
    )


def _nominal(name: str) -> str:
    if name in GENE_OF_WEATHER:
        return "none" if WEATHER[GENE_OF_WEATHER[name]].scale == "inverse" else f"0 {unit_of(name)}"
    if name == "light":
        return f"sun at an elevation of {NOON_DEG:.0f} degrees"
    quantity = QUANTITIES.get(name)
    if quantity is None:
        return ""
    if quantity.choices:
        return quantity.text_of(quantity.nominal)
    return f"{quantity.nominal:g} {quantity.unit}".rstrip()


def nearest_rows(flight: Flight) -> tuple[tuple[str, str, str], ...]:
    """Return (body, least distance, when) of the bodies that the UAV came near to."""
    near = sorted(flight.separations, key=lambda each: (each.distance_m, each.body))
    return tuple(
        (printable(each.body, keep=""), f"{each.distance_m:.2f} m", f"{each.time_s:.1f} s")
        for each in near
        if each.distance_m < _FAR_M
    )[:MOST_ROWS]


def event_rows(flight: Flight) -> tuple[tuple[float, str], ...]:
    """Return (time, what happened): the simulator's events and all contacts."""
    rows = [(each.time_s, each.text) for each in flight.events]
    told = {(round(each.time_s, 2), word) for each in flight.events for word in each.text.split()}
    rows += [
        (each.time_s, f"contact with {each.body} at {each.speed_mps:.1f} m/s")
        for each in flight.contacts
        if (round(each.time_s, 2), each.body) not in told
    ]
    rows.sort(key=lambda row: row[0])
    return tuple((time_s, shortened(text, 300)) for time_s, text in rows[:MOST_ROWS])


def diagnostics_rows(steps: Sequence[Step]) -> tuple[tuple[float, str, str], ...]:
    """Return (time, phase, note) where the landing system's phase or note changed."""
    return tuple(_changes(steps))[:MOST_ROWS]


def _changes(steps: Sequence[Step]) -> Iterator[tuple[float, str, str]]:
    last = ("", "")
    for step in steps:
        said = step.diagnostics
        words = (shortened(said.phase, 100), shortened(said.note, 400)) if said else ("", "")
        if words != last and any(words):
            yield (step.time_s, *words)
        last = words


def cut_text(text: str, limit: int = MOST_CHARS) -> str:
    """Return a text of several lines, printable, cut at the end."""
    shown = printable(text[:limit])
    return shown if len(text) <= limit else f"{shown}… ({len(text) - limit} more characters)"
