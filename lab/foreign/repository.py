"""Repositories of other people: where their files are, and whether they are the expected ones."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pytest_garl.errors import GarlError

FOLDER = "GARL_FOREIGN"
"""The environment variable that names the folder with the clones."""


class ForeignCodeError(GarlError):
    """The code of a foreign repository is missing, or is not the version that was adapted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Repository:
    """One repository at one commit.

    ``name`` is "owner/name" on GitHub; ``files`` maps the path of each file that an adapter loads
    to the SHA-256 of its bytes.
    """

    name: str
    commit: str
    licence: str
    files: Mapping[str, str]

    @property
    def folder(self) -> Path:
        """The clone, <owner>+<name> in the folder of clones."""
        return Path(os.environ.get(FOLDER, "")) / self.name.replace("/", "+")

    @property
    def problem(self) -> str:
        """What is wrong with the clone and what to do about it; empty if nothing is."""
        if not os.environ.get(FOLDER):
            return f"{FOLDER} is not set; expected a folder with a clone. {self._advice}"
        for path, expected in self.files.items():
            file = self.folder / path
            if not file.is_file():
                return f"{file}: no such file. {self._advice}"
            if hashlib.sha256(file.read_bytes()).hexdigest() != expected:
                return f"{file}: found another version than was adapted. {self._advice}"
        return ""

    @property
    def _advice(self) -> str:
        name = self.name.replace("/", "+")
        return (
            f"Clone https://github.com/{self.name} to ${FOLDER}/{name} and check out {self.commit}"
        )

    def source(self, path: str) -> str:
        """Return the text of a file; raises ForeignCodeError if the clone has a problem."""
        if self.problem:
            raise ForeignCodeError(self.problem)
        return (self.folder / path).read_text()
