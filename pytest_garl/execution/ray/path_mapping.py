"""Translates paths of a project between pytest's machine and a copy on a node of the cluster."""

from __future__ import annotations

import dataclasses
import json
import re
from dataclasses import dataclass

from pytest_garl.execution.job import FlightJob, parse_job
from pytest_garl.execution.reference import Reference


@dataclass(frozen=True, slots=True, kw_only=True)
class PathMapping:
    """Two folders with the same project: ``local`` where pytest runs, ``remote`` on this node."""

    local: str
    remote: str

    def remote_job(self, text: str) -> FlightJob:
        """Return the job in ``text`` with the paths of this node.

        Ray copies only the project.  Landing systems and simulators from outside it are imported
        by their module's name, from where this node has them installed.
        """
        job = parse_job(
            _replace_folder(text, _json_escaped(self.local), _json_escaped(self.remote))
        )
        return dataclasses.replace(
            job,
            system=self._importable_here(job.system),
            simulator=self._importable_here(job.simulator),
        )

    def to_local(self, text: str) -> str:
        """Return a text, such as a traceback, with the paths of the machine where pytest runs."""
        return _replace_folder(text, self.remote, self.local)

    def _importable_here(self, reference: Reference) -> Reference:
        """Leave out the file of a reference from outside the project."""
        if reference.file.startswith(f"{self.remote}/"):
            return reference
        return dataclasses.replace(reference, file="")


def _json_escaped(path: str) -> str:
    return json.dumps(path)[1:-1]


def _replace_folder(text: str, old: str, new: str) -> str:
    """Replace a folder if it is a whole path or the beginning of one."""
    return re.sub(rf"(?<![\w.-]){re.escape(old)}(?![^/\"'\s])", lambda _: new, text)
