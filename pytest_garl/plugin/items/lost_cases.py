"""Items that fail because nothing can fly a saved case, or a file that should be one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from pytest_garl.plugin.xdist import is_xdist_worker

if TYPE_CHECKING:
    from pytest_garl.cases.collected_tests import CollectedProject, CollectedTest
    from pytest_garl.plugin.options import Options


class Collected:
    """A plugin that notes which files and landing tests a session collects.

    Every pytest run has one, so it imports nothing.
    """

    def __init__(self) -> None:
        self.files: set[str] = set()
        self.tests: list[CollectedTest] = []

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Note a file; one that is skipped or broken has tests that are not known."""
        if report.passed and report.nodeid.endswith(".py"):
            self.files.add(report.nodeid)


class LostCaseItem(pytest.Item):
    """An item that fails with the reason why nothing flies a file of the corpus."""

    reason: str
    fixturenames: tuple[str, ...] = ()
    """Hooks of projects ask every item for it."""

    def runtest(self) -> None:
        """Fail."""
        pytest.fail(self.reason, pytrace=False)

    def reportinfo(self) -> tuple[os.PathLike[str] | str, int | None, str]:
        """Return the item's file and name; pytest names the first line if a mark skips it."""
        return self.path, 0, self.nodeid


class _LostFile(pytest.File):
    """A file of the corpus that is no collector of tests, but the parent of one item."""

    def collect(self) -> Iterator[pytest.Item]:
        """Return nothing: the item is made beside the collection."""
        return iter(())


def lost_case_items(
    session: pytest.Session, options: Options, collected: Collected
) -> list[pytest.Item]:
    """Return an item for each file of the corpus that nothing can fly any more.

    A session of single node ids, of `--lf` or of one repeated scenario is not asked: it leaves out
    tests on purpose.  Raises UsageError if the folder of the corpus is named and missing; xdist's
    workers, which cannot end the session, get an item.
    """
    config = session.config
    partial = any("::" in arg for arg in config.args) or config.getoption("lf", default=False)
    if partial or options.repeat or not collected.tests:
        return []
    missing = missing_folder(options)
    if missing and not is_xdist_worker(config):
        raise pytest.UsageError(missing)
    if missing:
        return [_item(session, options.cases, missing)]
    from pytest_garl.cases.census import census
    from pytest_garl.plugin.items.collection import corpus_of

    lost = census(corpus_of(config, options), project_of(config, options, collected))
    return [_item(session, each.path, each.reason) for each in lost]


def missing_folder(options: Options) -> str:
    """Return what is wrong if the ini key names a folder of cases that does not exist.

    A search makes the folder when it saves its first case.
    """
    if not options.cases_named or options.searches_or_repeats:
        return ""
    if options.cases.is_dir() or options.cases.is_symlink():
        return ""
    return (
        f"garl_cases: there is no folder {options.cases}, so no saved case can be flown; correct "
        "the ini key, or make the folder if its first cases are still to come"
    )


def project_of(config: pytest.Config, options: Options, collected: Collected) -> CollectedProject:
    """Return what a session collected."""
    from pytest_garl.cases.collected_tests import CollectedProject

    return CollectedProject(
        root=options.root,
        test_files=frozenset(collected.files),
        tests=tuple(collected.tests),
        file_patterns=tuple(config.getini("python_files")),
        skipped_folders=tuple(config.getini("norecursedirs")),
    )


def _item(session: pytest.Session, path: Path, reason: str) -> LostCaseItem:
    from pytest_garl.plugin.items.item_record import ItemRecord

    file = _LostFile.from_parent(session, path=path)
    item = LostCaseItem.from_parent(file, name="lost")
    item.reason = reason
    # `-m garl` selects it, as the tests that should fly the case.
    item.add_marker("garl")
    lost = f"{item.nodeid.partition('::')[0]}: {reason}"
    ItemRecord(lost=lost, found="nothing flies this case").add_to(item)
    return item
