"""What pytest collected: the test files, and the landing tests in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pytest_garl.cases.case_header import CaseHeader


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectedTest:
    """A test that carries the marker: node id, landing system, all maps of the marker, data files.

    ``name`` is that of the function.  ``data_files`` are the data files of the landing system.
    """

    nodeid: str
    name: str
    system: str
    maps: tuple[str, ...]
    data_files: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectedProject:
    """What a session collected, before any test was deselected.

    ``test_files`` are the files that were collected whole, as in node ids.  ``file_patterns`` and
    ``skipped_folders`` say which files of the project hold tests, as pytest's ini keys
    ``python_files`` and ``norecursedirs``.
    """

    root: Path
    test_files: frozenset[str]
    tests: tuple[CollectedTest, ...]
    file_patterns: tuple[str, ...] = ("test_*.py", "*_test.py")
    skipped_folders: tuple[str, ...] = ()

    def tests_of(self, system: str) -> tuple[CollectedTest, ...]:
        """Return the collected tests of a landing system."""
        return tuple(test for test in self.tests if test.system == system)

    def flies(self, header: CaseHeader) -> bool:
        """Return whether a collected test flies the case with this header."""
        return any(
            header.map in test.maps and header.asserting_test in ("", test.name)
            for test in self.tests_of(header.system)
        )
