"""Proofs that other sources than a saved case's fly it to the byte.

A case holds the hashes of the sources that flew it: its reference.  Once they differ from today's,
a pass of the case proves no repair: the change may be the reason.  But if the landing system still
fails in the very flight that the case recorded, then the change did not matter to this case, and
today's sources are as good a reference.  A run notes that as a proof beside its ledger;
`garl cases renew` writes it into the file.
"""

from __future__ import annotations

import dataclasses
import functools
import json
from pathlib import Path

from pytest_garl.cases.case import Case
from pytest_garl.cases.replay import SourceHashes
from pytest_garl.errors import SavingError


class Proofs:
    """What the runs in a folder have proved: the sources with which cases failed to the byte.

    The file has a line for each proof, in JSON; of several for one flight the last one counts.
    """

    def __init__(self, folder: Path) -> None:
        self._file = folder / "renewals.jsonl"

    def renewed(self, case: Case) -> Case:
        """Return a case with the latest proved sources as its reference."""
        sources = self._known.get(_key(case))
        return case if sources is None else with_sources(case, sources)

    def note(self, case: Case, sources: SourceHashes) -> None:
        """Note that a case failed to the byte with these sources, or raise SavingError."""
        key = _key(case)
        if self._known.get(key) == sources:
            return
        line = json.dumps({"case": key, **dataclasses.asdict(sources)})
        try:
            with self._file.open("a", encoding="utf-8") as file:
                file.write(f"{line}\n")
        except OSError as error:
            raise SavingError(f"{self._file}: cannot be written ({error})") from error
        self._known[key] = sources

    @functools.cached_property
    def _known(self) -> dict[str, SourceHashes]:
        found: dict[str, SourceHashes] = {}
        try:
            lines = self._file.read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            return found
        for line in lines:
            try:
                values = json.loads(line)
                case = str(values.pop("case"))
                found[case] = SourceHashes(**values)
            except (ValueError, TypeError, KeyError, AttributeError):
                # A damaged line proves nothing; the next run with the case writes another.
                continue
        return found


def _key(case: Case) -> str:
    """Return what a proof is about: a case and its recorded flight."""
    return f"{case.id} {case.evidence.trajectory_sha256}"


def proves_reference(case: Case, sources: SourceHashes, trajectory_sha256: str) -> bool:
    """Return whether a flight shows that another simulator or map flies the case to the byte.

    A landing system that alone has changed needs no proof: a pass is its own doing.
    """
    recorded = case.evidence.trajectory_sha256
    reference = dataclasses.replace(
        SourceHashes.of(case.evidence), system_sha256=sources.system_sha256
    )
    return (
        case.status == "open"
        and bool(recorded)
        and trajectory_sha256 == recorded
        and sources != reference
    )


def with_sources(case: Case, sources: SourceHashes) -> Case:
    """Return a case whose reference are other sources."""
    evidence = dataclasses.replace(case.evidence, **dataclasses.asdict(sources))
    return dataclasses.replace(case, evidence=evidence)


def renewal_line(cases: int) -> str:
    """Return the line that tells of cases whose reference a run proved; empty without any."""
    if not cases:
        return ""
    who, fly = ("1 case carries", "flies") if cases == 1 else (f"{cases} cases carry", "fly")
    return f"{who} another version's hash and {fly} as recorded: garl cases renew"
