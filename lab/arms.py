"""The arms that the judges compare: a search method, and who lets NPCs begin, by name.

Each arm flies the domain `field`.  A search of an arm has the same first generation as one of
``random`` with its seed, the control, but for the arm ``gene``, which has no ``decided`` to draw,
and for ``exploring``, which knows no moments.

`random`
    Draws all scenarios uniformly.
`exploring`
    The draws of commit :data:`BEFORE_MOMENTS`, without children and without a model: the strongest
    rival of the search before events and stories could wait for moments.  A work tree of that
    commit flies it (``lab/judges/frozen.py``).
`exploring+`
    Stratified scenarios with moments and the same director as `garl`; no children, no model.
`garl`
    The search as it ships.
`shuffled`
    The same machinery with a model that is fitted to exchanged results, and knows nothing.
`rule`
    `garl`, but the rule of time to go lets NPCs begin; `rule@1.5` has a margin of 1.5 s.
`gene`
    `garl`, but the begin of each NPC and event is a gene: nothing waits for a decision.
`shipped`
    `garl`, but its director keeps the weights that ship, and learns nothing of the system.
`untrained`
    `garl`, but a network with random weights lets NPCs begin.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pytest_garl.errors import GarlError
from pytest_garl.npcs.directed import TIME_TO_GO
from pytest_garl.npcs.director import FEATURES, RULE, WAITING
from pytest_garl.npcs.domain_policy import GRADED
from pytest_garl.npcs.gradient import untrained
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.genes import Genome, NuclearGene
from pytest_garl.scenarios.groups import DECIDED, EVENT_MOMENTS
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.story import STORY_MOMENTS
from pytest_garl.search.method import Method, SearchPlan
from pytest_garl.search.method_catalogue import find_method
from pytest_garl.search.methods.garl import EXPLORING, Garl, GarlParameters
from pytest_garl.simulation.npc_policy import PolicySpec

DOMAIN = domain_named("field")
BEFORE_MOMENTS = "d16e6dc"
"""The commit before events and stories could wait for moments."""
SEED = 5100
"""Of the untrained network."""


def decided_by(decider: str) -> PolicySpec:
    """Return the policy of `field` with the director that an arm names."""
    kind, _, margin = decider.partition("@")
    director = ""
    if kind == "rule":
        director = f"{TIME_TO_GO} {float(margin or RULE.margin_s):g} {RULE.unseen_s:g}"
    elif kind == "untrained":
        director = untrained(WAITING, (len(FEATURES), 24, 24, 2), SEED).text
    return policy_spec(GRADED).directed_by(director)


def without_decisions(genome: Genome) -> Genome:
    """Return a genome that draws no story and no event which waits for a decision."""

    def undecided(item: Quantity) -> Quantity:
        if item.key.endswith(".phase"):
            # A story rounds down, so that this is the choice before.
            return dataclasses.replace(item, high=STORY_MOMENTS.index(DECIDED) - 1e-6)
        if item.key.endswith(".after"):
            return dataclasses.replace(item, high=EVENT_MOMENTS.index(DECIDED) - 1.0)
        return item

    def gene(each: NuclearGene) -> NuclearGene:
        return dataclasses.replace(each, properties=tuple(map(undecided, each.properties)))

    composites = (
        dataclasses.replace(each, genes=tuple(map(gene, each.genes))) for each in genome.composites
    )
    return dataclasses.replace(genome, composites=tuple(composites))


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """One arm: ``make`` starts its search method, ``npcs`` moves the NPCs.

    ``learns`` says whether the director learns from the flights.
    """

    name: str
    make: Callable[[SearchPlan], Method]
    npcs: PolicySpec
    learns: bool


def _garl(plan: SearchPlan, parameters: GarlParameters | None = None) -> Method:
    return Garl(plan, parameters)


def _as_gene(plan: SearchPlan) -> Method:
    return Garl(dataclasses.replace(plan, genome=without_decisions(plan.genome)))


_MADE: dict[str, Callable[[SearchPlan], Method]] = {
    "random": find_method("random"),
    "exploring+": functools.partial(_garl, parameters=EXPLORING),
    "garl": _garl,
    "shuffled": functools.partial(_garl, parameters=GarlParameters(shuffled=True)),
    "rule": _garl,
    "gene": _as_gene,
    "shipped": _garl,
    "untrained": _garl,
}
FROZEN = "exploring"
ARMS: Sequence[str] = (*_MADE, FROZEN)
"""The names of all arms."""


def arm_named(name: str) -> Arm:
    """Return an arm; raise GarlError for an unknown name, and for the arm that is frozen."""
    kind, _, margin = name.partition("@")
    if kind == FROZEN:
        raise GarlError(
            f"the arm {FROZEN!r} is flown by commit {BEFORE_MOMENTS}: `python -m lab.judges causes`"
        )
    if kind not in _MADE or (margin and kind != "rule"):
        raise GarlError(f"unknown arm {name!r}; expected one of {', '.join(ARMS)}, rule@SECONDS")
    learns = kind not in ("rule", "untrained", "shipped", "gene")
    return Arm(name=name, make=_MADE[kind], npcs=decided_by(name), learns=learns)
