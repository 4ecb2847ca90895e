"""A saved case: one way to fail, with all that is needed to fly it again and to trust it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from pytest_garl.engine import TITLES, Engine, chosen
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.simulation.npc_policy import PolicySpec
from pytest_garl.verdicts.ending import ending_of
from pytest_garl.verdicts.verdict import Limits, PropertyName, ViolationType

Status = Literal["open", "fixed"]
"""Open: known, expected to fail.  Fixed: must pass."""
Preventable = Literal["not asked", "preventable", "sensor-limited", "unpreventable"]
"""Whether a collision with a moving body could have been prevented.  Preventable: an escape exists
from the state shortly after the body was first observable.  Sensor-limited: an escape exists, but
nothing was observable in time for it.  Unpreventable: no escape exists.  Not asked: the violation
is another one, or no flights were left for the question."""
NOTHING = "nothing"
"""What shrinking removed from a case that was as simple as can be."""
NoGateReason = Literal["", "edge", "sensor-limited", "unpreventable"]
"""Why a case gates nothing; empty for one that gates."""
NO_GATE_TEXTS: Mapping[NoGateReason, str] = MappingProxyType(
    {
        "edge": "it is an edge case, not all of its neighbours fail",
        "sensor-limited": "an escape exists, but the camera did not show the body in time for it",
        "unpreventable": "no landing system could have escaped",
    }
)
"""The reasons in words."""
ESCAPE_STEP_S = 0.5
"""Escapes are searched for this long before a collision, and at whole multiples of this time."""
LONGEST_ESCAPE_S = 5.0
"""Escapes begin at most this long before the contact."""
REACTION_S = 0.3
"""Time from the first observation to the first command of an escape: three frames at the default
rate, in which a system notices and decides, and its latency passes; engineering estimate."""
OBSERVED_WITHIN_S = LONGEST_ESCAPE_S + REACTION_S
"""An earlier picture does not count: no escape begins that early."""
Escape = Literal["flight", "motors off"]
"""How a collision could have been escaped: by flying on, or, by a UAV that stands on the ground, by
stopping the motors."""
MoveList = tuple[tuple[float, float], ...]
Moves = tuple[tuple[str, MoveList], ...]
ChangeList = tuple[tuple[int, str, float], ...]
Changes = tuple[tuple[str, ChangeList], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Violation:
    """A violated property, its margin in ``unit`` (negative or 0), and a description in words."""

    signature: str
    type: ViolationType
    property: PropertyName
    margin: float
    unit: str
    description: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Worst:
    """The worst violation of a kind in the search that saved its case: the bound of its excuse.

    ``margin`` is that of the violated property, in its unit, ``grade`` the weakest adversary; each
    may be of another flight.  A grade is empty for violations without a moving body, and if nobody
    knows it.
    """

    margin: float
    grade: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseEvidence:
    """The measurements that support a case.

    ``neighbours_failed`` of ``neighbours`` slightly different scenarios failed with the same
    signature, or by the same kind of body if the entry of a crossing object was shifted;
    ``trajectory_sha256`` is that of the flight, by the physics engine ``engine`` on CPUs of the
    class ``cpu``; ``removed`` says what shrinking removed.  ``system_sha256`` and
    ``simulator_sha256`` are hashes of the sources that flew it.
    """

    trajectory_sha256: str
    cpu: str
    map_sha256: str
    neighbours: int
    neighbours_failed: int
    removed: str
    versions: tuple[tuple[str, str], ...]
    system_sha256: str
    simulator_sha256: str
    engine: Engine = "bullet"


@dataclass(frozen=True, slots=True, kw_only=True)
class Prevention:
    """Whether a collision with a moving body could have been prevented, and until when.

    ``inevitable_s`` is the time to inevitable collision: the longest time before the contact from
    which no escape exists.  ``observed_s`` is how long before the contact the camera had shown the
    body well enough for the first time within ``OBSERVED_WITHIN_S``; None if it had not.
    ``escape`` is how a preventable collision could have been escaped: to stop the motors on the
    ground needs no camera.
    """

    answer: Preventable = "not asked"
    inevitable_s: float | None = None
    observed_s: float | None = None
    escape: Escape = "flight"

    @property
    def text(self) -> str:
        """The answer in words, with the seconds; empty if it was not asked."""
        if self.answer == "not asked":
            return ""
        inevitable_s = self.inevitable_s or 0.0
        if self.answer == "unpreventable":
            escape = f"no escape exists within the last {inevitable_s:.1f} s"
        elif inevitable_s:
            escape = (
                f"an escape exists {inevitable_s + ESCAPE_STEP_S:.1f} s before the contact, none "
                f"{inevitable_s:.1f} s before it"
            )
        else:
            escape = f"an escape exists {ESCAPE_STEP_S:.1f} s before the contact"
        if self.escape == "motors off":
            return (
                f"{self.answer}: the UAV stood on the ground, where stopping the motors is an "
                f"escape that needs no camera; {escape}"
            )
        # What it showed before the time that counts is not asked.
        at_least = "at least " if (self.observed_s or 0.0) >= LONGEST_ESCAPE_S else ""
        seen = (
            f"the camera did not show the body well enough within the last {OBSERVED_WITHIN_S:g} s"
            if self.observed_s is None
            else f"the camera showed the body {at_least}{self.observed_s:.1f} s before it"
        )
        return f"{self.answer}: {escape}, {seen}"


NOT_ASKED = Prevention()


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedBehaviour:
    """The moves that objects made in a flight, and their policies' changes of the environment.

    A move is the wanted velocity (x, y) for half a second, as shares of the object's speed.
    ``changes`` names only the objects whose policy changed anything: the number of the decision,
    the gene, the value that was added to it.
    """

    moves: Moves
    changes: Changes = ()

    @property
    def policy(self) -> PolicySpec:
        """The policy with which the objects repeat it."""
        return recorded_spec(dict(self.moves), dict(self.changes))

    def only(self, name: str) -> RecordedBehaviour:
        """Return the behaviour of one object."""
        return self._of(lambda each: each == name)

    def without(self, names: Collection[str]) -> RecordedBehaviour:
        """Return the behaviour of all objects but some."""
        return self._of(lambda each: each not in names)

    def _of(self, wanted: Callable[[str], bool]) -> RecordedBehaviour:
        return RecordedBehaviour(
            moves=tuple(each for each in self.moves if wanted(each[0])),
            changes=tuple(each for each in self.changes if wanted(each[0])),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One saved case.

    ``system`` is "module:class".  ``moves`` and ``changes`` are the objects' recorded behaviour, so
    that no policy is needed to fly it again; ``policy`` and ``policy_sha256`` name the policy that
    moved the objects when it was found.  ``test`` is the node id of the test that failed, without
    parameters; empty if none is known.  ``assertion`` is the hash of the assertion's source if a
    test's own assertion failed and the built-in verdict found nothing.  ``reason`` says why the
    case gates nothing.  ``live`` is whether a repair must also hold against objects that a live
    policy moves: an escape from them exists.  ``limits`` are those of the tests when it was found;
    pytest flies it with those of today.  ``accepted`` marks a case as known in projects without
    git.  ``severity`` is what the violation takes.  ``worst`` bounds the violations that it
    excuses; None sets no bound: for the own assertion of a test nothing is measured.
    """

    system: str
    status: Status
    scenario: Scenario
    violation: Violation
    policy: str
    policy_sha256: str
    moves: Moves
    evidence: CaseEvidence
    limits: Limits
    changes: Changes = ()
    test: str = ""
    assertion: str = ""
    accepted: bool = False
    reason: NoGateReason = ""
    live: bool = False
    prevention: Prevention = NOT_ASKED
    severity: Severity = NO_SEVERITY
    worst: Worst | None = None

    @property
    def behaviour(self) -> RecordedBehaviour:
        """The moves and changes of the objects, so that they can repeat them."""
        return RecordedBehaviour(moves=self.moves, changes=self.changes)

    @property
    def robustness(self) -> str:
        """How robust it is, in words; empty if that was not measured."""
        evidence, window_s = self.evidence, self.severity.window_s
        if window_s is not None:
            return f"it collides too if the body comes at another time within {window_s:g} s"
        if not evidence.neighbours:
            return ""
        failed = evidence.neighbours_failed
        return (
            f"{failed} of {evidence.neighbours} neighbours {'fails' if failed == 1 else 'fail'} too"
        )

    @property
    def is_shrunk(self) -> bool:
        """Whether flights showed what the violation takes; else the case is as it was found."""
        was_flown = bool(self.evidence.neighbours) or self.severity.window_s is not None
        return was_flown and not self.severity.is_guess

    @property
    def removed(self) -> str:
        """What shrinking removed, in words.

        The marker's place counts as a condition there, and nowhere else: a scenario with nothing
        unusual has a place.  So the place is named if it is what is left.
        """
        removed = self.evidence.removed
        counts_place = "condition" in removed and self.scenario.has_moved_marker
        return f"{removed}, not the marker's place" if counts_place else removed

    @property
    def shrinking(self) -> str:
        """What shrinking removed, in words, or that the case was not shrunk."""
        if self.evidence.removed != NOTHING:
            return f"shrinking removed {self.removed}"
        is_tried = self.is_shrunk or not self.severity.about
        return "nothing could be left out" if is_tried else "not shrunk"

    @property
    def without_flights(self) -> str:
        """What a case is that no flight has shrunk, in words.

        What cannot act was taken away before, and the known causes if it fails without them.
        """
        if self.evidence.removed == NOTHING:
            return "as the search found it, not shrunk"
        return f"not shrunk; left out of the flight that was found: {self.removed}"

    @property
    def of_another_engine(self) -> str:
        """That another physics engine than its own flies here, in words; empty if it is its own.

        Only its own says whether a repair made the case pass, and whether it passed before.
        """
        own, here = self.evidence.engine, chosen()
        if own == here:
            return ""
        return f"{TITLES[here]} flies here, and its reference is {TITLES[own]}'s"

    @property
    def asserting_test(self) -> str:
        """The name of the test whose own assertion failed; empty for the built-in verdict."""
        return asserting_test(self.test, self.assertion)

    @property
    def edge(self) -> bool:
        """Whether a neighbour does not fail; such a case gates nothing."""
        return self.reason == "edge"

    @property
    def gates(self) -> bool:
        """Whether a failure of the case may fail a run."""
        return not self.reason

    @property
    def expects_signature(self) -> bool:
        """Whether it excuses other violations with its signature.

        A case that gates nothing excuses nothing but itself.  The next collision may be
        preventable, and one on an edge says little about violations that are not.
        """
        return self.status == "open" and self.gates

    @property
    def ending(self) -> str:
        """Its signature without the condition that acted: what flights are compared by."""
        return ending_of(self.violation.signature)

    @property
    def id(self) -> str:
        """A name such as ``court-IV-dog-3f9a12``, the same for the same scenario and bound.

        A system that has become worse may fail worse in the same scenario.
        """
        scenario = self.scenario
        # The ids of committed cases depend on these letters.
        facts = (
            f"({self.system!r}, Scenario(map={scenario.map!r}, seed={scenario.seed!r}, "
            f"genes={scenario.genes!r}, absent={scenario.removed_objects!r}), "
            f"{self.violation.signature!r}, {self.moves!r}, {self.asserting_test!r})"
        )
        # The ids of committed cases depend on it: of those without changes it is empty.
        changes = repr(self.changes) if self.changes else ""
        worst = self.worst
        bound = f"({worst.margin!r}, {worst.grade!r}, {self.reason!r})" if worst else ""
        digest = hashlib.sha256(f"{facts}{changes}{bound}".encode()).hexdigest()
        words = self.violation.signature.split(":")[:2] or [self.violation.type]
        subject = "-".join(_SAFE.sub("_", word.partition("@")[0]).strip("_") for word in words)
        # A file's name has 255 bytes at most; a test's name may be longer.
        return f"{self.scenario.map}-{subject[:60]}-{digest[:6]}"


def asserting_test(test: str, assertion: str) -> str:
    """Return the function's name in a test's node id if the failure is its own assertion."""
    return test.rpartition("::")[2] if assertion else ""


_SAFE = re.compile(r"[^A-Za-z0-9]+")
