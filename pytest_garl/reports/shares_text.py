"""The shares of a search in words, for the terminal and ``garl report``."""

from __future__ import annotations

from pytest_garl.reports.search_summary import WHY_NO_LANDING, SearchSummary
from pytest_garl.verdicts.paper_metrics import top_k
from pytest_garl.verdicts.statistics import share_interval
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS, Limits
from pytest_garl.verdicts.wording import decided_text

PAPER_DEFINITION = "by the paper's definition, no landing counted"
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
