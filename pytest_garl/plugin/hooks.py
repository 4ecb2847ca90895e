"""The pytest hooks of pytest-garl, and nothing else."""

from __future__ import annotations

import os
from collections.abc import Generator
from typing import Any

import pytest

from pytest_garl.errors import GarlError, check_platform
from pytest_garl.plugin import hookspecs
from pytest_garl.plugin.arguments import (
    add_options,
    check_keys,
    computes,
    flies_itself,
    is_enabled,
)
from pytest_garl.plugin.items.abort import abort_if_fatal, drop_entries_without_line, fail_report
from pytest_garl.plugin.items.keys import (
    BODY_RUNS,
    COLLECTED,
    GATE_PLUGIN,
    LANDING,
    REPEATED,
    RUN,
    TALLY,
    closest_mark,
    is_landing_item,
    marker_among,
    marker_of,
    slot_of,
    takes_landing,
    target_of,
    without_landing,
)
from pytest_garl.plugin.items.lost_cases import Collected
from pytest_garl.plugin.session.fixtures import garl_slot, landing, npcs, scenario
from pytest_garl.plugin.session.tally import Tally, noted_in
from pytest_garl.plugin.xdist import CONTROLLER, SEED, WIDTH, is_xdist_worker

__all__ = ["garl_slot", "landing", "npcs", "scenario"]


def pytest_addoption(parser: pytest.Parser) -> None:
    """Register options and ini keys."""
    add_options(parser)


def pytest_addhooks(pluginmanager: pytest.PytestPluginManager) -> None:
    """Register the hooks that users may implement."""
    pluginmanager.add_hookspecs(hookspecs)


def pytest_load_initial_conftests(early_config: pytest.Config) -> None:
    """Choose the CPU's instructions before a conftest.py loads NumPy, if this process may fly."""
    if computes(early_config):
        from pytest_garl import cpu_dispatch

        cpu_dispatch.pin()
    if flies_itself(early_config):
        from pytest_garl.execution import exit_guard

        exit_guard.install()


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker; read the options and begin the run if the session searches."""
    config.addinivalue_line(
        "markers",
        "garl(system, maps, domain, marker, start, limits, deterministic, files): search for "
        "violations of a landing system. system is its class; maps are names (default: court and "
        "lawn); domain is the name or the TOML file of the conditions in which it is to land; "
        "marker is what lies there, MarkerSpec(dictionary='DICT_5X5_50', id=0, side_m=1.5) "
        "(default: the map's); start is 'ground' (default), 'hover', 'hold' or Start(...); limits "
        "is limits(distance_m=0.75, time_s=120, abort='needless'): how far from the marker and how "
        "late it may land, and when giving up is a violation: if somebody could have landed "
        "('needless'), never ('ok'), always ('violation'); deterministic is False if equal "
        "flights may differ (default: True); files are its data files, which --garl-resume "
        "compares.",
    )
    config.addinivalue_line(
        "markers",
        "garl_gates_nothing: given to the items of saved cases with gates = false; "
        "-m 'not garl_gates_nothing' leaves them out.",
    )
    check_keys(config)
    if config.getini("garl_engine"):
        from pytest_garl import engine

        engine.prefer(config.getini("garl_engine"))
    if not is_xdist_worker(config):
        config.stash[TALLY] = Tally()
        config.pluginmanager.register(config.stash[TALLY], "garl_tally")
    config.stash[COLLECTED] = Collected()
    config.pluginmanager.register(config.stash[COLLECTED], "garl_collected")
    if not is_enabled(config):
        return
    from pytest_garl.plugin.items.option_checks import check_usage
    from pytest_garl.plugin.options import options_of

    options = options_of(config)
    check_usage(options)
    if options.repeat:
        from pytest_garl.plugin.items.repeated import read_repeated

        # An option that cannot be read ends the session before anything is collected or flown.
        config.stash[REPEATED] = read_repeated(options)
    if options.baseline is not None:
        from pytest_garl.plugin.session.baseline_gate import register

        register(config, options)
    if options.budget and not options.repeat and options.probes != "never":
        from pytest_garl.plugin.session.probe_items import ProbesPlugin

        config.pluginmanager.register(ProbesPlugin(options), "garl_probes")
    if options.searches_or_repeats and not config.option.collectonly:
        _begin_run(config, options)


@pytest.hookimpl(wrapper=True)
def pytest_generate_tests(metafunc: pytest.Metafunc) -> Generator[None, object, object]:
    """Make the items of a marked test."""
    marker = closest_mark(metafunc.definition)
    if not takes_landing(metafunc):
        if marker is not None:
            raise pytest.Collector.CollectError(without_landing(metafunc.definition))
        result = yield
        if any(marker_among(call.marks) for call in metafunc._calls):
            raise pytest.Collector.CollectError(without_landing(metafunc.definition))
        return result
    from pytest_garl.plugin.items.collection import make_items

    with make_items(metafunc, marker):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Refuse marked methods of a unittest.TestCase: pytest gives them no parameters."""
    report = yield
    if isinstance(collector, pytest.Class):
        for item in report.result or ():
            if isinstance(item, pytest.Function) and marker_of(item) and slot_of(item) is None:
                report.outcome, report.longrepr = "failed", without_landing(item)
                report.result = []
                break
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(
    session: pytest.Session, config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Put an item before the others for each saved case that nothing can fly any more."""
    collected = config.stash[COLLECTED]
    if collected.tests:
        from pytest_garl.plugin.items.lost_cases import lost_case_items
        from pytest_garl.plugin.options import options_of

        try:
            items[:0] = lost_case_items(session, options_of(config), collected)
        except GarlError as error:
            raise pytest.UsageError(str(error)) from error


@pytest.hookimpl(tryfirst=True)
def pytest_collection_finish(session: pytest.Session) -> None:
    """Tell the run which items are selected; saved cases begin a run here."""
    config = session.config
    if config.option.collectonly:
        return
    if any(slot_of(item) is not None for item in session.items):
        from pytest_garl.plugin.items.item_record import name_slots

        name_slots(session.items)
    if is_enabled(config) and not is_xdist_worker(config):
        from pytest_garl.plugin.items.option_checks import check_selection
        from pytest_garl.plugin.options import options_of

        check_selection(options_of(config), session.items)
    if RUN not in config.stash and any(is_landing_item(item) for item in session.items):
        from pytest_garl.plugin.options import options_of

        _begin_run(config, options_of(config))
    run = config.stash.get(RUN, None)
    if run is not None:
        try:
            run.select(session.items)
        except GarlError as error:
            raise pytest.UsageError(str(error)) from error


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtestloop(session: pytest.Session) -> Generator[None, object, object]:
    """Show the progress line while the tests run."""
    run = session.config.stash.get(RUN, None)
    if run is None:
        return (yield)
    from pytest_garl.plugin.terminal.progress import show_progress
    from pytest_garl.plugin.termination import telling_workers

    with show_progress(run, session.config), telling_workers(run.ledger):
        result = yield
    run.loop_finished = True
    return result


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> Generator[None, Any, Any]:
    """End a test before its body runs if no assertion can judge its flight."""
    pyfuncitem.stash[BODY_RUNS] = True
    try:
        if LANDING in pyfuncitem.stash:
            from pytest_garl.plugin.session.item_report import end_unjudged

            end_unjudged(pyfuncitem)
        return (yield)
    finally:
        pyfuncitem.stash[BODY_RUNS] = False


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Decide the outcome of a landing item, and write it into the report."""
    report = yield
    target = target_of(item)
    run = item.config.stash.get(RUN, None)
    if target is not None and run is not None and (report.when == "call" or report.skipped):
        from pytest_garl.plugin.session.item_report import report_item

        try:
            if report.when == "call":
                report_item(report, item, run, target, call.excinfo.value if call.excinfo else None)
            run.ledger.facts.note_ran(item.nodeid)
        except GarlError as error:
            fail_report(report, error)
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """End a session without ledger; note the findings of xdist's workers."""
    worker = getattr(report, "node", None)
    run = worker.config.stash.get(RUN, None) if worker is not None else None
    record = noted_in(report)
    if record is not None:
        abort_if_fatal(record)
        if run is not None and record.savable:
            run.note_finding_test(record.search, record.failure_signature, report.nodeid)
            if record.user_message is not None:
                run.reported_failures[report.nodeid] = record.failure_signature
    if run is not None and run.investigations is not None:
        _investigate(run)


def _investigate(run: Any) -> None:
    """Go on with investigations in xdist's controller, which waits for no flight."""
    try:
        run.investigations.advance()
    except GarlError as error:
        run.save_problem = str(error)


@pytest.hookimpl(tryfirst=True)
def pytest_keyboard_interrupt(excinfo: pytest.ExceptionInfo[BaseException]) -> None:
    """See that pytest can show where it was interrupted, and then its summary."""
    drop_entries_without_line(excinfo.value)


def pytest_report_header(config: pytest.Config) -> str | None:
    """Announce the search and its time."""
    run = config.stash.get(RUN, None)
    if run is None:
        return None
    from pytest_garl.plugin.terminal.header import header

    return header(run, config)


def pytest_report_collectionfinish(config: pytest.Config) -> list[str]:
    """Announce time and limits; warn if git cannot tell which cases are committed."""
    run = config.stash.get(RUN, None)
    if run is None:
        return []
    from pytest_garl.plugin.terminal.header import (
        acceptance_warning,
        domain_lines,
        forecast,
        limits_lines,
    )

    return [*forecast(run), *domain_lines(run), *limits_lines(run), *acceptance_warning(run)]


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Write the findings of each landing system on each map."""
    tally = config.stash[TALLY]
    if not (RUN in config.stash or tally.items or tally.problems):
        return
    from pytest_garl.plugin.terminal.terminal_summary import write_summary

    write_summary(terminalreporter, config, tally)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Save cases of new violations, and set the exit status."""
    stash = session.config.stash
    run, tally = stash.get(RUN, None), stash.get(TALLY, None)
    gate: Any = session.config.pluginmanager.get_plugin(GATE_PLUGIN)
    nothing_compared = gate is not None and gate.note_missing_gate(session)
    if run is not None:
        _save_cases(run, session, nothing_compared=nothing_compared)
    if run is not None or gate is not None or is_enabled(session.config) or (tally and tally.items):
        from pytest_garl.plugin.options import options_of
        from pytest_garl.plugin.session.session_status import set_exit_status

        options = options_of(session.config)
        set_exit_status(session, run, tally, options, nothing_compared=nothing_compared)


def _save_cases(run: Any, session: pytest.Session, *, nothing_compared: bool) -> None:
    try:
        from pytest_garl.plugin.terminal.kind_news import write_last_news
        from pytest_garl.plugin.terminal.save_cases import may_save, save_archive, save_cases

        write_last_news(run, session.config)
        save_archive(run, session)
        if may_save(run, session) and not nothing_compared:
            save_cases(run, session)
    except Exception as error:  # noqa: BLE001 (the summary, which follows, says what it was)
        from pytest_garl.plugin.session.session_status import problem_text

        # Without its ledger, for example, a session saves nothing.
        run.save_problem = run.save_problem or problem_text("what is saved", error)
    finally:
        run.end_flights()


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the workers and close the ledger."""
    run = config.stash.get(RUN, None)
    if run is not None:
        run.close()
    if flies_itself(config):
        from pytest_garl.execution import exit_guard

        exit_guard.uninstall()


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Give an xdist worker the run's process and seed, so that a random seed is drawn once."""
    from pytest_garl.plugin.terminal_text import width_of

    node.workerinput[CONTROLLER] = str(os.getpid())
    node.workerinput[WIDTH] = width_of(node.config)
    run = node.config.stash.get(RUN, None)
    if run is not None:
        node.workerinput[SEED] = str(run.options.seed)


def _begin_run(config: pytest.Config, options: Any) -> None:
    """Begin the run, unless this system cannot fly: then the modules could not even be imported."""
    try:
        check_platform()
    except GarlError as error:
        raise pytest.UsageError(str(error)) from error
    from pytest_garl.plugin.session.startup import begin_run

    begin_run(config, options)
