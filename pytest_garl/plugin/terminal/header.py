"""The header of a session: what will be searched, and how long it will probably take."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from pytest_garl import cpu_dispatch
from pytest_garl.engine import chosen
from pytest_garl.files.run_files import RUN_FOLDER, SEARCH_LEDGER
from pytest_garl.messages import command
from pytest_garl.plugin.items.suggested_commands import shown_path
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal.time_left import FIRST_FLIGHTS
from pytest_garl.plugin.terminal_text import counted, duration
from pytest_garl.search.method_catalogue import method_names
from pytest_garl.triage.forecast import flight_times_with_shrinking, seconds_per_new_signature
from pytest_garl.verdicts.verdict import DEFAULT_LIMITS
from pytest_garl.verdicts.wording import limits_text

_DEFAULT_LEDGER = f"{RUN_FOLDER}/{SEARCH_LEDGER}"


def header(run: Run, config: pytest.Config) -> str:
    """Return the header: what is searched, how long it takes, and a warning, if any."""
    return "\n".join(
        [_search_line(run), *_findings_so_far(run, config), *cpu_dispatch_warning(run)]
    )


def forecast(run: Run) -> list[str]:
    """Return how long all searches take together, if there are several and an earlier run tells."""
    options = run.options
    sizes = run.search_sizes
    if not options.budget or options.workers is None or len(sizes) < 2 or run.flight_s is None:
        return []
    time = f"{_duration_of(run, run.flight_s, sizes)}{_shrinking(run, run.flight_s)}"
    return [f"garl: {len(sizes)} searches, {time}"]


def limits_lines(run: Run) -> list[str]:
    """Return the limits of the selected systems, if they are not the default ones."""
    targets = [target for slots in run.searches.targets.values() for target in slots.values()]
    given = dict.fromkeys((target.system.__qualname__, target.limits) for target in targets)
    return [
        f"garl: limits of {name}: {limits_text(limits)}"
        for name, limits in given
        if limits != DEFAULT_LIMITS
    ]


def domain_lines(run: Run) -> list[str]:
    """Return the domains of markers that name another one, and airframes that bound a domain."""
    from pytest_garl.scenarios.domains.own_navigation import within

    targets = [target for slots in run.searches.targets.values() for target in slots.values()]
    given = dict.fromkeys(
        (target.system.__qualname__, target.domain, target.navigation)
        for target in targets
        if target.entry is None
    )
    lines = []
    for name, domain, navigation in given:
        if domain != run.options.domain:
            npcs = run.options.policy_in(domain)
            lines.append(f"garl: domain of {name}: {domain.name}, NPCs {npcs}")
        if domain != within(domain, navigation):
            lines.append(f"garl: navigation of {name}: {navigation}, which bounds the domain's")
    return list(dict.fromkeys(lines))


def acceptance_warning(run: Run) -> list[str]:
    """Return a warning if git cannot tell which cases are committed."""
    problem = run.corpus.acceptance.problem
    if not problem:
        return []
    return [
        f"garl: cannot tell which cases are committed ({problem}); only cases that "
        "`garl cases accept` has marked are known"
    ]


def cpu_dispatch_warning(run: Run) -> list[str]:
    """Return a warning if a library was loaded before its CPU instructions could be chosen."""
    libraries, options = cpu_dispatch.libraries_off_baseline(), run.options
    effects = []
    if options.workers == 0:
        effects.append("flown in a worker process, not inside pytest")
    if options.searches_or_repeats and options.method not in method_names():
        bred = f"scenarios that {options.method} breeds here may differ on another make of CPU"
        effects.append(bred)
    if not libraries or not effects:
        return []
    cause = f"loaded before pytest-garl could choose its instructions: {', '.join(libraries)}"
    return ["; ".join([f"garl: {cause}", *effects])]


def _search_line(run: Run) -> str:
    """Return what is flown: a repeated scenario, or a search with these options."""
    options = run.options
    if options.repeat:
        return f"garl: repeating {options.repeat}"
    done = sum(search.flown for search in run.ledger.queries.progress()) if options.resume else 0
    resuming = f"resuming after {done} flights; " if options.resume else ""
    return (
        f"garl: {resuming}budget {options.budget} per system and map, method {options.method}, "
        f"seed {options.seed}, NPCs {options.policy_in(options.domain)}, "
        f"domain {options.domain.name}{_archive(run)}, engine {chosen()}, "
        f"{_workers(run)}"
    )


def _archive(run: Run) -> str:
    """Return which archive the search begins with; empty if no ini key names one."""
    if run.options.archive is None:
        return ""
    return f", archive {run.ledger.facts.archive or 'none yet'}"


def _findings_so_far(run: Run, config: pytest.Config) -> list[str]:
    """Return how to see what a search has found before it is over."""
    if run.options.repeat or not run.options.budget:
        return []
    ledger = shown_path(run.ledger.path, config)
    report = command("garl", "report", *([] if ledger == _DEFAULT_LEDGER else [ledger]))
    return [f"garl: `{report}` in a second terminal shows what was found so far"]


def _workers(run: Run) -> str:
    """Return how many workers fly and where, and how long it takes if that is known."""
    options = run.options
    ray = f" of Ray at {options.ray_address}" if options.ray_address else " of Ray, started here"
    pool = ray if options.pool == "ray" else ""
    if options.workers is None:
        return f"all workers{pool}"
    inside = run.pool.in_process
    workers = "flown inside pytest" if inside else counted(options.workers or 1, "worker")
    if run.flight_s is None:
        follows = f"; the time left follows after {FIRST_FLIGHTS} flights"
        return f"{workers}{pool}{follows if options.budget > FIRST_FLIGHTS else ''}"
    time = _duration_of(run, run.flight_s, [options.budget])
    return f"{workers}{pool}; {time} per system and map{_shrinking(run, run.flight_s)}"


def _duration_of(run: Run, flight_s: float, searches: Sequence[int]) -> str:
    """Return how long searches of these sizes take, with all that the default cap allows."""
    options = run.options
    each = options.shrink if options.shrink_capped else 0
    workers = max(1, options.workers or 1)
    times = sum(flight_times_with_shrinking(search, each, workers) for search in searches)
    return f"about {duration(times * flight_s)}"


def _shrinking(run: Run, flight_s: float) -> str:
    """Return what the duration says about shrinking."""
    options = run.options
    if not options.shrink:
        return ""
    if options.shrink_capped:
        return ", shrinking included"
    kind_s = seconds_per_new_signature(options.shrink, flight_s)
    beside = ", on one worker" if (options.workers or 1) > 1 else ""
    return f", and about {duration(kind_s)} per new kind of violation{beside}"
