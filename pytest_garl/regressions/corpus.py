"""The corpus: the folder of saved cases, one subfolder for each landing system."""

from __future__ import annotations

import dataclasses
import difflib
import functools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import GarlError, ScenarioError
from pytest_garl.files.atomic import alone, save_text
from pytest_garl.messages import printable
from pytest_garl.regressions.case import Case
from pytest_garl.regressions.case_file import CaseHeader, dumps, load, load_header


class CorpusError(GarlError):
    """A folder of cases that cannot be read or written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CorpusEntry:
    """One file of the corpus.

    ``head`` is what collecting needs; the rest of the file is read when somebody asks for it.
    """

    path: Path
    changed: int
    map_folders: tuple[Path, ...]
    head: CaseHeader | None
    fault: str = ""

    @property
    def name(self) -> str:
        """Name in item ids: that of the file."""
        return self.path.stem

    @property
    def case(self) -> Case | None:
        """The case, or None where something is wrong with the file."""
        return None if self.fault else _load(self.path, self.changed, self.map_folders)[0]

    @property
    def problem(self) -> str:
        """What is wrong with the file: source, key, what was expected; nothing for a good one."""
        return self.fault or _load(self.path, self.changed, self.map_folders)[1]


def folder_of(cases: Path, system: str) -> Path:
    """Return where the cases of a system ("module:class") lie: under its module's own name."""
    return cases / system.partition(":")[0].rpartition(".")[2]


def entries(cases: Path, system: str, map_folders: tuple[Path, ...]) -> tuple[CorpusEntry, ...]:
    """Return the files of a system in the order of their names, broken ones among them."""
    _check_link(cases)
    return tuple(
        _of_system(entry, system) for entry in _in_folder(folder_of(cases, system), map_folders)
    )


def every_entry(cases: Path, map_folders: tuple[Path, ...]) -> tuple[CorpusEntry, ...]:
    """Return all files of the corpus, system by system."""
    _check_link(cases)
    try:
        there = sorted(cases.iterdir()) if cases.is_dir() else ()
    except OSError as error:
        raise CorpusError(f"{cases}: cannot be read: {error.strerror}") from error
    folders = [each for each in there if each.is_dir() or each.is_symlink()]
    return tuple(entry for folder in folders for entry in _in_folder(folder, map_folders))


def _check_link(cases: Path) -> None:
    if cases.is_symlink() and not cases.exists():
        raise CorpusError(
            f"{cases}: found a symbolic link that leads nowhere, expected a folder of cases"
        )


def _in_folder(folder: Path, map_folders: tuple[Path, ...]) -> Iterator[CorpusEntry]:
    for path in sorted(folder.glob("*.toml")):
        try:
            changed = path.stat().st_mtime_ns
        except OSError as error:
            if path.is_symlink():
                yield _lost(path, map_folders, str(error.strerror))
            # Else it is gone since it was listed: somebody is cleaning up.
            continue
        yield _read(path, changed, map_folders)
    if folder.is_symlink() and not folder.exists():
        yield _lost(folder, map_folders, "there is no such folder")


def _lost(path: Path, map_folders: tuple[Path, ...], reason: str) -> CorpusEntry:
    """Return an entry that tells of a symbolic link without a file: a case may be lost."""
    fault = (
        f"{path}: cannot be read: found a symbolic link that leads nowhere ({reason}), expected "
        "a file; remove it, or restore what it points to"
    )
    return CorpusEntry(
        path=path, changed=0, map_folders=map_folders, head=None, fault=printable(fault)
    )


@functools.lru_cache(maxsize=10_000)
def _read(path: Path, changed: int, map_folders: tuple[Path, ...]) -> CorpusEntry:
    """Read a file's head once, however many tests fly it."""
    try:
        head, fault = load_header(path), ""
    except ScenarioError as error:
        head, fault = None, str(error)
    return CorpusEntry(path=path, changed=changed, map_folders=map_folders, head=head, fault=fault)


@functools.lru_cache(maxsize=10_000)
def _load(path: Path, changed: int, map_folders: tuple[Path, ...]) -> tuple[Case | None, str]:
    del changed
    try:
        return load(path, map_folders), ""
    except ScenarioError as error:
        return None, str(error)


def _of_system(entry: CorpusEntry, system: str) -> CorpusEntry:
    if entry.head is None or entry.head.system == system:
        return entry
    fault = (
        f"{entry.path}: key 'system': found {entry.head.system!r}, expected {system!r}, the only "
        "system with tests whose cases lie in this folder"
    )
    return dataclasses.replace(entry, head=None, fault=fault)


def known(cases: Path, case: Case, map_folders: tuple[Path, ...]) -> Path | None:
    """Return the file that expects the same failure: system, map, signature and test.

    One that nobody could avoid expects no failure but its own.
    """
    for entry in entries(cases, case.system, map_folders):
        if entry.case is None or not _same(entry.case, case):
            continue
        if entry.case.status == "open" or entry.name == case.id:
            return entry.path
    return None


def _same(one: Case, other: Case) -> bool:
    return _key(one) == _key(other)


def _key(case: Case) -> tuple[str, ...]:
    return (
        case.system,
        case.scenario.map,
        case.violation.signature,
        case.own_test,
        case.assertion,
    )


def save(cases: Path, case: Case, map_folders: tuple[Path, ...] = ()) -> Path | None:
    """Write a new case; return its file, or None where the same failure is known already."""
    folder = folder_of(cases, case.system)
    with alone(folder):
        if known(cases, case, map_folders) is not None:
            return None
        return save_text(folder / f"{case.id}.toml", dumps(case))


def replace(path: Path, case: Case) -> Path:
    """Write a case in place of the one in ``path``, under the name that it should have."""
    with alone(path.parent):
        written = save_text(path.with_name(f"{case.id}.toml"), dumps(case))
        if written != path:
            path.unlink(missing_ok=True)
        return written


def patch_of(path: Path, root: Path, text: str) -> str:
    """Return what ``git apply`` needs to make a new file of the project."""
    name = path.relative_to(root).as_posix()
    lines = text.splitlines(keepends=True)
    body = difflib.unified_diff([], lines, "/dev/null", f"b/{name}")
    return f"diff --git a/{name} b/{name}\nnew file mode 100644\n{''.join(body)}"


def save_patch(folder: Path, cases: Path, root: Path, case: Case) -> Path:
    """Write a patch that adds the case; the tree itself is left alone."""
    path = folder_of(cases, case.system) / f"{case.id}.toml"
    try:
        text = patch_of(path, root, dumps(case))
    except ValueError as error:
        raise CorpusError(f"{cases}: lies outside of the project at {root}: no patch") from error
    return save_text(folder / f"{case.id}.patch", text)
