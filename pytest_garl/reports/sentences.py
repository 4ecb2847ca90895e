"""Sentences that a record tells of a search, for all outputs; empty if there is nothing to tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pytest_garl.execution.result import How
from pytest_garl.npcs.director_progress import DirectorProgress, EventProgress
from pytest_garl.reports.control_arm import LEAST_FLIGHTS, ControlArm
from pytest_garl.reports.search_origins import (
    ModelRecord,
    MoverRecord,
    OriginRecord,
    StrikeRecord,
)

_MADE: Mapping[How, str] = {
    "control": "random",
    "stratified": "stratified",
    "bred": "bred",
    "replayed": "replayed",
    "use": "plain",
    "inside": "predicted",
    "outside": "other",
}

TELLING_NPCS = 10
"""Means of fewer NPCs are chance."""


def counted_causes(causes: Sequence[tuple[str, ...] | None]) -> str:
    """Return how many causes kinds have: ``4 causes``, ``5 of them shrunk, with 3 causes``.

    Of each kind its cause is given, None for an unknown one.
    """
    known = [each for each in causes if each is not None]
    if not known:
        return ""
    number = len(set(known))
    counted = f"{number} cause{'' if number == 1 else 's'}"
    return counted if len(known) == len(causes) else f"{len(known)} of them shrunk, with {counted}"


def control_text(control: ControlArm | None, *, has_own: bool) -> str:
    """Return what random flights found, and as many later ones; empty without a control arm.

    ``has_own`` says whether assertions of a user's own failed, which are left out.
    """
    if control is None:
        return ""
    return f"{_compared(control)}{' (assertions of your own left out)' if has_own else ''}"


def origins_text(origins: Sequence[OriginRecord], model: ModelRecord | None) -> str:
    """Return what chance, draws and evolution found; empty if the method does not tell.

    Such as ``new kinds: 2 in 20 random flights, 6 in 40 stratified ones, 3 in 40 bred ones (17 of
    these violate; the model expected 15.2)``.
    """
    if not origins:
        return ""
    found = [
        f"{each.first} in {each.flights} {_MADE[each.how]} {'ones' if place else 'flights'}"
        for place, each in enumerate(origins)
    ]
    expected = (
        f" ({model.violating} of these violate; the model expected {model.expected:.1f})"
        if model
        else ""
    )
    return f"new kinds: {', '.join(found)}{expected}"


def movers_text(movers: MoverRecord | None, policies: Sequence[str]) -> str:
    """Return who moved the NPCs; empty without NPCs.

    Such as ``who said when NPCs begin: the learned director for 12, the rule (just in time) for 3,
    their genes for 9; the director decided in 11 of 15 flights with an NPC that knows of the UAV``.
    """
    if movers is None:
        return ""
    who = _each_for(
        ("the learned director", movers.director),
        ("the rule (just in time)", movers.rule),
        ("their genes", movers.gene),
        (f"the policy {' and '.join(policies)}", movers.policy),
    )
    told = f"who said when NPCs begin: {who}"
    if not movers.directed:
        return told
    return (
        f"{told}; the director decided in {movers.directed} of {movers.interfering} flights with "
        "an NPC that knows of the UAV"
    )


def director_text(director: DirectorProgress | None) -> str:
    """Return how good the director was that learned this landing system; empty without one.

    Fewer than :data:`TELLING_NPCS` NPCs say nothing.
    """
    if director is None or director.npcs < TELLING_NPCS:
        return ""
    seen = (
        f"; of {director.seen} seen coming it expected {director.expected:.1f} to meet the UAV, "
        f"and {director.met} did"
    )
    return (
        f"what the timing of {director.npcs} NPCs is worth, in preventable collisions per 100: "
        f"{_above(director)} (there 1 s before the UAV); {100 * director.shipped:.1f} with the "
        f"weights that ship, {100 * director.best:.1f} at best{seen if director.seen else ''}"
    )


def _above(progress: DirectorProgress | EventProgress) -> str:
    """Return what the learned director is worth, and how far that lies above the rule."""
    learned = round(100 * progress.learned, 1)
    more = round(learned - round(100 * progress.rule, 1), 1)
    than = f"{abs(more):.1f} {'more' if more > 0 else 'less'} than" if more else "as much as"
    return (
        f"{learned:.1f} as the director decides that learns from earlier flights, {than} by the "
        "fixed rule"
    )


def strikes_text(strikes: StrikeRecord | None) -> str:
    """Return who let events strike; empty without events.

    Such as ``who said when events strike: the learned director for 5, the rule (at 3 m) for 2,
    their genes for 6``.
    """
    if strikes is None:
        return ""
    who = _each_for(
        ("the learned director", strikes.director),
        ("the rule (at 3 m)", strikes.rule),
        ("their genes", strikes.gene),
    )
    return f"who said when events strike: {who}"


def event_director_text(found: EventProgress | None) -> str:
    """Return how good the director of events was; empty without one.

    Fewer than :data:`TELLING_NPCS` strikes say nothing.
    """
    if found is None or found.struck < TELLING_NPCS:
        return ""
    return (
        f"what the strikes of events in {found.flights} flights are worth, in violations per 100: "
        f"{_above(found)} (at 3 m); {100 * found.best:.1f} at best; of {found.struck} that struck "
        f"it expected {found.expected:.1f} to end with a violation, and {found.violated} did"
    )


def _each_for(*shares: tuple[str, int]) -> str:
    """Return names with their numbers, without those of none."""
    return ", ".join(f"{name} for {count}" for name, count in shares if count)


def _compared(control: ControlArm) -> str:
    random, later = control.random, control.later
    if not later.flights:
        return f"all {random.flights} flights are random: nothing to compare them with"
    found = control.at_equal_flights
    if found is None:
        few, name = (random, "random") if random.flights < LEAST_FLIGHTS else (later, "later")
        return (
            f"against random flights: too few {name} flights to say "
            f"({few.flights} of {LEAST_FLIGHTS})"
        )
    return (
        f"at equal flights: {_of(random.flights, found.flights)} random ones (generation 0) "
        f"{_found(found.random, found.random_range, random.flights == found.flights)}; "
        f"{_of(later.flights, found.flights)} later ones "
        f"{_found(found.later, found.later_range, later.flights == found.flights)}"
    )


def _of(flights: int, compared: int) -> str:
    return f"the {flights}" if flights == compared else f"{compared} picked from the {flights}"


def _found(mean: float, between: tuple[int, int], whole: bool) -> str:
    if whole:
        return f"found {between[0]} {'kind' if between[0] == 1 else 'kinds'}"
    low, high = between
    return f"find {mean:.1f} on average, {low} to {high} in 95 % of picks"
