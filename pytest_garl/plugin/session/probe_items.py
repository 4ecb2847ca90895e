"""Probes before a search: one item per landing system flies them, before the first slot.

Their flights are no flights of the search: its budget, its counts and its hash do not hold them.  A
probe that violates is followed up after the session as a violation of the search is.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from pytest_garl.cases.corpus import Corpus
from pytest_garl.engine import chosen
from pytest_garl.errors import GarlError
from pytest_garl.execution.flight_id import FIRST_SLOT, CompletedFlight, search_key
from pytest_garl.execution.job import parse_job
from pytest_garl.execution.ledger import Ledger
from pytest_garl.execution.reference import package_sha256
from pytest_garl.execution.sources import combined_sha256, data_files, source_hashes
from pytest_garl.files.atomic import locked, write_text_atomically
from pytest_garl.flight.flight_file import load
from pytest_garl.landing_system import Airframe
from pytest_garl.messages import command
from pytest_garl.npcs.domain_policy import NOBODY
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.plugin.items.abort import abort_session
from pytest_garl.plugin.items.item_record import ItemRecord
from pytest_garl.plugin.items.keys import RUN, target_of
from pytest_garl.plugin.items.suggested_commands import shown_path
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.terminal_text import counted
from pytest_garl.scenarios.conditions import active_conditions
from pytest_garl.scenarios.domains.own_navigation import within
from pytest_garl.scenarios.files import dumps
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.shrinking.case_request import CaseRequest
from pytest_garl.triage.new_signatures import request_of
from pytest_garl.verdicts.verdict import Verdict
from pytest_garl.verdicts.wording import headline

if TYPE_CHECKING:
    from pytest_garl.search.probes import Probe

PASSED = "probes.json"
"""The file beside the ledger that names the landing systems whose probes have passed."""


class ProbesPlugin:
    """The hook of a session that searches: puts the probes before the selected tests."""

    def __init__(self, options: Options) -> None:
        self._options = options

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(
        self, config: pytest.Config, items: list[pytest.Item]
    ) -> None:
        """Add the items when ``-k`` and the like have selected those that search.

        A simulator of the user's own need not know the conditions of probes.
        """
        if not config.hook.pytest_garl_fly(config=config):
            run = config.stash.get(RUN, None)
            passed = passed_before(run.ledger if run is not None else None, self._options.folder)
            probes = list(probe_items(self._options, items, passed))
            items[:0] = probes
            reporter: Any = config.pluginmanager.get_plugin("terminalreporter")
            if reporter is not None:
                # pytest says how many items its collectors yield; these come behind them.
                reporter._numcollected += len(probes)


def probe_items(
    options: Options, items: Sequence[pytest.Item], passed: Collection[str]
) -> Iterator[pytest.Item]:
    """Yield an item for each landing system that the selected items search for violations.

    With ``garl_probes = first`` none for a system whose probes have ``passed`` with its present
    sources.
    """
    names: set[str] = set()
    for target, module in _searched(options, items):
        name = f"probes[{target.system.__name__}]"
        while name in names:
            name += "+"
        names.add(name)
        if options.probes == "always" or _key(options, target) not in passed:
            yield ProbesItem.from_parent(module, name=name, target=target)


class ProbesItem(pytest.Item):
    """Flies the probes of a landing system, and fails if one violates."""

    fixturenames: tuple[str, ...] = ()
    """Hooks of projects ask every item for it."""

    def __init__(self, *, target: Target, **rest: Any) -> None:
        super().__init__(**rest)
        self._target = target

    def runtest(self) -> None:
        """Fly the system in clear air, and then its probes."""
        run: Run = self.config.stash[RUN]
        try:
            flown = _Flown(run, self._target)
            flown.note()
        except GarlError as error:
            abort_session(self, error)
        if flown.problem:
            pytest.skip(flown.problem)
        lines = [each.line for each in flown.results]
        self.add_report_section("call", "stdout", "\n".join(lines))
        if not flown.violated:
            _note_passed(run.options, self._target)
            return
        system, map = self._target.system.__name__, self._target.map
        number = f"{len(flown.violated)} of {counted(len(lines), 'probe')}"
        ItemRecord(
            found=f"violates {number}",
            violated_probes=tuple(f"{system} on {map}: {each.line}" for each in flown.violated),
        ).add_to(self)
        lines = [f"{system} violates {number} on {map}:", *lines]
        place = load_map(map, run.options.map_folders)
        for each in flown.violated:
            file = write_text_atomically(
                run.options.folder / "probes" / f"{map}-{each.probe.name}.toml",
                dumps(each.probe.scenario, place),
            )
            repeat = f"--garl-repeat={shown_path(file, self.config)}"
            lines.append(f"fly it: {command('pytest', shown_path(self.path, self.config), repeat)}")
        pytest.fail("\n".join(lines), pytrace=False)

    def reportinfo(self) -> tuple[os.PathLike[str] | str, int | None, str]:
        """Return the item's file and name; pytest names the first line if a mark skips it."""
        return self.path, 0, self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class _Result:
    """A flown probe, and the file of the known case that excuses it; empty if none does."""

    probe: Probe
    flight: CompletedFlight
    known: str

    @property
    def verdict(self) -> Verdict:
        """The verdict on its flight."""
        return self.flight.result.verdict

    @property
    def violated(self) -> bool:
        """Whether it violates what may be asked, and no known case excuses it."""
        excused = self.probe.outside or self.known
        return self.probe.is_violated(self.verdict) and not excused

    @property
    def line(self) -> str:
        """How it ended."""
        colour = "ok"
        if self.probe.is_violated(self.verdict):
            colour = f"known, {self.known}" if self.known else "FAILED"
            colour = "outside the domain" if self.probe.outside else colour
        probe = self.probe
        return f"{probe.name}: {colour}: {probe.sentence}: {probe.ending(self.verdict)}"


class _Flown:
    """The flown probes of a landing system; ``problem`` is why there are none."""

    def __init__(self, run: Run, target: Target) -> None:
        self._run, self._target = run, target
        self.results: list[_Result] = []
        self.problem = ""
        map = load_map(target.map, run.options.map_folders)
        domain = within(target.domain, target.navigation)
        from pytest_garl.search.probes import clear_scenario, probes_for, start_beside

        clear = clear_scenario(map, target.task, domain)
        beside = start_beside(clear, map, domain)
        first, second = self._fly([clear, beside.scenario])
        if not _has_landed(first):
            story = headline(first.result.verdict.story)
            holds = target.task.start.holds
            what = "the marker is not its target" if holds else "it does not land"
            self.problem = f"no probes: {what} in clear air: {story}"
            return
        base, twin = (second, beside.scenario) if _has_landed(second) else (first, clear)
        camera = (target.airframe or Airframe()).camera
        others = [
            probe
            for probe in probes_for(load(base.record), twin, map, domain, target.limits, camera)
            if probe.scenario not in (clear, beside.scenario)
        ]
        flights = (second, *self._fly([probe.scenario for probe in others]))
        for probe, flight in zip((beside, *others), flights, strict=True):
            alike = run.corpus, target.system_name, flight.signature
            known = excusing_case(*alike, probe.scenario, twin)
            self.results.append(_Result(probe=probe, flight=flight, known=known))

    @property
    def violated(self) -> list[_Result]:
        """The probes that violate what may be asked, and that no known case excuses."""
        return [each for each in self.results if each.violated]

    def note(self) -> None:
        """Note in the ledger which flights violate, for the process that saves cases."""
        flights = [each.flight for each in self.violated]
        found = [(each.signature, each.sha256) for each in flights if each.sha256]
        if found:
            self._run.ledger.facts.note_violated_probes(self._target.search, found)

    def _fly(self, scenarios: Sequence[Scenario]) -> Sequence[CompletedFlight]:
        return self._run.fly_all(self._target, policy_spec(NOBODY), scenarios)


def probe_requests(ledger: Ledger, budget: int) -> tuple[CaseRequest, ...]:
    """Return the requests for cases of the probes that violated, by signature.

    A search may have found the same signature; its cause is another one as a rule.
    """
    requests: dict[str, CaseRequest] = {}
    for search, _ in ledger.searches():
        for signature, sha256 in ledger.facts.violated_probes(search):
            flight = ledger.queries.flight_with_hash(sha256, signature=signature)
            job = ledger.job(flight.id.search) if flight is not None else None
            if flight is None or job is None:
                continue
            request = request_of(search, signature, [flight], parse_job(job), budget)
            name = f"{request.name} in probes"
            requests.setdefault(name, replace(request, name=name))
    return tuple(requests.values())


def _searched(
    options: Options, items: Sequence[pytest.Item]
) -> Iterator[tuple[Target, pytest.Module]]:
    """Yield each landing system with each of its tasks, on one map, and the module of its tests."""
    found: dict[Target, tuple[list[str], pytest.Module]] = {}
    for item in items:
        target, module = target_of(item), item.getparent(pytest.Module)
        if target is not None and target.is_searched and module is not None:
            key = replace(target, slot=FIRST_SLOT, map="")
            maps, _ = found.setdefault(key, ([], module))
            if target.map not in maps:
                maps.append(target.map)
    for target, (maps, module) in found.items():
        # Probes need the camera, which a run without them does not import.
        from pytest_garl.search.probes import probed_map

        map = probed_map([load_map(name, options.map_folders) for name in maps])
        yield replace(target, map=map.name), module


def _has_landed(flight: CompletedFlight) -> bool:
    verdict = flight.result.verdict
    return verdict.completed and not verdict.violation


def excusing_case(corpus: Corpus, system: str, ending: str, probe: Scenario, twin: Scenario) -> str:
    """Return the file of a known case with the ending and the causes of a probe; empty if none."""
    for entry in corpus.entries(system):
        case = entry.case
        if (
            case is not None
            and case.expects_signature
            and case.ending == ending
            and corpus.is_accepted(entry)
            and has_cause_of(case.scenario, probe, twin)
        ):
            return entry.path.name
    return ""


def has_cause_of(case: Scenario, probe: Scenario, twin: Scenario) -> bool:
    """Whether a case has the cause of a probe, which its twin has not, and no other one."""
    own = _causes(probe) - _causes(twin)
    causes = _causes(case)
    return causes <= _causes(probe) and (own <= causes or not own)


def _causes(scenario: Scenario) -> set[str]:
    """Return what is not nominal in a scenario; all decoys are one cause."""
    return {each.cause.partition("-")[0] for each in active_conditions(scenario)}


def _key(options: Options, target: Target) -> str:
    """Return what stands for a landing system, its task and its present sources."""
    sources = source_hashes(target.system, data_files(target.files, options.root))
    return search_key(
        json.dumps([target.search, combined_sha256(sources), package_sha256(), chosen()])
    )


def passed_before(ledger: Ledger | None, folder: Path) -> list[str]:
    """Return what had passed when the session began.

    All workers of xdist must collect the same items, also one that replaces another one later.
    """
    known = _passed(folder)
    return known if ledger is None else [*ledger.facts.first_passed_probes(known)]


def _passed(folder: Path) -> list[str]:
    try:
        known = json.loads((folder / PASSED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return [str(each) for each in known] if isinstance(known, list) else []


def _note_passed(options: Options, target: Target) -> None:
    # Another worker of xdist may note another landing system.
    with locked(options.folder):
        keys = {*_passed(options.folder), _key(options, target)}
        write_text_atomically(options.folder / PASSED, json.dumps(sorted(keys)))
