"""Checks of several options together: options without effect, unknown maps, empty selections."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.plugin.items.keys import is_landing_item, takes_landing
from pytest_garl.plugin.options import Options

SEARCH_OPTIONS = (
    "seed",
    "method",
    "population",
    "domain",
    "shrink",
    "resume",
)
"""Options that only a search uses."""


def check_usage(options: Options) -> None:
    """Raise UsageError for an option without effect, or an unknown map.

    A value of an ini key applies to all runs and may have no effect on some.
    """
    for problem in (*_without_effect(options), *_unknown_maps(options), *_no_report(options)):
        raise pytest.UsageError(problem)


def check_selection(options: Options, items: Sequence[pytest.Item]) -> None:
    """Raise UsageError if no selected test flies the maps or the slot of the command line."""
    if any(map(is_landing_item, items)) or not any(map(takes_landing, items)):
        return
    if "repeat" in options.given:
        raise pytest.UsageError(
            f"--garl-repeat={options.repeat}: none of the selected tests flies it; select the "
            "tests of the landing system and the map that it was flown with"
        )
    if "map" in options.given:
        raise pytest.UsageError(
            f"--garl-map={','.join(options.maps)}: none of the selected tests flies there; give a "
            "map that their markers name"
        )


def _without_effect(options: Options) -> Iterator[str]:
    given = options.given
    if "budget" in given and options.repeat:
        yield (
            "--garl-budget has no effect beside --garl-repeat, which flies one scenario; give only "
            "one of them"
        )
    searches = options.budget > 0 and not options.repeat
    for name in SEARCH_OPTIONS:
        if name in given and not searches:
            reason = "beside --garl-repeat" if options.repeat else "without --garl-budget"
            yield f"--garl-{name} has no effect {reason}: only a search uses it"
    if "npcs" in given and not options.searches_or_repeats:
        yield (
            "--garl-npcs has no effect without --garl-budget or --garl-repeat: saved cases and "
            "baselines have objects of their own"
        )
    if "report" in given and not options.searches_or_repeats:
        yield (
            "--garl-report has no effect without --garl-budget or --garl-repeat: only a search has "
            "something to report"
        )


def _no_report(options: Options) -> Iterator[str]:
    """Yield why a report cannot be written: a search of hours shall not end without it."""
    if options.report is not None:
        from pytest_garl.reports.html.folder import check_target

        try:
            check_target(options.report)
        except GarlError as error:
            yield f"--garl-report: {error}"


def _unknown_maps(options: Options) -> Iterator[str]:
    from pytest_garl.scenarios.maps.loading import map_names

    known_maps = map_names(options.map_folders)
    unknown = [map for map in options.maps if map not in known_maps]
    if unknown:
        yield (
            f"--garl-map: found {', '.join(unknown)}, "
            f"expected one or more of {', '.join(known_maps)}"
        )
