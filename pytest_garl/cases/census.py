"""The census of the corpus: the saved cases that no test can fly any more, and files that are none.

pytest takes it in each session that collects landing tests, `garl cases check` of the whole
project.  A session that leaves out the tests of a case says nothing about the case: another session
may fly it.  So a case that is not flown here is lost only if no test file that this session leaves
out can fly it.
"""

from __future__ import annotations

import ast
import fnmatch
import functools
import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.cases.case_header import CaseHeader
from pytest_garl.cases.collected_tests import CollectedProject
from pytest_garl.cases.corpus import Corpus, CorpusEntry, committed_cases, folder_of
from pytest_garl.execution.sources import module_file
from pytest_garl.files.user_files import MEGABYTE
from pytest_garl.program import program_named

_SIGNS_OF_A_CASE = (b"\ntrajectory_sha256 =", b"\n[violation]")
"""What each case file holds, under whatever name."""
_MARKER = re.compile(rb"\bmark\s*\.\s*garl\b")
_FIXTURE = b"landing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost:
    """A file of the corpus that nothing flies, or the corpus itself, and why."""

    path: Path
    reason: str


def census(corpus: Corpus, collection: CollectedProject) -> list[Lost]:
    """Return what is lost of a corpus, in the order of the paths."""
    found = list(_misplaced(corpus)) or list(_missing_corpus(corpus))
    if corpus.folder.is_dir():
        project = _Project(collection)
        for entry in corpus.all_entries():
            reason = _why_lost(entry, corpus, collection, project)
            if reason:
                found.append(Lost(path=entry.path, reason=reason))
    return sorted(found, key=lambda lost: lost.path)


def _missing_corpus(corpus: Corpus) -> Iterator[Lost]:
    """Yield the corpus if git has cases of it, and the folder has none."""
    folder = corpus.folder
    if folder.is_dir() and any(folder.glob("*/*.toml")):
        return
    committed = committed_cases(folder)
    if committed:
        yield Lost(
            path=folder,
            reason=(
                f"the folder has no case any more, but git's index has {len(committed)}, such as "
                f"{committed[0]}; restore them with `git restore`, or, if they are to go, take "
                "them out of the index with `git rm --cached`"
            ),
        )


def _misplaced(corpus: Corpus) -> Iterator[Lost]:
    """Yield the files below the folder that hold a case, or should, but are not read as one."""
    home = corpus.folder
    for folder, folders, files in os.walk(home):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            path = Path(folder, name)
            depth = len(path.relative_to(home).parts)
            hidden = name.startswith(".")
            if depth == 2 and path.suffix == ".toml" and not hidden:
                continue
            if path.suffix.lower() == ".toml" and not hidden:
                where = f"{home.name}/SYSTEM/{path.stem}.toml, SYSTEM the name of the module"
                yield Lost(
                    path=path,
                    reason=f"nothing reads this file: expected {where} of its landing system",
                )
            elif _holds_a_case(path):
                yield Lost(
                    path=path,
                    reason=(
                        "nothing reads this file, which holds a case: expected a name that ends "
                        "with .toml and begins with no dot; rename or delete it"
                    ),
                )


def _holds_a_case(path: Path) -> bool:
    try:
        if not path.is_file() or path.stat().st_size > MEGABYTE:
            return False
        content = path.read_bytes()
    except OSError:
        # A file that cannot be read was no case that could be flown yesterday.
        return False
    return all(sign in content for sign in _SIGNS_OF_A_CASE)


def _why_lost(
    entry: CorpusEntry, corpus: Corpus, collection: CollectedProject, project: _Project
) -> str:
    """Return why nothing flies a case; empty if something does, or if another session may."""
    header, folder = entry.header, entry.path.parent
    if header is None:
        # Tests of a system whose cases lie here fail for it.
        read = {folder_of(corpus.folder, test.system) for test in collection.tests}
        if {folder, entry.path} & read:
            return ""
        return "" if project.left_out else entry.problem
    if folder_of(corpus.folder, header.system) != folder:
        expected = folder_of(corpus.folder, header.system).name
        return (
            f"it is a case of {header.system}, and nothing looks for it in {folder.name}/; move it "
            f"to {expected}/, or correct its key 'system'"
        )
    if collection.flies(header):
        return ""
    if entry.problem and collection.tests_of(header.system):
        # The items of these tests fail for it.
        return ""
    file = header.test.partition("::")[0] if "::" in header.test else ""
    if file and file not in collection.test_files and (collection.root / file).is_file():
        return ""
    reason = _reason(header, file, collection)
    known = file in collection.test_files or bool(collection.tests_of(header.system))
    may_fly = project.may_fly(header.system, missing=reason.missing, known=known)
    return "" if may_fly else reason.text


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reason:
    """Why no collected test flies a case; ``missing`` if its landing system cannot be imported."""

    text: str
    missing: bool = False


def _reason(header: CaseHeader, file: str, collection: CollectedProject) -> _Reason:
    system = header.system
    problem = system_problem(system, collection.root)
    if problem:
        return _Reason(
            text=(
                f"its landing system {system} cannot be imported: {problem}; if it has another "
                "name, correct the key 'system' and move the file into the folder of the module; "
                "if it is gone, delete the file"
            ),
            missing=True,
        )
    tests = collection.tests_of(system)
    maps = sorted({map for test in tests for map in test.maps})
    if tests and header.map not in maps:
        return _Reason(
            text=(
                f"no test of {system} flies on {header.map} any more, only on {', '.join(maps)}; "
                f"name {header.map} in the maps of the marker, or delete the file"
            )
        )
    known = {test.nodeid for test in collection.tests}
    if header.asserting_test and tests:
        return _Reason(
            text=(
                f"its own property is asserted by {header.test}, which is gone or has no marker; "
                "correct the key 'test', or delete the file"
            )
        )
    if header.test in known:
        flown = sorted({each.system for each in collection.tests if each.nodeid == header.test})
        return _Reason(
            text=(
                f"its test {header.test} flies {', '.join(flown)}, and no test flies {system}; "
                "write a test that does, or delete the file"
            )
        )
    gone = f"its test {header.test} is gone or has no marker, and " if file else ""
    return _Reason(text=f"{gone}no test flies {system}; write one that does, or delete the file")


def system_problem(system: str, root: Path) -> str:
    """Return why a landing system "module:class" cannot be imported; empty if it seems it can.

    No module is imported for it: a module may take seconds, or do anything.
    """
    name, _, qualname = system.partition(":")
    module = sys.modules.get(name)
    if module is not None:
        if program_named(name, qualname):
            return ""
        found: object = module
        for part in qualname.split("."):
            if not hasattr(found, part):
                return f"the module {name} has no {qualname}"
            found = getattr(found, part)
        return ""
    file = module_file(name, root)
    if file is None:
        return f"there is no module {name}"
    if file.suffix == ".py" and not _defines(file, qualname.partition(".")[0]):
        return f"the module {name} ({file}) has no {qualname}"
    return ""


def _defines(file: Path, name: str) -> bool:
    """Return whether a module binds a name, as far as its source tells."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return False
    bound: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            bound.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            bound |= {(each.asname or each.name).partition(".")[0] for each in node.names}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            bound.add(node.id)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Program"):
            # Its argument or its script names it: only to import the module would tell.
            return True
    return bool({name, "*", "__getattr__"} & bound)


@dataclass(frozen=True)
class _Project:
    """The test files of the project that a session left out, looked for only if a case needs it."""

    collection: CollectedProject

    @functools.cached_property
    def left_out(self) -> tuple[Path, ...]:
        """The test files with the marker that this session did not collect."""
        return self._files.left_out

    def may_fly(self, system: str, *, missing: bool, known: bool) -> bool:
        """Return whether a test file that this session left out may fly a landing system.

        Such a file names the class.  If the system's module is ``missing`` here, another session
        may find it: then there is a file of that name.  ``known`` is whether this session collected
        the case's test file, or tests of the system; if it did not, any file may fly the case.
        """
        if not self.left_out:
            return False
        module, _, qualname = system.partition(":")
        if missing:
            if module.rpartition(".")[2] not in self._files.modules:
                return False
        elif not known:
            return True
        named = qualname.rpartition(".")[2].encode()
        return any(named in _read(file) for file in self.left_out)

    @functools.cached_property
    def _files(self) -> ProjectFiles:
        return project_files(self.collection)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProjectFiles:
    """The test files with the marker that were left out, and the names of all modules."""

    left_out: tuple[Path, ...]
    modules: frozenset[str]


def project_files(collection: CollectedProject) -> ProjectFiles:
    """Look through the Python files of a project."""
    uncollected: list[Path] = []
    modules: set[str] = set()
    helper = False
    for path in _python_files(collection.root, collection.skipped_folders):
        name = path.relative_to(collection.root).as_posix()
        modules.add(path.parent.name if path.name == "__init__.py" else path.stem)
        is_test = _matches(name, collection.file_patterns)
        if not is_test:
            helper = helper or has_marker(path)
        elif name not in collection.test_files:
            uncollected.append(path)
    # A module or a conftest.py that holds the marker may give it to any test.
    left_out = [path for path in uncollected if has_marker(path) or (helper and _may_land(path))]
    return ProjectFiles(left_out=tuple(left_out), modules=frozenset(modules))


def marked_test_files(root: Path, patterns: Sequence[str], skipped: Sequence[str]) -> list[str]:
    """Return all test files of a project that may hold landing tests, as in node ids."""
    nothing = CollectedProject(
        root=root,
        test_files=frozenset(),
        tests=(),
        file_patterns=tuple(patterns),
        skipped_folders=tuple(skipped),
    )
    return [path.relative_to(root).as_posix() for path in project_files(nothing).left_out]


def has_marker(path: Path) -> bool:
    """Return whether a source file holds ``mark.garl``, outside of texts."""
    source = _read(path)
    if not _MARKER.search(source):
        return False
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return False
    return any(_is_marker(node) for node in ast.walk(tree))


def _is_marker(node: ast.AST) -> bool:
    if not isinstance(node, ast.Attribute) or node.attr != "garl":
        return False
    value = node.value
    return (isinstance(value, ast.Attribute) and value.attr == "mark") or (
        isinstance(value, ast.Name) and value.id == "mark"
    )


def _may_land(path: Path) -> bool:
    return _FIXTURE in _read(path)


def _python_files(root: Path, skipped: Sequence[str]) -> Iterator[Path]:
    for folder, folders, files in os.walk(root):
        if "pyvenv.cfg" in files and Path(folder) != root:
            # A virtual environment.
            folders.clear()
            continue
        folders[:] = sorted(
            name
            for name in folders
            if not name.startswith(".") and name != "__pycache__" and not _matches(name, skipped)
        )
        yield from (Path(folder, name) for name in sorted(files) if name.endswith(".py"))


def _matches(path: str, patterns: Sequence[str]) -> bool:
    name = path.rpartition("/")[2]
    return any(fnmatch.fnmatch(path if "/" in each else name, each) for each in patterns)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes() if path.stat().st_size <= MEGABYTE else b""
    except OSError:
        return b""
