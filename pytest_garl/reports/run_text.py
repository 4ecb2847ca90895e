"""The figures of a run in words that several outputs share; ``garl report`` is all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pytest_garl.execution.result import How
from pytest_garl.files.run_files import RUN_FOLDER
from pytest_garl.messages import command
from pytest_garl.npcs.director_progress import DirectorProgress, EventProgress
from pytest_garl.reports.control_arm import LEAST_FLIGHTS, ControlArm
from pytest_garl.reports.run_record import WHY_NO_LANDING, KindRecord, RunRecord, SearchRecord
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits

PAPER_DEFINITION = "by the paper's definition, which counts not landing"
"""How texts call the paper's definition: its type II is "no landing occurs"."""
LEGEND = {
    "I": "came down off the marker, on something else or on nothing",
    "II": "did not land: the marker could never be read, was lost, or was readable to the end",
    "III": "hit a fixed body",
    "IV": "hit a moving body",
    "V": "error, wrong answer, death or hang of the landing system",
    "late": "landed too late, or let the time run out in sight of the marker, on the ground or "
    "without giving up",
    "off": "came down too far from the marker, up to 1.5 m",
    "hard": "touched down too fast or tilted",
    "slid": "moved on over the ground after its touchdown",
    "abort": 'gave up where nobody could land, with limits(abort="violation")',
    "own": "an assertion of a test",
    "slow": "took more than three times as long as a nominal landing",
    "lost-while-detectable": "did not report the marker while it could be read",
}
"""Meanings of the types of violations and findings: a signature's part before the first colon."""

_MADE: Mapping[How, str] = {
    "control": "random",
    "stratified": "stratified",
    "bred": "bred",
    "replayed": "replayed",
}

TELLING_NPCS = 10
"""Means of fewer NPCs are chance."""


def run_text(run: RunRecord) -> str:
    """Return a run in short, for ``garl report``."""
    lines = []
    for search in run.searches:
        late = search.not_landed
        lines.append(
            f"{search.name}: {search.flown} of {search.wanted} flown, "
            f"{search.landed} landed, {search.violating} violate "
            f"({search.violating_by_the_paper} {PAPER_DEFINITION}), "
            f"gave up: {counts_text(search.gave_up)}"
            f"{f'; ran out of time: {counts_text(late)}' if any(late.values()) else ''}"
        )
        told = (
            control_text(search),
            origins_text(search),
            movers_text(search),
            director_text(search),
            strikes_text(search),
            event_director_text(search),
        )
        lines += [f"  {text}" for text in told if text]
        lines += [line for kind in search.kinds for line in _kind_lines(run, search, kind)]
    return "\n".join([*lines, ""]) if lines else "no flights yet\n"


def _kind_lines(run: RunRecord, search: SearchRecord, kind: KindRecord) -> list[str]:
    title, *ending = [text for text in (kind.title, kind.headline) if text] or [""]
    least = ""
    if kind.case is not None and kind.case.severity.text:
        least = f"at the least: {kind.case.severity.text}"
    elif kind.case is None and kind.severity is not None and kind.severity.unusual:
        least = f"unusual in the mildest of them: {kind.severity.unusual}"
    seen = in_control_text(kind.in_control, search.random_flights)
    texts = (*ending, least, seen, repeat_command(run, search, kind))
    return [
        f"  {kind.count:4d}  {kind.signature}: {title}",
        *(f"        {text}" for text in texts if text),
    ]


def repeat_command(run: RunRecord, search: SearchRecord, kind: KindRecord) -> str:
    """Return the command that repeats the first flight of a kind, called beside the ledger."""
    folder = run.ledger.parent.name
    words = ["pytest", *search.key.files, f"--garl-repeat={kind.first}"]
    return command(*words, *(() if folder == RUN_FOLDER else ("-o", f"garl_dir={folder}")))


def counts_text(counts: Mapping[Any, int]) -> str:
    """Return numbers with their names: ``needless 3, excused 0``."""
    return ", ".join(f"{name} {count}" for name, count in counts.items())


def headline_shares(search: SearchRecord) -> str:
    """Return such as ``60 flown, landed 55.0 %, violations 40.0 % [27.6, 53.5]``."""
    total = search.flown
    low, high = search.violating_interval
    shares = [f"{total} flown", f"landed {percent(search.landed, total)}"]
    if search.completed != search.landed:
        shares.append(f"within the limit of distance {percent(search.completed, total)}")
    violations = percent(search.violating, total)
    return ", ".join([*shares, f"violations {violations} [{100 * low:.1f}, {100 * high:.1f}]"])


def share_lines(search: SearchRecord) -> list[str]:
    """Return the other shares: the paper's definition, no landing, crashes, figures, limits."""
    paper = percent(search.violating_by_the_paper, search.flown)
    tenth = search.tenth_violation
    found = f", the tenth in flight {tenth}" if tenth else ""
    return [
        f"{PAPER_DEFINITION}: violations {paper}{found}",
        _no_landing(search),
        _landings(search),
        f"distance decided in {search.decided('distance')} of {search.flown} flights, "
        f"time in {search.decided('time')}",
        *(f"limits: {limits_text(each)}" for each in search.limits if each != DEFAULT_LIMITS),
    ]


def kinds_lines(search: SearchRecord) -> list[str]:
    """Return how diverse the violations are, and what random flights found beside the search."""
    number, effective = len(search.kinds), search.effective_kinds
    known = counted_causes(search.kinds)
    causes = f", {known}" if known else ""
    diverse = (
        f"{number} kinds of violation{causes}, as diverse as {effective:.1f} equally frequent ones"
    )
    texts = (
        diverse if number > 1 else "",
        control_text(search),
        origins_text(search),
        movers_text(search),
        director_text(search),
        strikes_text(search),
        event_director_text(search),
    )
    return [text for text in texts if text]


def counted_causes(kinds: Sequence[KindRecord]) -> str:
    """Return how many causes kinds have: ``4 causes``, ``5 of them shrunk, with 3 causes``.

    It is empty if no cause is known.
    """
    known = [kind.cause for kind in kinds if kind.cause is not None]
    if not known:
        return ""
    number = len(set(known))
    causes = f"{number} cause{'' if number == 1 else 's'}"
    return causes if len(known) == len(kinds) else f"{len(known)} of them shrunk, with {causes}"


def control_text(search: SearchRecord) -> str:
    """Return what random flights found, and as many later ones; empty without a control arm."""
    if search.control is None:
        return ""
    own = any(kind.type == "own" for kind in search.kinds)
    remark = " (assertions of your own left out)" if own else ""
    return f"{_compared(search.control)}{remark}"


def origins_text(search: SearchRecord) -> str:
    """Return what chance, draws and evolution found; empty if the method does not tell.

    Such as ``new kinds: 2 in 20 random flights, 6 in 40 stratified ones, 3 in 40 bred ones (17 of
    these violate; the model expected 15.2)``.
    """
    if not search.origins:
        return ""
    found = [
        f"{each.first} in {each.flights} {_MADE[each.how]} {'ones' if place else 'flights'}"
        for place, each in enumerate(search.origins)
    ]
    model = search.model
    expected = (
        f" ({model.violating} of these violate; the model expected {model.expected:.1f})"
        if model
        else ""
    )
    return f"new kinds: {', '.join(found)}{expected}"


def movers_text(search: SearchRecord) -> str:
    """Return who moved the NPCs; empty without NPCs.

    Such as ``who said when NPCs begin: the learned director for 12, the rule (just in time) for 3,
    their genes for 9; the director decided in 11 of 15 flights with an NPC that knows of the UAV``.
    """
    movers = search.movers
    if movers is None:
        return ""
    who = _each_for(
        ("the learned director", movers.director),
        ("the rule (just in time)", movers.rule),
        ("their genes", movers.gene),
        (f"the policy {' and '.join(search.npcs)}", movers.policy),
    )
    told = f"who said when NPCs begin: {who}"
    if not movers.directed:
        return told
    return (
        f"{told}; the director decided in {movers.directed} of {movers.interfering} flights with "
        "an NPC that knows of the UAV"
    )


def director_text(search: SearchRecord) -> str:
    """Return how good the director was that learned this landing system; empty without one.

    Fewer than :data:`TELLING_NPCS` NPCs say nothing.
    """
    director = search.director
    if director is None or director.npcs < TELLING_NPCS:
        return ""
    seen = (
        f"; of {director.seen} seen coming it expected {director.expected:.1f} to meet the UAV, "
        f"and {director.met} did"
    )
    return (
        f"what the begins of {director.npcs} NPCs are worth, in preventable collisions per 100: "
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


def strikes_text(search: SearchRecord) -> str:
    """Return who let events strike; empty without events.

    Such as ``who said when events strike: the learned director for 5, the rule (at 3 m) for 2,
    their genes for 6``.
    """
    strikes = search.strikes
    if strikes is None:
        return ""
    who = _each_for(
        ("the learned director", strikes.director),
        ("the rule (at 3 m)", strikes.rule),
        ("their genes", strikes.gene),
    )
    return f"who said when events strike: {who}"


def _each_for(*shares: tuple[str, int]) -> str:
    """Return names with their numbers, without those of none."""
    return ", ".join(f"{name} for {count}" for name, count in shares if count)


def event_director_text(search: SearchRecord) -> str:
    """Return how good the director of events was; empty without one.

    Fewer than :data:`TELLING_NPCS` strikes say nothing.
    """
    found = search.event_director
    if found is None or found.struck < TELLING_NPCS:
        return ""
    return (
        f"what the strikes of events in {found.flights} flights are worth, in violations per 100: "
        f"{_above(found)} (at 3 m); {100 * found.best:.1f} at best; of {found.struck} that struck "
        f"it expected {found.expected:.1f} to end with a violation, and {found.violated} did"
    )


def in_control_text(in_control: int | None, random_flights: int) -> str:
    """Return in how many of the random flights a kind was seen; empty if there is no such count."""
    return "" if in_control is None else f"seen in {in_control} of {random_flights} random flights"


def limits_text(limits: Limits) -> str:
    """Return such as ``distance 0.75 m, time 120 s, abort="needless"``."""
    return f'distance {limits.distance_m:g} m, time {limits.time_s:g} s, abort="{limits.abort}"'


def percent(count: int, total: int) -> str:
    """Return a share in per cent, with one decimal."""
    return f"{100 * count / total:.1f} %"


def _no_landing(search: SearchRecord) -> str:
    """Return the flights that gave up and those without landing, by reason, and the crashes."""
    total, gave_up, not_landed = search.flown, search.gave_up, search.not_landed
    shares = [f"{reason} {percent(gave_up[reason], total)}" for reason in WHY_NO_LANDING]
    parts = [f"gave up: {', '.join(shares)}"]
    forced = [f"{why} {not_landed[why]}" for why in WHY_NO_LANDING[1:] if not_landed[why]]
    reasons = f" (of them {', '.join(forced)})" if forced else ""
    parts.append(f"not landed {percent(sum(not_landed.values()), total)}{reasons}")
    parts += [f"{kind} {percent(count, total)}" for kind, count in search.crashes.items()]
    if search.inconclusive:
        parts.append(f"inconclusive {len(search.inconclusive)}")
    return "; ".join(parts)


def _landings(search: SearchRecord) -> str:
    """Return the median and the worst figures of the flights that landed, or that none did."""
    distance_m, time_s = search.landing_distance_m, search.landing_time_s
    if distance_m is None or time_s is None:
        return "landed 0 %: no flight landed, so nothing is known of its landings"
    return (
        f"landings: distance median {distance_m.median:.2f} m, worst {distance_m.worst:.2f} m; "
        f"time median {time_s.median:.1f} s, worst {time_s.worst:.1f} s"
    )


def _compared(control: ControlArm) -> str:
    random, later = control.random, control.later
    if not later.flights:
        return f"all {random.flights} flights are random: nothing to compare them with"
    found = control.at_equal_flights()
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
