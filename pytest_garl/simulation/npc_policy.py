"""The NPC policy: what it sees, what it decides, and the specification that names it."""

from __future__ import annotations

import dataclasses
import importlib
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from pytest_garl.errors import PolicyError
from pytest_garl.scenarios.genes import ENVIRONMENT
from pytest_garl.scenarios.story import STORY_MOMENTS

if TYPE_CHECKING:
    import numpy as np

    from pytest_garl.scenarios.maps.map import Map
    from pytest_garl.scenarios.object_types import ObjectType
    from pytest_garl.scenarios.scenario import Scenario

DECISION_STEP_S = 0.5
"""Time between two decisions of a policy (paper, section 3.4: "0.5 seconds")."""
NO_MOMENT_CAME = (0.0, *(math.inf for _ in STORY_MOMENTS[1:]))
"""The moments at the start of a flight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NpcState:
    """Ground truth about one NPC at a decision; positions (x, y, z) in metres.

    ``speed_mps`` is the NPC's highest speed: what its velocity gene means for its type.
    ``position_m`` is that of the body's frame.
    """

    name: str
    type: ObjectType
    position_m: tuple[float, float, float]
    velocity_mps: tuple[float, float]
    speed_mps: float

    @property
    def bottom_m(self) -> float:
        """Height of its lowest point above the ground."""
        return self.position_m[2] + self.type.low_m

    @property
    def top_m(self) -> float:
        """Height of its highest point above the ground."""
        return self.bottom_m + self.type.height_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """The input of a policy that decides for one NPC: the exact state of everything.

    ``self`` is that NPC, ``others`` are all other NPCs.  ``scenario`` holds all genes, with those
    of the environment as they are at the moment.  ``moments_s`` are the times at which the moments
    of the landing came so far (:data:`~pytest_garl.scenarios.story.STORY_MOMENTS`), infinite for
    the others.
    """

    time_s: float
    self: NpcState
    others: tuple[NpcState, ...]
    uav_position_m: tuple[float, float, float]
    uav_velocity_mps: tuple[float, float, float]
    marker_position_m: tuple[float, float]
    map: Map
    scenario: Scenario
    moments_s: tuple[float, ...] = NO_MOMENT_CAME


GeneChange = tuple[str, float]
"""A gene of the environment and the amount added to it: ``("environment.fog", 0.01)``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """The wanted velocity until the next decision, as a share (x, y) of the NPC's speed.

    Its length is at most 1; the paper's five actions are (0, 1), (0, -1), (-1, 0), (1, 0)
    and (0, 0).  ``begins`` says that the NPC begins its part, if its story waits for this decision.
    A policy may change the environment as well: ``changes`` take effect at once,
    each clipped to the gene's range, and are part of the flight's record.
    """

    x: float
    y: float
    changes: tuple[GeneChange, ...] = ()
    begins: bool = False


STAY = Move(x=0.0, y=0.0)


class NpcPolicy(Protocol):
    """Decides every 0.5 s where one NPC goes; each NPC has an instance of its own.

    ``rng`` is the NPC's own generator, derived from the scenario's seed.
    """

    def reset(self, situation: Situation, rng: np.random.Generator) -> None:
        """Prepare for one flight."""

    def decide(self, situation: Situation) -> Move:
        """Return the wanted velocity until the next decision."""


def decision(policy: NpcPolicy, situation: Situation) -> Move:
    """Return the policy's move; raise PolicyError if it raises or returns anything else."""
    name = f"NPC policy {type(policy).__name__}, deciding for {situation.self.name}"
    try:
        move = policy.decide(situation)
    except Exception as error:
        raise PolicyError(f"{name}: raised {type(error).__name__}: {error}") from error
    try:
        length = math.hypot(move.x, move.y)
        wrong = [each for each in move.changes if not _is_change(each)]
    except (AttributeError, TypeError):
        length, wrong = math.nan, []
    if not length <= 1 + 1e-9:
        raise PolicyError(
            f"{name}: found {move!r}; expected Move(x=…, y=…), a share of the NPC's speed "
            "no longer than 1"
        )
    if wrong:
        raise PolicyError(
            f"{name}: found the change {wrong[0]!r}; expected (gene, number) with one of "
            f"{', '.join(ENVIRONMENT)}"
        )
    return move


def _is_change(each: object) -> bool:
    match each:
        case (str(gene), int() | float() as amount) if isinstance(each, tuple):
            return gene in ENVIRONMENT and math.isfinite(amount)
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlook:
    """What a director of events is shown at a decision.

    ``moments_s`` are the times at which the moments of the landing came so far, infinite for the
    others.  ``is_readable`` is whether the marker could be read in the latest picture that the
    landing system got.
    """

    time_s: float
    uav_position_m: tuple[float, float, float]
    uav_velocity_mps: tuple[float, float, float]
    marker_position_m: tuple[float, float]
    moments_s: tuple[float, ...]
    is_readable: bool


class EventDirector(Protocol):
    """Decides in one flight when events strike; each flight has an instance of its own."""

    def strikes(self, outlook: Outlook, waiting: Sequence[str]) -> Collection[str]:
        """Return which of the events that wait strike now, at the next decision of the flight."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicySpec:
    """Names a policy so that a worker process can make it and a ledger can compare it.

    ``factory`` is "module:attribute", called with ``arguments`` as keyword arguments for each NPC.
    Whatever imports it raises PolicyError if that fails.
    """

    name: str
    factory: str
    arguments: tuple[tuple[str, str | int | float], ...] = ()

    @property
    def sha256(self) -> str:
        """The hash of a learned policy's weights; empty for the others."""
        return str(dict(self.arguments).get("sha256", ""))

    @property
    def reads_uav(self) -> bool:
        """Whether its NPCs may react to the UAV; a class says ``reads_uav = False`` if not."""
        return bool(getattr(self._load(), "reads_uav", True))

    @property
    def grade(self) -> str:
        """How much its NPCs know of the UAV, one of ``GRADES``; empty if each has its own grade.

        A class says ``grade = "curious"``.  Without that its NPCs are hostile if they may react to
        the UAV, else careless.
        """
        told = getattr(self._load(), "grade", None)
        if isinstance(told, str):
            return told
        return "hostile" if self.reads_uav else "careless"

    @property
    def decides_begin(self) -> bool:
        """Whether it decides when an NPC begins whose story waits for that."""
        return bool(getattr(self._load(), "decides_begin", False))

    def event_director(self) -> EventDirector | None:
        """Return what decides in one flight when events strike; None if the fixed rule does."""
        make = getattr(self._load(), "event_director", None)
        return make(**dict(self.arguments)) if make else None

    def directed_by(self, director: str) -> PolicySpec:
        """Return the policy with another director, if it decides when NPCs begin."""
        if not director or not self.decides_begin:
            return self
        return dataclasses.replace(self, arguments=(("director", director),))

    def _load(self) -> Any:
        module, _, attribute = self.factory.partition(":")
        try:
            return getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError) as error:
            raise PolicyError(
                f"NPC policy {self.name!r}: {self.factory!r} cannot be loaded ({error}); "
                "expected 'module:attribute' of an importable module"
            ) from error
        except Exception as error:
            # A user's own module may raise anything.
            raise PolicyError(
                f"NPC policy {self.name!r}: importing {module!r} raised "
                f"{type(error).__name__}: {error}"
            ) from error

    def make(self) -> NpcPolicy:
        """Return a fresh policy for one NPC; raise PolicyError if it cannot be made."""
        factory = self._load()
        try:
            policy: NpcPolicy = factory(**dict(self.arguments))
        except PolicyError:
            raise
        except Exception as error:
            raise PolicyError(
                f"NPC policy {self.name!r}: {self.factory} with {dict(self.arguments)} raised "
                f"{type(error).__name__}: {error}"
            ) from error
        return policy
