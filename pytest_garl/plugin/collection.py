"""The items of a marked test: saved cases, slots of a search, or one repeated scenario."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import slots
from pytest_garl.messages import command
from pytest_garl.plugin.inputs import corpus_of, repeated_slot_of
from pytest_garl.plugin.keys import COLLECTED, SLOT_FIXTURE, marker_among
from pytest_garl.plugin.marker import MarkerArguments, read_marker
from pytest_garl.plugin.options import options_of
from pytest_garl.plugin.target import Target

NOTHING_TO_FLY = (
    "no --garl-budget given and no saved case of this test; to search: pytest --garl-budget=40"
)


@contextlib.contextmanager
def make_items(metafunc: pytest.Metafunc, marker: pytest.Mark | None) -> Iterator[None]:
    """Make the items of a test that takes a landing; inside pytest makes those of its parameters.

    A mark of a parameter, ``pytest.param(System, marks=pytest.mark.garl(...))``, comes before that
    of the test.  Raises CollectError if an item has no mark, or an invalid one.
    """
    name = metafunc.definition.nodeid
    try:
        if marker is not None and not _has_marked_parameters(metafunc.definition):
            parametrize(metafunc, marker)
            yield
        else:
            yield
            _parametrize_each(metafunc, marker)
    except GarlError as error:
        raise pytest.Collector.CollectError(f"{name}: {error}") from error


def _parametrize_each(metafunc: pytest.Metafunc, marker: pytest.Mark | None) -> None:
    """Give each combination of parameters the slots of its own mark.

    ``Metafunc.parametrize`` alone cannot: it combines its values with all that came before.
    """
    calls, made = metafunc._calls, []
    if not calls:
        raise pytest.Collector.CollectError(_without_mark(metafunc.definition.nodeid))
    for call in calls:
        own = marker_among(call.marks) or marker
        if own is None:
            name = f"{metafunc.definition.nodeid}[{call.id}]"
            raise pytest.Collector.CollectError(_without_mark(name))
        metafunc._calls = [call]
        parametrize(metafunc, own)
        made += metafunc._calls
    metafunc._calls = made


def _without_mark(name: str) -> str:
    return f"{name} uses a landing fixture without @pytest.mark.garl(system=..., maps=[...])"


def _has_marked_parameters(definition: pytest.Item) -> bool:
    """Whether a parameter of a test has a mark ``garl``; a list or a tuple can be looked into."""
    for mark in definition.iter_markers("parametrize"):
        values = mark.args[1] if len(mark.args) > 1 else mark.kwargs.get("argvalues")
        if not isinstance(values, list | tuple):
            continue
        if any(marker_among(getattr(each, "marks", ())) for each in values):
            return True
    return False


def parametrize(metafunc: pytest.Metafunc, marker: pytest.Mark) -> None:
    """Make one item for each target of a marked test; without targets make one skipped item.

    Raises GarlError if the marker is invalid.
    """
    options = options_of(metafunc.config)
    arguments = read_marker(marker, options)
    _note(metafunc, arguments)
    targets = targets_for(arguments, metafunc.config, metafunc.definition.originalname)
    if targets:
        ids = [target.name for target in targets]
        return metafunc.parametrize(SLOT_FIXTURE, targets, ids=ids, indirect=True)
    if options.repeat:
        reason = f"--garl-repeat={options.repeat}: this test does not fly it"
    else:
        reason = "no map selected" if options.budget else NOTHING_TO_FLY
    return metafunc.parametrize(SLOT_FIXTURE, [reason], ids=["nothing"], indirect=True)


def _note(metafunc: pytest.Metafunc, arguments: MarkerArguments) -> None:
    """Note a test for the census of the saved cases."""
    from pytest_garl.cases.collected_tests import CollectedTest

    metafunc.config.stash[COLLECTED].tests.append(
        CollectedTest(
            nodeid=metafunc.definition.nodeid,
            name=metafunc.definition.originalname,
            system=arguments.target.system_name,
            maps=arguments.all_maps,
            data_files=arguments.target.files,
        )
    )


def targets_for(arguments: MarkerArguments, config: pytest.Config, test: str) -> list[Target]:
    """Return the saved cases and the slots of a marked test called ``test``."""
    options = options_of(config)
    if options.repeat:
        return [
            each for map in arguments.maps for each in _repeated_targets(arguments, map, config)
        ]
    searched = [
        replace(target, slot=slot)
        for target in [arguments.on(map) for map in arguments.maps]
        for slot in slots(options.budget, options.population)
    ]
    return [*_saved_targets(arguments, config, test), *searched]


def _saved_targets(
    arguments: MarkerArguments, config: pytest.Config, test: str
) -> Iterator[Target]:
    options = options_of(config)
    if not options.cases.is_dir() and not options.cases.is_symlink():
        return
    from pytest_garl.scenarios.maps.loading import map_names

    known_maps = map_names(options.map_folders)
    for entry in corpus_of(config).entries(arguments.target.system_name):
        header = entry.header
        if header is None or header.map not in known_maps:
            yield replace(arguments.target, entry=entry)
            continue
        if header.map not in arguments.maps or header.asserting_test not in ("", test):
            continue
        target = replace(arguments.on(header.map), entry=entry)
        yield target
        if header.status == "fixed" and header.live:
            yield replace(target, live=True)


def _repeated_targets(arguments: MarkerArguments, map: str, config: pytest.Config) -> list[Target]:
    options = options_of(config)
    if Path(options.repeat).is_file():
        from pytest_garl.files.toml import parse
        from pytest_garl.scenarios.files import map_name_in

        text = Path(options.repeat).read_text(encoding="utf-8")
        if "violation" in parse(text, options.repeat):
            replay = command("garl", "cases", "replay", options.repeat)
            raise GarlError(
                f"--garl-repeat={options.repeat}: found a saved case, expected a slot or a file "
                f"with a scenario; cases are flown by: {replay}"
            )
        if map_name_in(text, source=options.repeat) != map:
            return []
        return [replace(arguments.on(map), file=options.repeat)]
    stored = repeated_slot_of(config)
    if stored is None or stored.map != map:
        return []
    target = replace(arguments.on(map), slot=stored.slot, stored=stored)
    return [target] if target.stored_flight else []
