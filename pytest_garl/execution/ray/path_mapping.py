"""A project's paths on another machine, where a copy of it lies in another folder."""

from __future__ import annotations

import dataclasses
import json
import re
from dataclasses import dataclass

from pytest_garl.execution.job import FlightJob, loads
from pytest_garl.execution.reference import Reference


@dataclass(frozen=True, slots=True, kw_only=True)
class Relocation:
    """Two folders that hold the same project: ``home`` where pytest runs, ``here`` its copy."""

    home: str
    here: str

    def job(self, text: str) -> FlightJob:
        """Return the job in ``text`` as it reads here.

        What lies outside the project was not copied: it is imported by name, wherever this machine
        has it installed.
        """
        job = loads(_moved(text, _quoted(self.home), _quoted(self.here)))
        return dataclasses.replace(
            job, system=self._by_name(job.system), simulator=self._by_name(job.simulator)
        )

    def to_local(self, text: str) -> str:
        """Return a text such as a traceback with the paths that it would have at home."""
        return _moved(text, self.here, self.home)

    def _by_name(self, reference: Reference) -> Reference:
        if reference.file.startswith(f"{self.here}/"):
            return reference
        return dataclasses.replace(reference, file="")


def _quoted(path: str) -> str:
    return json.dumps(path)[1:-1]


def _moved(text: str, old: str, new: str) -> str:
    """Replace a folder wherever it is a whole path or the beginning of one."""
    return re.sub(rf"(?<![\w.-]){re.escape(old)}(?![^/\"'\s])", lambda _: new, text)
