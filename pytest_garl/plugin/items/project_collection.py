"""Collect the landing tests of a whole project with pytest, in a process of its own.

This module is also the plugin of that process: it chooses the files and writes what was collected.
"""

from __future__ import annotations

import dataclasses
import json
import os
import tempfile
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from pytest_garl.cases.case_test_run import end_of, ini_options, run_pytest
from pytest_garl.cases.census import marked_test_files
from pytest_garl.cases.collected_tests import CollectedProject, CollectedTest
from pytest_garl.errors import GarlError
from pytest_garl.execution.reference import BUILT_IN, Reference, reference_to
from pytest_garl.plugin.items.collection import corpus_of
from pytest_garl.plugin.items.keys import COLLECTED
from pytest_garl.plugin.items.lost_cases import project_of
from pytest_garl.plugin.options import options_of

_BROKEN = pytest.StashKey[dict[str, str]]()


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectTests:
    """The landing tests of a project, and the folder of the saved cases.

    ``broken`` are the test files that cannot be collected, with the reason; ``simulator`` is the
    project's own or the built-in one.
    """

    cases: Path
    collection: CollectedProject
    simulator: Reference
    broken: tuple[tuple[str, str], ...]


def collect_project(root: Path, cases: Path | None) -> ProjectTests:
    """Return the landing tests of the project in ``root``.

    ``cases`` is the folder of the saved cases; None for that of the ini key.  A file that cannot
    be collected beside the others, such as a second one of the same name, is collected alone.
    Raises GarlError if pytest itself fails.
    """
    found = _collect(root, cases, ())
    if len(found.collection.test_files) + len(found.broken) < 2:
        return found
    for file, _ in found.broken:
        alone = _collect(root, cases, (file,))
        found = dataclasses.replace(
            found,
            collection=dataclasses.replace(
                found.collection,
                test_files=found.collection.test_files | alone.collection.test_files,
                tests=(*found.collection.tests, *alone.collection.tests),
            ),
            broken=tuple(each for each in found.broken if each[0] != file) + alone.broken,
        )
    return found


def _collect(root: Path, cases: Path | None, files: tuple[str, ...]) -> ProjectTests:
    with tempfile.TemporaryDirectory(prefix="garl-") as scratch:
        target = Path(scratch, "collected.json")
        arguments = [
            *("-p", __name__, "--collect-only", "-q", "--maxfail=0", f"--garl-collected={target}"),
            *(f"--garl-collect={file}" for file in files),
            *ini_options(Path(scratch), cases),
        ]
        done = run_pytest(arguments, root)
        if not target.is_file():
            raise GarlError(f"pytest could not collect the landing tests {end_of(done)}")
        return _read(json.loads(target.read_text(encoding="utf-8")))


def _read(found: dict[str, Any]) -> ProjectTests:
    facts = found["collection"]
    return ProjectTests(
        cases=Path(found["cases"]),
        collection=CollectedProject(
            root=Path(facts["root"]),
            test_files=frozenset(facts["test_files"]),
            tests=tuple(_read_test(**each) for each in facts["tests"]),
            file_patterns=tuple(facts["file_patterns"]),
            skipped_folders=tuple(facts["skipped_folders"]),
        ),
        simulator=Reference(**found["simulator"]),
        broken=tuple(found["broken"].items()),
    )


def _read_test(maps: list[str], data_files: list[str], **texts: str) -> CollectedTest:
    return CollectedTest(maps=tuple(maps), data_files=tuple(data_files), **texts)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Register the options of this process."""
    parser.addoption("--garl-collected", help="Write what was collected into this file.")
    parser.addoption("--garl-collect", action="append", help="Collect only this test file.")


@pytest.hookimpl(trylast=True)
def pytest_configure(config: pytest.Config) -> None:
    """Collect the files that hold the marker, and those that cases name."""
    config.stash[_BROKEN] = {}
    root, options = config.rootpath, options_of(config)
    files = config.getoption("--garl-collect")
    if not files:
        saved = corpus_of(config, options).all_entries() if options.cases.is_dir() else ()
        patterns, skipped = config.getini("python_files"), config.getini("norecursedirs")
        named = [
            entry.header.test.partition("::")[0]
            for entry in saved
            if entry.header is not None and "::" in entry.header.test
        ]
        files = [*marked_test_files(root, patterns, skipped), *named]
    config.args = [str(root / file) for file in sorted({*files}) if (root / file).is_file()]
    # Without an argument pytest would collect everything.
    config.args = config.args or [os.devnull]


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Note why a file cannot be collected."""
    report = yield
    if report.failed and report.nodeid:
        lines = [line[1:].strip() for line in report.longreprtext.splitlines() if line[:1] == "E"]
        reason = lines[-1] if lines else report.longreprtext.strip().partition("\n")[0]
        collector.config.stash[_BROKEN][report.nodeid.partition("::")[0]] = reason
    return report


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config) -> None:
    """Write what was collected; a collection that a usage error or an exit ends writes nothing."""
    options, own = options_of(config), config.hook.pytest_garl_fly(config=config)
    collection = project_of(config, options, config.stash[COLLECTED])
    found = {
        "cases": str(options.cases),
        "collection": {
            "root": str(collection.root),
            "test_files": sorted(collection.test_files - {*config.stash[_BROKEN]}),
            "tests": [dataclasses.asdict(test) for test in collection.tests],
            "file_patterns": collection.file_patterns,
            "skipped_folders": collection.skipped_folders,
        },
        "simulator": dataclasses.asdict(reference_to(own) if own else BUILT_IN),
        "broken": config.stash[_BROKEN],
    }
    Path(config.getoption("--garl-collected")).write_text(json.dumps(found), encoding="utf-8")
