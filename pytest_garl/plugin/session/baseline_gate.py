"""The gate against a baseline: one item per landing system and map flies all its scenarios."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

import pytest

from pytest_garl.engine import chosen
from pytest_garl.errors import GarlError
from pytest_garl.gate.baseline_file import Baseline, BaselineSet, load_baseline
from pytest_garl.gate.comparison import Comparison
from pytest_garl.gate.comparison_text import report_lines, summary_lines
from pytest_garl.gate.compatibility import environment_changes, incompatibilities
from pytest_garl.gate.gate import compare_flights
from pytest_garl.gate.pairs import PairResult
from pytest_garl.messages import command
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.plugin.items.abort import abort_session
from pytest_garl.plugin.items.item_record import ItemRecord
from pytest_garl.plugin.items.keys import GATE_PLUGIN, RUN, marker_of
from pytest_garl.plugin.items.marker import read_marker
from pytest_garl.plugin.items.target import Target
from pytest_garl.plugin.options import Options
from pytest_garl.plugin.session.run import Run
from pytest_garl.plugin.xdist import is_xdist_worker


def register(config: pytest.Config, options: Options) -> None:
    """Add the gate to a session; raise UsageError if the file is no baseline."""
    assert options.baseline is not None
    try:
        baseline, engine = load_baseline(options.baseline, options.map_folders), chosen()
    except GarlError as error:
        raise pytest.UsageError(f"--garl-baseline: {error}") from error
    if baseline.engine != engine:
        raise pytest.UsageError(
            f"--garl-baseline={options.baseline}: found a baseline of the physics engine "
            f"{baseline.engine}, expected one of {engine}, which flies here: results of two "
            f"engines are no fair comparison. Set garl_engine = {baseline.engine}, or save a "
            "baseline here with `garl baseline save`"
        )
    config.pluginmanager.register(
        BaselineGatePlugin(options, options.baseline, baseline), GATE_PLUGIN
    )


class BaselineGateItem(pytest.Item):
    """Flies one set of the baseline and fails if the landing system is worse."""

    fixturenames: tuple[str, ...] = ()
    """Hooks of projects ask every item for it."""

    def __init__(self, *, target: Target, base: BaselineSet, **rest: Any) -> None:
        super().__init__(**rest)
        self.garl_gate = base
        self._target = target
        ItemRecord(gate=base.title).add_to(self)

    def runtest(self) -> None:
        """Fly and compare."""
        from pytest_garl.scenarios.maps.loading import load_map

        run: Run = self.config.stash[RUN]
        base = self.garl_gate
        try:
            npcs = policy_spec(base.npcs)
            job = run.searches.job(self._target, npcs)
            differing = incompatibilities(base, job, self._target.task)
            if differing:
                self._refuse(differing)
            comparison = compare_flights(
                base,
                run.fly_all(self._target, npcs, [each.scenario for each in base.flights]),
                load_map(base.map, run.options.map_folders),
                lambda scenarios: run.fly_all(self._target, npcs, scenarios),
                level=run.options.level,
                expected_signatures=run.expected_signatures(self._target),
            )
        except GarlError as error:
            abort_session(self, error)
        warning = [f"note: {base.warning}"] if base.warning else []
        hint = self._hint(comparison, run.options.baseline)
        lines = (*report_lines(comparison), *hint, *warning)
        found = "" if comparison.passed else "the gate failed"
        ItemRecord(gate_report=lines, found=found).add_to(self)
        if not comparison.passed:
            # The summary lists the pairs, so the failure does not.
            pytest.fail("\n".join(summary_lines(comparison)), pytrace=False)

    def _refuse(self, differing: Sequence[str]) -> NoReturn:
        """Fail because the landing system is not flown as the baseline was."""
        lines = (
            f"gate FAILED: no fair comparison, {'; '.join(differing)}",
            "If the difference is intended, save a new baseline.",
        )
        ItemRecord(gate_report=lines, found="the gate refused to compare").add_to(self)
        pytest.fail("\n".join(lines), pytrace=False)

    def _hint(self, comparison: Comparison, file: Path | None) -> Iterator[str]:
        """Yield the command that flies the first pair that is worse."""
        worse: tuple[PairResult, ...] = ("broke", "changed")
        names = [pair.name for result in worse for pair in comparison.with_result(result)]
        names += [each.worst[0] for each in comparison.sizes if comparison.is_significant(each)]
        if names:
            yield (
                f"fly it: {command('garl', 'baseline', 'scenario', file, names[0])} > one.toml; "
                + command("pytest", "--garl-repeat=one.toml", f"--garl-npcs={self.garl_gate.npcs}")
            )

    def reportinfo(self) -> tuple[os.PathLike[str] | str, int | None, str]:
        """Return the item's file and name; pytest names the first line if a mark skips it."""
        return self.path, 0, self.name


class BaselineGatePlugin:
    """The hooks of a session with a baseline."""

    def __init__(self, options: Options, file: Path, baseline: Baseline) -> None:
        self._options, self._file, self._baseline = options, file, baseline
        self._gates_made: set[tuple[str, str, str]] = set()
        self._gate_reports: dict[str, ItemRecord] = {}
        self._problem = ""
        self._skipped: list[str] = []

    @pytest.hookimpl(wrapper=True)
    def pytest_pycollect_makeitem(
        self, collector: pytest.Module | pytest.Class
    ) -> Generator[None, Any, Any]:
        """Put a gate before the first marked test of each module, for each of its maps."""
        made = yield
        if not isinstance(made, list):
            return made
        # Parameters may have marks of their own; all slots of one share it.
        marks = {id(mark): mark for item in made if (mark := marker_of(item)) is not None}
        gates = [gate for mark in marks.values() for gate in self._gates(collector, mark)]
        return [*gates, *made]

    def _gates(
        self, collector: pytest.Module | pytest.Class, marker: pytest.Mark
    ) -> Iterator[BaselineGateItem]:
        try:
            marked = read_marker(marker, self._options)
        except GarlError as error:
            raise pytest.Collector.CollectError(f"{collector.nodeid}: {error}") from error
        for map, target in marked.targets.items():
            base = self._baseline.find(target.system_name, map)
            gate = (str(collector.path), target.system_name, map)
            if base is not None and gate not in self._gates_made:
                self._gates_made.add(gate)
                yield BaselineGateItem.from_parent(
                    collector,
                    name=f"baseline[{base.title}]",
                    target=target,
                    base=base,
                )

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Refuse to begin if the command line asks for a gate and no selected test has one."""
        worker = is_xdist_worker(session.config)
        if not worker and not any(isinstance(item, BaselineGateItem) for item in session.items):
            problem = self._missing_gate()
            if problem:
                raise pytest.UsageError(problem)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember the lines that a gate reports."""
        record = ItemRecord.of(report)
        if record.gate_report and report.when == "call":
            self._gate_reports[report.nodeid] = record
        if record.gate and report.skipped and report.when == "setup":
            self._skipped.append(report.nodeid)

    def note_missing_gate(self, session: pytest.Session) -> bool:
        """Note whether a gate is missing: skipped, or not there.

        Under xdist the workers alone know the items.
        """
        if self._gate_reports or session.config.option.collectonly:
            return False
        if session.exitstatus in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            self._problem = self._missing()
        return bool(self._problem)

    def _missing_gate(self) -> str:
        """Return what is wrong with a session without a gate; an ini key does not demand one."""
        if "baseline" not in self._options.given:
            return ""
        wanted = ", ".join(f"{each.system} on {each.map}" for each in self._baseline.sets)
        return (
            f"--garl-baseline={self._file}: nothing to compare: it holds {wanted}, and no selected "
            "test is marked with one of these"
        )

    def _missing(self) -> str:
        """Return what is wrong with a session that has compared nothing."""
        if "baseline" in self._options.given and self._skipped:
            names = ", ".join(self._skipped)
            return (
                f"--garl-baseline={self._file}: nothing was compared: {names} was skipped, by a "
                "mark of its module or by a hook"
            )
        return self._missing_gate()

    def pytest_report_header(self) -> str:
        """Return how many flights the gate compares."""
        sets = ", ".join(f"{len(each.flights)} of {each.title}" for each in self._baseline.sets)
        return f"garl: gate against {self._file}: {sets}, level {self._options.level:g}"

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        """Write what each gate reports."""
        if not self._gate_reports and not self._problem:
            return
        terminalreporter.section("garl: baseline", sep="=")
        if self._problem:
            terminalreporter.write_line(self._problem, red=True)
        for note in environment_changes(self._baseline):
            terminalreporter.write_line(f"note: {note}; it may be the cause of differences")
        titles = {record.gate for record in self._gate_reports.values()}
        for each in self._baseline.sets:
            if each.title not in titles:
                terminalreporter.write_line(f"note: {each.title} was not flown")
        for _, record in sorted(self._gate_reports.items()):
            result, *lines = record.gate_report
            terminalreporter.write_line(f"{record.gate}: {result}")
            for line in lines:
                terminalreporter.write_line(f"    {line}")
