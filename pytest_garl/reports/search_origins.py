"""What each way to make scenarios found, how the model did, who moved NPCs and events."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.execution.result import How, Origin
from pytest_garl.npcs.domain_policy import READ_STORIES
from pytest_garl.scenarios.files import parse_scenario
from pytest_garl.scenarios.groups import EVENTS
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.story import GRADES, MET, STORY_MOMENTS, story_of, waits_for_decision
from pytest_garl.search.model import PROPERTIES, proximities
from pytest_garl.search.operators import Matrix
from pytest_garl.simulation.npc_policy import PolicySpec

HOWS: tuple[How, ...] = get_args(How)

Made = Sequence[tuple[LedgerFlight, Origin]]
"""The flights of a search in order, each with how its scenario was made."""
Mover = Literal["director", "rule", "gene", "policy"]
"""Who says when an NPC begins: the learned director, in flight; the rule that it comes just in
time; the moment and the delay of its story; or a policy that reads no story and moves it from the
start."""
MOVERS: tuple[Mover, ...] = ("director", "rule", "gene", "policy")


@dataclass(frozen=True, slots=True, kw_only=True)
class OriginRecord:
    """The flights whose scenarios were made in one way.

    ``kinds`` is how many kinds of violation they show, ``first`` how many of them no earlier flight
    of the search showed.
    """

    how: How
    flights: int
    violating: int
    kinds: int
    first: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelRecord:
    """How well the model predicted the children that were flown.

    ``expected`` is how many of them it expected to violate something, ``violating`` how many did.
    ``error`` is the mean error of their margins, as a share of a safe margin, and
    ``error_of_mean`` that of somebody who always tells the mean of the flights that the model knew.
    """

    flights: int
    expected: float
    violating: int
    error: float
    error_of_mean: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MoverRecord:
    """Who moved the NPCs of a search.

    ``director``, ``rule``, ``gene`` and ``policy`` are numbers of NPCs.  ``interfering`` is how
    many flights have an NPC whose story lets it know of the UAV, ``directed`` in how many of these
    the learned director decides for such an NPC.
    """

    director: int
    rule: int
    gene: int
    policy: int
    interfering: int
    directed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class StrikeRecord:
    """Who says when the events of a search strike: numbers of events.

    ``director`` is the one that learned from the flights, ``rule`` the fixed rule, which decides
    for a kind of event until something else is learned, and ``gene`` a moment and a delay of the
    scenario.
    """

    director: int
    rule: int
    gene: int


def strike_record(
    flown: Iterable[tuple[LedgerFlight, Collection[str]]],
) -> StrikeRecord | None:
    """Return who let events strike; None if no flight has an event.

    With each flight come the kinds of events for which learned weights decide in it.
    """
    counts: Counter[str] = Counter()
    for flight, learned in flown:
        scenario = parse_scenario(flight.scenario)
        acting = {key.partition(".")[0] for key, _ in scenario.genes} & {*EVENTS}
        decided = acting & {*scenario.decided_events}
        counts["director"] += len(decided & {*learned})
        counts["rule"] += len(decided - {*learned})
        counts["gene"] += len(acting) - len(decided)
    if not counts.total():
        return None
    return StrikeRecord(director=counts["director"], rule=counts["rule"], gene=counts["gene"])


def movers_in(scenario: Scenario, npcs: PolicySpec) -> Iterator[tuple[Mover, bool]]:
    """Yield for each NPC of a scenario who moves it, and whether its story knows of the UAV."""
    reads_story = npcs.name in READ_STORIES
    for key, _ in scenario.genes:
        name, _, value = key.partition(".")
        if value != "velocity":
            continue
        story = story_of(scenario, name)
        if story is None or not reads_story:
            # It may be a user's own, and gone when somebody reads the ledger.
            yield "policy", False
        else:
            knows = (npcs.grade or story.grade) != GRADES[0]
            if waits_for_decision(story):
                yield "director" if npcs.decides_begin and knows else "rule", knows
            else:
                yield "rule" if STORY_MOMENTS[story.phase] == MET else "gene", knows


def mover_record(flown: Iterable[tuple[LedgerFlight, PolicySpec]]) -> MoverRecord | None:
    """Return who moved the NPCs of flights; None if no flight has an NPC."""
    counts: Counter[Mover] = Counter()
    interfering = directed = 0
    for flight, npcs in flown:
        movers = list(movers_in(parse_scenario(flight.scenario), npcs))
        counts.update(mover for mover, _ in movers)
        interfering += any(knows for _, knows in movers)
        directed += any(mover == "director" for mover, _ in movers)
    if not counts:
        return None
    return MoverRecord(
        **{mover: counts[mover] for mover in MOVERS}, interfering=interfering, directed=directed
    )


def origin_records(made: Made) -> tuple[OriginRecord, ...]:
    """Return what the scenarios of each way found; empty if a method does not tell."""
    seen: set[str] = set()
    first = dict.fromkeys(HOWS, 0)
    for flight, origin in made:
        if flight.result.verdict.violation and flight.signature not in seen:
            seen.add(flight.signature)
            first[origin.how] += 1
    found = []
    for how in HOWS:
        own = [flight for flight, origin in made if origin.how == how]
        shown = [each.signature for each in own if each.result.verdict.violation]
        if own:
            found.append(
                OriginRecord(
                    how=how,
                    flights=len(own),
                    violating=len(shown),
                    kinds=len({*shown}),
                    first=first[how],
                )
            )
    return tuple(found)


def model_record(made: Made) -> ModelRecord | None:
    """Return how well the model predicted, None if there is no prediction."""
    near = [proximities(flight.result) for flight, _ in made]
    generations = np.array([flight.id.slot.generation for flight, _ in made])
    means: dict[int, Matrix] = {}
    errors, expected, violating = list[tuple[float, float]](), 0.0, 0
    for (flight, origin), own in zip(made, near, strict=True):
        if origin.fails is None:
            continue
        generation = flight.id.slot.generation
        if generation not in means:
            # What the model knew: it is one generation behind, but for the first children.
            known = np.flatnonzero(generations <= max(0, generation - 2))
            means[generation] = np.mean([near[place] for place in known], axis=0)
        told = np.array([origin.expected[name] for name in PROPERTIES])
        pair = (told, means[generation])
        errors.append((float(np.abs(pair[0] - own).mean()), float(np.abs(pair[1] - own).mean())))
        expected += origin.fails
        violating += flight.result.verdict.violation
    if not errors:
        return None
    error, error_of_mean = np.mean(errors, axis=0)
    return ModelRecord(
        flights=len(errors),
        expected=expected,
        violating=violating,
        error=float(error),
        error_of_mean=float(error_of_mean),
    )
