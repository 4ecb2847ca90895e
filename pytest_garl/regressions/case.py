"""A saved case: one way to fail, with everything that it takes to fly it again and believe it."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from typing import Literal

from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.verdicts.verdict import Limits, PropertyName, ViolationType

Status = Literal["open", "fixed", "unavoidable"]
"""Open: known, expected to fail.  Fixed: must pass.  Unavoidable: not even a pilot that knows where
everything is, and may give up, comes through; gates nothing."""
Avoidable = Literal["live", "recorded", "no"]
"""Among which objects that pilot comes through without a violation: those that a live policy
steers after it, those that only repeat what they did, or neither."""
MoveList = tuple[tuple[float, float], ...]
Moves = tuple[tuple[str, MoveList], ...]
ChangeList = tuple[tuple[int, str, float], ...]
Changes = tuple[tuple[str, ChangeList], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """What failed: the property, its measured margin (negative or 0 when violated), the story."""

    signature: str
    type: ViolationType
    property: PropertyName
    margin: float
    unit: str
    story: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """Why a case may be believed.

    ``neighbours_failed`` of ``neighbours`` slightly different scenarios failed with the same
    signature; ``trajectory_sha256`` is that of the flight, on CPUs of the class ``cpu``;
    ``removed`` says what shrinking took away.  ``system_sha256`` and ``simulator_sha256`` are of
    the sources that flew it; empty in files that were written before they were stored.
    """

    trajectory_sha256: str
    cpu: str
    map_sha256: str
    neighbours: int
    neighbours_failed: int
    removed: str
    versions: tuple[tuple[str, str], ...]
    system_sha256: str = ""
    simulator_sha256: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedBehaviour:
    """What objects did in a flight, and what their policies changed of the environment.

    ``changes`` names the objects whose policy changed anything: the number of the decision,
    the gene, what was added to it.
    """

    moves: Moves
    changes: Changes = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One saved case.

    ``system`` is "module:class"; ``moves`` are what each object did, ``changes`` what of the
    environment, so that no policy is needed to fly it again; ``policy`` and ``policy_sha256``
    name who moved them when it was found.  ``test`` is the node id of the test that failed, without
    parameters; empty where none is known.  ``assertion`` is set where a test's own assertion failed
    and the built-in verdict is content: the hash of the assertion's source.
    ``avoidable`` says what may be asked of a repair: not to outrun a pursuer that nobody outruns.
    ``limits`` are those of the tests when it was found; pytest flies it with those of today.
    ``accepted`` says that somebody knows of it, where git does not say so.
    """

    system: str
    status: Status
    avoidable: Avoidable
    scenario: Scenario
    violation: Violation
    policy: str
    policy_sha256: str
    moves: Moves
    evidence: Evidence
    limits: Limits
    changes: Changes = ()
    test: str = ""
    assertion: str = ""
    accepted: bool = False

    @property
    def own_test(self) -> str:
        """The name of the test whose own assertion failed; empty for the built-in verdict."""
        return own_test(self.test, self.assertion)

    @property
    def edge(self) -> bool:
        """Whether a neighbour does not fail: such a case decides nothing and gates nothing."""
        return self.evidence.neighbours_failed < self.evidence.neighbours

    @property
    def id(self) -> str:
        """A name such as ``court-IV-dog-3f9a12``, the same for the same scenario."""
        scenario = self.scenario
        # The ids of committed cases depend on these letters.
        facts = (
            f"({self.system!r}, Scenario(map={scenario.map!r}, seed={scenario.seed!r}, "
            f"genes={scenario.genes!r}, absent={scenario.removed_objects!r}), "
            f"{self.violation.signature!r}, {self.moves!r}, {self.own_test!r})"
        )
        # Nothing where nothing was changed, so that the names of other cases stay.
        changes = repr(self.changes) if self.changes else ""
        digest = hashlib.sha256(f"{facts}{changes}".encode()).hexdigest()
        words = self.violation.signature.split(":")[:2] or [self.violation.type]
        subject = "-".join(_SAFE.sub("_", word.partition("@")[0]).strip("_") for word in words)
        # A file's name has 255 bytes at most, and that of a test may be longer.
        return f"{self.scenario.map}-{subject[:60]}-{digest[:6]}"


def own_test(test: str, assertion: str) -> str:
    """Return the function's name in a test's node id if the failure is its own assertion."""
    return test.rpartition("::")[2] if assertion else ""


_SAFE = re.compile(r"[^A-Za-z0-9]+")
