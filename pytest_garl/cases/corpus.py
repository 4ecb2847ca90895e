"""The corpus: the folder of saved cases, one subfolder for each landing system; accepted cases."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import dump_case, load_case
from pytest_garl.cases.case_header import CaseHeader, load_header
from pytest_garl.cases.shrunk_cause import cause_of_case
from pytest_garl.cases.worst import worst_in
from pytest_garl.errors import CorpusError, ScenarioError
from pytest_garl.files.atomic import locked, write_text_atomically
from pytest_garl.messages import printable
from pytest_garl.scenarios.maps.loading import load_map


@dataclasses.dataclass(frozen=True, kw_only=True)
class CorpusEntry:
    """One file of the corpus.

    Its header is enough to collect tests.  The rest is read when it is asked for.
    """

    path: Path
    changed_ns: int
    map_folders: tuple[Path, ...]
    header: CaseHeader | None
    """The facts above the first table, or None if something is wrong with them."""
    header_problem: str = ""
    """What is wrong with them, or why there is no file."""

    @property
    def name(self) -> str:
        """The name in item ids: that of the file."""
        return self.path.stem

    @property
    def case(self) -> Case | None:
        """The case, or None if something is wrong with the file."""
        return self._content[0]

    @property
    def problem(self) -> str:
        """The problem of the file, with source, key and expected value; empty for a good file."""
        return self._content[1]

    @functools.cached_property
    def _content(self) -> tuple[Case | None, str]:
        if self.header is None:
            return None, self.header_problem
        try:
            return load_case(self.path, self.map_folders), ""
        except ScenarioError as error:
            return None, str(error)


class Corpus:
    """The saved cases of a project.

    A folder is listed once, and a file is read at most once, however many tests fly its case.
    Saving looks at the folder again: another process may have saved the same case.  Methods that
    list, read or write raise CorpusError or SavingError if that cannot be done.
    """

    def __init__(self, folder: Path, map_folders: tuple[Path, ...] = ()) -> None:
        self.folder, self.map_folders = folder, map_folders
        self._entries: dict[Path, CorpusEntry] = {}
        self._listed: dict[Path, tuple[CorpusEntry, ...]] = {}

    def entries(self, system: str) -> tuple[CorpusEntry, ...]:
        """Return the files of a system in the order of their names.

        Files whose header cannot be read are among them.  Cases of another class of the module lie
        in the same folder.
        """
        self._check_link()
        return tuple(
            entry
            for entry in self._in(self._folder_of(system))
            if entry.header is None or entry.header.system == system
        )

    def all_entries(self) -> tuple[CorpusEntry, ...]:
        """Return all files, system by system; raise CorpusError if they cannot be listed."""
        self._check_link()
        try:
            found = sorted(self.folder.iterdir()) if self.folder.is_dir() else ()
        except OSError as error:
            raise CorpusError(
                f"{self.folder}: cannot be read: {error.strerror}; expected a folder of cases that "
                "this user may read, which the ini key garl_cases names"
            ) from error
        folders = [each for each in found if each.is_dir() or each.is_symlink()]
        return tuple(entry for folder in folders for entry in self._in(folder))

    @functools.cached_property
    def acceptance(self) -> Acceptance:
        """The cases that git knows, asked once."""
        return read_acceptance(self.folder)

    def is_accepted(self, entry: CorpusEntry) -> bool:
        """Return whether a case is committed, or marked as accepted."""
        return entry.case is not None and self.acceptance.accepts(entry.path, entry.case)

    def expected_cases(
        self, system: str, map: str, *, accepted: bool = False
    ) -> list[tuple[CorpusEntry, Case]]:
        """Return the open cases that may excuse violations of a system on a map, with their files.

        A case that gates nothing says nothing about other violations with its signature.
        ``accepted`` leaves out cases that are not accepted.
        """
        return [
            (entry, entry.case)
            for entry in self.entries(system)
            if entry.case is not None
            and entry.case.scenario.map == map
            and entry.case.expects_signature
            and (not accepted or self.is_accepted(entry))
        ]

    def expected_signatures(
        self, system: str, map: str, *, accepted: bool = False
    ) -> dict[str, CorpusEntry]:
        """Return how violations of a system on a map are expected to end, with a case's file."""
        expected = self.expected_cases(system, map, accepted=accepted)
        return {case.ending: entry for entry, case in expected}

    def save(self, case: Case) -> Path | None:
        """Write a new case; return its file, or None if the same failure is saved already."""
        folder = self._folder_of(case.system)
        with locked(folder):
            self._listed.pop(folder, None)
            if self._find(case) is not None:
                return None
            self._listed.pop(folder, None)
            return write_text_atomically(folder / f"{case.id}.toml", self._text(case))

    def _text(self, case: Case) -> str:
        return dump_case(case, lambda name: load_map(name, self.map_folders))

    def save_patch(self, case: Case, patches: Path, root: Path) -> Path:
        """Write a patch that adds the case; the tree itself is left alone.

        Raises CorpusError if the corpus is not in the project at ``root``.
        """
        path = self._folder_of(case.system) / f"{case.id}.toml"
        try:
            text = patch_of(path, root, self._text(case))
        except ValueError as error:
            raise CorpusError(
                f"{self.folder}: found these cases, expected a folder in the project at {root}, "
                "which a patch changes; name one with the ini key garl_cases"
            ) from error
        return write_text_atomically(patches / f"{case.id}.patch", text)

    def _folder_of(self, system: str) -> Path:
        return folder_of(self.folder, system)

    def _find(self, case: Case) -> CorpusEntry | None:
        """Return the file whose case stands for this one, too."""
        for entry in self.entries(case.system):
            if entry.case is not None and _stands_for(entry.case, case):
                return entry
        return None

    def _check_link(self) -> None:
        if self.folder.is_symlink() and not self.folder.exists():
            raise CorpusError(
                f"{self.folder}: found a symbolic link that leads nowhere, expected a folder of "
                "cases"
            )

    def _in(self, folder: Path) -> tuple[CorpusEntry, ...]:
        if folder not in self._listed:
            self._listed[folder] = tuple(self._list(folder))
        return self._listed[folder]

    def _list(self, folder: Path) -> Iterator[CorpusEntry]:
        if folder.is_symlink() and not folder.exists():
            yield _lost(folder, "there is no such folder")
        # Since Python 3.13 glob raises for a name that no folder can have, such as one with a NUL.
        for path in sorted(folder.glob("[!.]*.toml")) if folder.is_dir() else ():
            try:
                changed_ns = path.stat().st_mtime_ns
            except OSError as error:
                if path.is_symlink():
                    yield _lost(path, str(error.strerror))
                # Else another process removed it after it was listed.
                continue
            yield self._read(path, changed_ns)

    def _read(self, path: Path, changed_ns: int) -> CorpusEntry:
        known = self._entries.get(path)
        if known is None or known.changed_ns != changed_ns:
            header, problem = _header_of(path)
            known = self._entries[path] = CorpusEntry(
                path=path,
                changed_ns=changed_ns,
                map_folders=self.map_folders,
                header=header,
                header_problem=problem,
            )
        return known


def replace_file(path: Path, case: Case, map_folders: tuple[Path, ...] = ()) -> Path:
    """Write a case in place of the one in ``path``, under the name that it should have."""
    with locked(path.parent):
        written = write_text_atomically(
            path.with_name(f"{case.id}.toml"),
            dump_case(case, lambda name: load_map(name, map_folders)),
        )
        if written != path:
            path.unlink(missing_ok=True)
        return written


def rewrite_file(path: Path, before: Case, case: Case, map_folders: tuple[Path, ...] = ()) -> Path:
    """Write a case in place of ``before`` in ``path``; the file keeps its name if the id stays.

    Raises CorpusError if another file has the new name.
    """
    if before.id == case.id:
        with locked(path.parent):
            return write_text_atomically(
                path, dump_case(case, lambda name: load_map(name, map_folders))
            )
    taken = path.with_name(f"{case.id}.toml")
    if taken != path and taken.exists():
        raise CorpusError(f"{path}: its new name is that of another case, {taken.name}")
    return replace_file(path, case, map_folders)


def folder_of(cases: Path, system: str) -> Path:
    """Return where the cases of a system ("module:class") lie: under its module's own name."""
    return cases / system.partition(":")[0].rpartition(".")[2]


def patch_of(path: Path, root: Path, text: str) -> str:
    """Return what ``git apply`` needs to make a new file of the project."""
    name = path.relative_to(root).as_posix()
    lines = text.splitlines(keepends=True)
    body = difflib.unified_diff([], lines, "/dev/null", f"b/{name}")
    return f"diff --git a/{name} b/{name}\nnew file mode 100644\n{''.join(body)}"


def _header_of(path: Path) -> tuple[CaseHeader | None, str]:
    """Return the header of a file, or None and what is wrong with it."""
    try:
        return load_header(path), ""
    except ScenarioError as error:
        return None, str(error)


def _lost(path: Path, reason: str) -> CorpusEntry:
    """Return an entry for a symbolic link without a file: a case may be lost."""
    problem = (
        f"{path}: cannot be read: found a symbolic link that leads nowhere ({reason}), expected "
        "a file; remove it, or restore what it points to"
    )
    return CorpusEntry(
        path=path, changed_ns=0, map_folders=(), header=None, header_problem=printable(problem)
    )


def _stands_for(known: Case, case: Case) -> bool:
    """Return whether a saved case is of the same failure: system, map, ending, test and cause.

    A case that gates nothing expects no failure but its own, so that a robust one of its signature
    is saved beside it.  A second case on an edge would say nothing more.  A case of a worse search
    is saved, because a known one does not excuse what is worse.
    """
    if _failure(known) != _failure(case):
        return False
    explains = _explains(known, case)
    if not explains and cause_of_case(known) != cause_of_case(case):
        return False
    if known.expects_signature:
        return not _is_worse(case, known)
    both_on_edge = case.edge and known.edge and known.status == "open"
    same_flight = _without_bound(known).id == _without_bound(case).id
    return both_on_edge or explains or (same_flight and known.reason == case.reason)


def _failure(case: Case) -> tuple[object, ...]:
    """Return the facts that two cases of the same failure share, beside the cause."""
    return (
        case.system,
        case.scenario.map,
        case.ending,
        case.asserting_test,
        case.assertion,
    )


def _explains(known: Case, case: Case) -> bool:
    """Return whether an open, shrunk case takes nothing that one which is not shrunk lacks."""
    return (
        (known.is_shrunk and not case.is_shrunk)
        and (known.status, known.reason) == (case.status, case.reason)
        and cause_of_case(known).is_in(case.scenario)
    )


def _without_bound(case: Case) -> Case:
    return dataclasses.replace(case, worst=None)


def _is_worse(case: Case, known: Case) -> bool:
    """Return whether a case was saved by a search with a worse violation of its kind."""
    if case.worst is None or known.worst is None:
        return False
    return worst_in([case.worst, known.worst]) != known.worst


@dataclass(frozen=True, slots=True, kw_only=True)
class Acceptance:
    """The files of a folder that git knows; ``problem`` says why git could not be asked."""

    cases: Path
    committed: frozenset[str]
    problem: str = ""

    def accepts(self, path: Path, case: Case) -> bool:
        """Return whether a case is accepted, so that its failure is expected."""
        return case.accepted or path.relative_to(self.cases).as_posix() in self.committed


def read_acceptance(cases: Path) -> Acceptance:
    """Ask git which files of a folder are in its index."""
    committed, problem = _git_files(cases, ".") if cases.is_dir() else ([], "")
    return Acceptance(cases=cases, committed=frozenset(committed), problem=problem)


def committed_cases(cases: Path) -> list[str]:
    """Return the paths of the cases of a folder that git's index has, also if the folder is gone.

    The paths are those below the folder.
    """
    at = next((each for each in cases.absolute().parents if each.is_dir()), None)
    if at is None:
        return []
    # Without git nothing is known of a folder that is gone.
    found, _ = _git_files(at, str(cases.absolute()))
    below = cases.absolute().relative_to(at).as_posix()
    names = [name.removeprefix(f"{below}/") for name in found]
    return [name for name in names if name.endswith(".toml") and name.count("/") == 1]


def _git_files(folder: Path, files: str) -> tuple[list[str], str]:
    """Return which of some files git's index has, as seen from a folder, or why it cannot tell."""
    command = ["git", "-C", str(folder), "ls-files", "-z", "--", files]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, errors="surrogateescape", check=False
        )
    except OSError as error:
        return [], f"git: {error.strerror}"
    if done.returncode:
        return [], done.stderr.strip().partition("\n")[0]
    return done.stdout.split("\0")[:-1], ""
