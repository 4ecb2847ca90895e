"""The items of a marked test: saved cases, slots of a search, or one repeated scenario."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from dataclasses import replace

import pytest

from pytest_garl.cases.collected_tests import CollectedTest
from pytest_garl.cases.corpus import Corpus, CorpusEntry
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import slots
from pytest_garl.plugin.items.keys import COLLECTED, REPEATED, SLOT_FIXTURE, marker_among
from pytest_garl.plugin.items.marker import MarkerArguments, read_marker
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import Options, options_of

_CORPUS = pytest.StashKey[Corpus]()
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
    config, test = metafunc.config, metafunc.definition
    options = options_of(config)
    arguments = read_marker(marker, options)
    # The census of the saved cases asks which tests there are.
    config.stash[COLLECTED].tests.append(
        CollectedTest(
            nodeid=test.nodeid,
            name=test.originalname,
            system=arguments.target.system_name,
            maps=arguments.maps,
            data_files=arguments.target.files,
        )
    )
    if options.repeat:
        targets = config.stash[REPEATED].targets(arguments.targets)
        reason = f"--garl-repeat={options.repeat}: this test does not fly it"
    else:
        entries = corpus_of(config, options).entries(arguments.target.system_name)
        searched = slots(options.budget, options.population)
        targets = [
            *_saved_targets(entries, arguments, test.originalname),
            *(replace(each, slot=slot) for each in arguments.targets.values() for slot in searched),
        ]
        reason = "no map selected" if options.budget else NOTHING_TO_FLY
    items = [pytest.param(each, id=each.name, marks=_marks(each)) for each in targets]
    nothing = [pytest.param(reason, id="nothing")]
    metafunc.parametrize(SLOT_FIXTURE, items or nothing, indirect=True)


def _marks(target: Target) -> tuple[pytest.MarkDecorator, ...]:
    """Return the mark by which ``-m`` selects saved cases with ``gates = false``."""
    header = target.entry.header if target.entry else None
    return (pytest.mark.garl_gates_nothing,) if header is not None and header.reason else ()


def _saved_targets(
    entries: Iterable[CorpusEntry], arguments: MarkerArguments, test: str
) -> Iterator[Target]:
    """Yield what a test called ``test`` flies of its system's saved cases.

    A case that cannot be read, or that lies on a map that there is no more, is flown by every test
    of the system, and fails.
    """
    for entry in entries:
        header = entry.header
        if header is None or header.map not in arguments.known_maps:
            yield replace(arguments.target, entry=entry)
        elif header.map in arguments.targets and header.asserting_test in ("", test):
            target = replace(arguments.targets[header.map], entry=entry)
            yield target
            if header.status == "fixed" and header.live:
                yield replace(target, live=True)


def corpus_of(config: pytest.Config, options: Options) -> Corpus:
    """Return the session's saved cases, one object that reads each of them once."""
    if _CORPUS not in config.stash:
        config.stash[_CORPUS] = Corpus(options.cases, options.map_folders)
    return config.stash[_CORPUS]
