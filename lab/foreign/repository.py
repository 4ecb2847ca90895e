"""Repositories of other people: where their clones are, and the files of the commit that flies."""

from __future__ import annotations

import functools
import hashlib
import io
import os
import subprocess
import tarfile
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import GarlError

FOLDER = "GARL_FOREIGN"
"""The environment variable that names the folder with the clones."""
Changes = Mapping[str, str | Mapping[str, str]]
"""For each file its new text, or texts to replace, each of which it must hold exactly once."""


class ForeignCodeError(GarlError):
    """The code of a foreign repository is missing, or is not what the changes are made for."""


def clones() -> Path:
    """Return the folder with the clones, and ``venv`` with what the programs import."""
    return Path(os.environ.get(FOLDER, "")).absolute()


@dataclass(frozen=True, slots=True, kw_only=True)
class Repository:
    """One repository at one commit: ``name`` is "owner/name" on GitHub.

    ``paths`` are the files and folders that fly; ``python2`` are those of them whose print
    statements become calls.
    """

    name: str
    commit: str
    licence: str
    paths: tuple[str, ...]
    python2: tuple[str, ...] = ()

    @property
    def clone(self) -> Path:
        """The clone, <owner>+<name> in the folder of clones."""
        return clones() / self.name.replace("/", "+")

    @property
    def problem(self) -> str:
        """What is wrong with the clone and what to do about it; empty if nothing is."""
        if not os.environ.get(FOLDER):
            return f"{FOLDER} is not set; expected a folder with a clone. {self._advice}"
        if not self.clone.is_dir():
            return f"{self.clone}: no such folder. {self._advice}"
        if not _has_commit(self.clone, self.commit):
            return f"{self.clone}: it does not have the commit {self.commit}. {self._advice}"
        return ""

    @property
    def _advice(self) -> str:
        name = self.name.replace("/", "+")
        return (
            f"Clone https://github.com/{self.name} to ${FOLDER}/{name}, with the commit "
            f"{self.commit}"
        )

    def prepared(self, changes: Changes) -> Path:
        """Return a folder with the files of the commit and the changes; it is made once.

        Without a clone it is a folder that is not there.  Raises ForeignCodeError if a text to
        change is not there once.
        """
        key = repr((self.commit, self.paths, self.python2, sorted(changes.items())))
        digest = hashlib.sha256(key.encode()).hexdigest()[:12]
        folder = clones() / "flown" / f"{self.name.replace('/', '+')}-{digest}"
        if folder.is_dir() or self.problem:
            return folder
        folder.parent.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as made:
            self._fill(Path(made), changes)
            try:
                Path(made).rename(folder)
            except OSError:
                if not folder.is_dir():  # Another process was faster.
                    raise
            else:
                Path(made).mkdir()
        return folder

    def _fill(self, folder: Path, changes: Changes) -> None:
        packed = _git(self.clone, "archive", "--format=tar", self.commit, *self.paths)
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(folder, filter="data")
        if self.python2:
            fix = ["-m", "lib2to3", "--fix=print", "--write", "--nobackups", "--no-diffs"]
            python = str(clones() / "venv/bin/python")
            subprocess.run(
                [python, *fix, *self.python2], cwd=folder, check=True, capture_output=True
            )
        for path, change in changes.items():
            file = folder / path
            file.write_text(
                change if isinstance(change, str) else changed(file.read_text(), change)
            )


def changed(source: str, changes: Mapping[str, str]) -> str:
    """Return a source with texts replaced, each of which it must hold exactly once."""
    for old, new in changes.items():
        if (found := source.count(old)) != 1:
            raise ForeignCodeError(f"text to change: found {found} times, expected once: {old!r}")
        source = source.replace(old, new)
    return source


@functools.cache
def _has_commit(clone: Path, commit: str) -> bool:
    try:
        _git(clone, "cat-file", "-e", f"{commit}^{{commit}}")
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


def _git(clone: Path, *arguments: str) -> bytes:
    done = subprocess.run(
        ["git", "-C", str(clone), *arguments], check=True, capture_output=True, timeout=60
    )
    return done.stdout
