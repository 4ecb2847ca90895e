"""The shares of a search in words, for the terminal and ``garl report``."""

from __future__ import annotations

from pytest_garl.reports.control_arm import LEAST_FLIGHTS, ControlArm
from pytest_garl.reports.search_summary import WHY_NO_LANDING, SearchSummary
from pytest_garl.verdicts.paper_metrics import top_k
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits
from pytest_garl.verdicts.wording import decided_text

PAPER_DEFINITION = "by the paper's definition, which counts not landing"
"""How texts call the paper's definition: its type II is "no landing occurs"."""


def headline_shares(search: SearchSummary) -> str:
    """Return such as ``60 flown, landed 55.0 %, violations 40.0 % [27.6, 53.5]``."""
    total = len(search.flights)
    low, high = share_interval(search.violating, total)
    landed = search.count("landed")
    shares = [f"{total} flown", f"landed {percent(landed, total)}"]
    if search.completed != landed:
        shares.append(f"within the limit of distance {percent(search.completed, total)}")
    violations = percent(search.violating, total)
    return ", ".join([*shares, f"violations {violations} [{100 * low:.1f}, {100 * high:.1f}]"])


def share_lines(search: SearchSummary) -> list[str]:
    """Return the other shares: the paper's definition, no landing, crashes, figures, limits."""
    total = len(search.flights)
    paper = percent(search.violating_by_the_paper, total)
    tenth = top_k(search.verdicts)
    found = f", the tenth in flight {tenth}" if tenth else ""
    return [
        f"{PAPER_DEFINITION}: violations {paper}{found}",
        _no_landing(search),
        _landings(search),
        decided_text(search.verdicts),
        *(f"limits: {limits_text(each)}" for each in search.limits if each != DEFAULT_LIMITS),
    ]


def kinds_lines(search: SearchSummary) -> list[str]:
    """Return how diverse the violations are, and what random flights found beside the search."""
    number, effective = len(search.kinds), search.effective_kinds
    causes = f", {search.causes}" if search.causes else ""
    diverse = (
        f"{number} kinds of violation{causes}, as diverse as {effective:.1f} equally frequent ones"
    )
    return [text for text in (diverse if number > 1 else "", control_text(search)) if text]


def control_text(search: SearchSummary) -> str:
    """Return what random flights found, and as many later ones; empty without a control arm."""
    if search.control is None:
        return ""
    own = any(kind.signature.startswith("own:") for kind in search.kinds)
    remark = " (assertions of your own left out)" if own else ""
    return f"{_compared(search.control)}{remark}"


def in_control_text(in_control: int | None, random_flights: int) -> str:
    """Return in how many of the random flights a kind was seen; empty if there is no such count."""
    return "" if in_control is None else f"seen in {in_control} of {random_flights} random flights"


def limits_text(limits: Limits) -> str:
    """Return such as ``distance 0.75 m, time 120 s, abort="needless"``."""
    return f'distance {limits.distance_m:g} m, time {limits.time_s:g} s, abort="{limits.abort}"'


def percent(count: int, total: int) -> str:
    """Return a share in per cent, with one decimal."""
    return f"{100 * count / total:.1f} %"


def _no_landing(search: SearchSummary) -> str:
    """Return the flights that gave up and those without landing, by reason, and the crashes."""
    total = len(search.flights)
    gave_up = search.without_landing("gave_up")
    shares = [f"{reason} {percent(gave_up[reason], total)}" for reason in WHY_NO_LANDING]
    parts = [f"gave up: {', '.join(shares)}"]
    not_landed = search.without_landing("not_landed")
    forced = [f"{why} {not_landed[why]}" for why in WHY_NO_LANDING[1:] if not_landed[why]]
    reasons = f" (of them {', '.join(forced)})" if forced else ""
    parts.append(f"not landed {percent(sum(not_landed.values()), total)}{reasons}")
    parts += [f"{kind} {percent(count, total)}" for kind, count in search.crashes.items()]
    if inconclusive := search.count("inconclusive"):
        parts.append(f"inconclusive {inconclusive}")
    return "; ".join(parts)


def _landings(search: SearchSummary) -> str:
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
