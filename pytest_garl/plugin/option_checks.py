"""Options that are each right and together wrong: without effect, or naming what is not there."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.slot import Slot
from pytest_garl.plugin.arguments import OPTIONS
from pytest_garl.plugin.keys import is_landing_item
from pytest_garl.plugin.options import SLOT_ID, Options

OF_A_SEARCH = ("seed", "method", "population", "weather", "duplicates", "shrink", "resume")
"""Options that say how a search goes."""


def check_usage(config: pytest.Config, options: Options) -> None:
    """Raise UsageError for an option without effect, an unknown map or an unknown slot.

    Values of ini keys stand for every run and need not have an effect on each.
    """
    given = [each.name for each in OPTIONS if config.getoption(f"--garl-{each.name}") is not None]
    given += ["resume"] if options.resume else []
    for problem in (*_without_effect(given, options), *_unknown(options)):
        raise pytest.UsageError(problem)


def check_selection(config: pytest.Config, items: Iterable[pytest.Item]) -> None:
    """Raise UsageError where maps or a slot are asked for that no selected test flies."""
    landings = [item for item in items if "garl_slot" in getattr(item, "fixturenames", ())]
    if not landings or any(is_landing_item(item) for item in items):
        return
    repeat, maps = config.getoption("--garl-repeat"), config.getoption("--garl-map")
    if repeat:
        raise pytest.UsageError(
            f"--garl-repeat={repeat}: none of the selected tests flies it; select the tests of the "
            "landing system and the map that it was flown with"
        )
    if maps:
        raise pytest.UsageError(
            f"--garl-map={maps}: none of the selected tests flies there; give a map of theirs"
        )


def _without_effect(given: Collection[str], options: Options) -> Iterator[str]:
    if "budget" in given and options.repeat:
        yield (
            "--garl-budget has no effect beside --garl-repeat, which flies one scenario; give one "
            "of them"
        )
    searches = options.budget > 0 and not options.repeat
    for name in given:
        if name in OF_A_SEARCH and not searches:
            reason = "beside --garl-repeat" if options.repeat else "without --garl-budget"
            yield f"--garl-{name} has no effect {reason}: it says how a search goes"
    if "npcs" in given and not options.searches:
        yield (
            "--garl-npcs has no effect without --garl-budget or --garl-repeat: saved cases and "
            "baselines have objects of their own"
        )
    if "level" in given and options.baseline is None:
        yield "--garl-level has no effect without --garl-baseline, whose gate it belongs to"


def _unknown(options: Options) -> Iterator[str]:
    """Yield what is wrong with the names of maps and of a slot."""
    from pytest_garl.scenarios.maps.map import map_names

    there = map_names(options.map_folders)
    unknown = [map for map in options.maps if map not in there]
    if unknown:
        yield (
            f"--garl-map: found {', '.join(unknown)}, expected one or more of {', '.join(there)}"
        )
    match = SLOT_ID.fullmatch(options.repeat)
    if match is None:
        return
    path = options.folder / "ledger.sqlite"
    if not path.is_file():
        yield (
            f"--garl-repeat={options.repeat}: there is no ledger at {path}; run a search first, or "
            "give a scenario file"
        )
        return
    try:
        ledger = Ledger(path)
        try:
            found = ledger.queries.scenarios(
                int(match["generation"]), int(match["slot"]), match["map"]
            )
            if not found:
                held = _held(ledger)
                yield f"--garl-repeat={options.repeat}: no such slot in {path}; it holds {held}"
        finally:
            ledger.close()
    except GarlError as error:
        yield f"--garl-repeat={options.repeat}: {error}"


def _held(ledger: Ledger) -> str:
    """Say which slots a ledger holds."""
    slots: dict[str, list[Slot]] = {}
    for _, map, generation, index, _ in ledger.queries.results():
        slots.setdefault(map, []).append(Slot(generation=generation, index=index))
    ranges = [f"{min(those).id(map)} to {max(those).id(map)}" for map, those in slots.items()]
    return ", ".join(ranges) or "no flights"
