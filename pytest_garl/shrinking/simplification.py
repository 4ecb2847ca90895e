"""Simpler scenarios: how to make them, how complex they are, and trials within a budget."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from pytest_garl.scenarios.conditions import active_conditions, cause_of_key
from pytest_garl.scenarios.genes import Genome, NuclearGene
from pytest_garl.scenarios.genome_like import genome_like
from pytest_garl.scenarios.groups import QUANTITIES
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.scenario import MARKER_PLACE, Scenario
from pytest_garl.scenarios.story import STORY
from pytest_garl.scenarios.validity import repair

Simplification = Callable[[Scenario], Scenario]
PLACE = "the marker's place"


class Simplifications(NamedTuple):
    """The ways to make a scenario simpler: to remove an object, to make a condition nominal.

    Conditions come with the mildest first, the marker's place before all.
    """

    objects: list[Simplification]
    conditions: list[Simplification]

    @property
    def all(self) -> list[Simplification]:
        """All of them."""
        return [*self.objects, *self.conditions]


def simplifications(scenario: Scenario, genome: Genome, colliding_object: str) -> Simplifications:
    """Return the ways to make a scenario simpler.

    No way removes the object that the UAV hit, or moves an object.
    """
    objects = [
        _removal(key.partition(".")[0])
        for key, _ in scenario.genes
        if key.endswith(".velocity") and key.partition(".")[0] != colliding_object
    ]
    conditions: list[tuple[float, Simplification]] = []
    for gene in genome.genes:
        nominal = {item.key: item.nominal for item in gene.properties}
        if any(key.endswith(".velocity") for key in nominal):
            continue
        if all(scenario[key] == value for key, value in nominal.items()):
            continue
        conditions.append((_strength(scenario, gene), _reset(nominal)))
    conditions.sort(key=lambda each: each[0])
    return Simplifications(objects=objects, conditions=[step for _, step in conditions])


def removals(
    scenario: Scenario, map: Map, colliding_object: str
) -> dict[str, list[Simplification]]:
    """Return how to remove each object, and how to make each condition nominal, by name.

    A condition may have several genes.  The object that was hit is not named, and the marker's
    place only if no object was hit.
    """
    found: dict[str, list[Simplification]] = {}
    for key, _ in scenario.genes:
        name = key.partition(".")[0]
        if key.endswith(".velocity") and name != colliding_object:
            found[name] = [_removal(name)]
    active = {each.cause for each in active_conditions(scenario)}
    for gene in genome_of_scenario(scenario, map).genes:
        nominal = {item.key: item.nominal for item in gene.properties}
        cause = cause_of_key(gene.properties[0].key)
        if cause in active and any(scenario[key] != value for key, value in nominal.items()):
            found.setdefault(cause, []).append(_reset(nominal))
    if scenario.has_moved_marker and not colliding_object:
        found[PLACE] = [_reset(dict.fromkeys(MARKER_PLACE, 0.0))]
    return found


def value_simplifications(scenario: Scenario, genome: Genome) -> dict[str, list[Simplification]]:
    """Return the ways to make single values nominal, for each condition with several, by name.

    Values come with the mildest first.  Kinds and times stay with them, and directions that act
    with them only.
    """
    found = {}
    for gene in genome.genes:
        if gene.properties[0].key not in QUANTITIES:
            continue
        values = sorted(
            (_distance(scenario, item), item.key, item.nominal)
            for item in gene.properties
            if QUANTITIES[item.key].has_harsher_end or QUANTITIES[item.key].acts_alone
            if scenario[item.key] != item.nominal
        )
        if len(values) > 1:
            cause = cause_of_key(values[0][1])
            found[cause] = [_reset({key: nominal}) for _, key, nominal in values]
    return found


def _strength(scenario: Scenario, gene: NuclearGene) -> float:
    """Return how far a gene is from nominal, 0..1; 0 for the marker's place, seldom a cause."""
    return max(
        0.0 if item.key in MARKER_PLACE else _distance(scenario, item) for item in gene.properties
    )


def _distance(scenario: Scenario, item: Quantity) -> float:
    return abs(scenario[item.key] - item.nominal) / (item.high - item.low)


def simplified(scenario: Scenario, steps: Sequence[Simplification]) -> Scenario:
    """Return a scenario with all simplifications applied."""
    for step in steps:
        scenario = step(scenario)
    return scenario


def bare_scenario(scenario: Scenario, map: Map, colliding_object: str) -> Scenario:
    """Return a scenario with only those parts that its failure is likely to need.

    A collision needs the object that was hit; everything else is nominal.  Any other failure has
    its cause in weather, light or place, and needs no object.
    """
    if colliding_object:
        return _nominal(scenario, map, colliding_object)
    return without_other_objects(scenario, map, "")


def bare_scenario_around_marker(scenario: Scenario, map: Map, colliding_object: str) -> Scenario:
    """Return the bare scenario with the marker at its old place, around which the object moved."""
    place = {key: value for key, value in scenario.genes if key in MARKER_PLACE}
    return repair(_nominal(scenario, map, colliding_object).replace(place), map)


def without_other_objects(scenario: Scenario, map: Map, colliding_object: str) -> Scenario:
    """Return a scenario with no object but the one that was hit, everything else unchanged."""
    names = [key.partition(".")[0] for key, _ in scenario.genes if key.endswith(".velocity")]
    return repair(scenario.without(*(name for name in names if name != colliding_object)), map)


def empty_scenario(scenario: Scenario, map: Map) -> Scenario:
    """Return a scenario with everything nominal and no object."""
    return _nominal(scenario, map, "")


def _nominal(scenario: Scenario, map: Map, colliding_object: str) -> Scenario:
    steps = simplifications(scenario, genome_of_scenario(scenario, map), colliding_object).all
    return repair(simplified(scenario, steps), map)


def _removal(name: str) -> Simplification:
    return lambda scenario: scenario if name in scenario.removed_objects else scenario.without(name)


def _reset(values: dict[str, float]) -> Simplification:
    return lambda scenario: scenario.replace(values)


CHOICES = (*(f".{name}" for name, each in STORY.items() if each.quantity.choices), ".after")
"""Ends of the keys of choices, such as the grade of an object and the moment for which an event
waits: there is nothing between two."""
OBJECT_PLACES = (
    *("start_x", "start_y", "destination_x", "destination_y"),
    *(f".{name}" for name, each in STORY.items() if each.is_place),
    ".delay_s",
    *CHOICES,
)
"""Ends of keys whose distance from nominal is not counted: no place and no time of an object is
simpler than another, and no choice but the grade, which counts first; only their digits count."""


def genome_of_scenario(scenario: Scenario, map: Map) -> Genome:
    """Return the genome of a scenario's own genes, weather in its full range."""
    return genome_like((key for key, _ in scenario.genes), map)


def strongest_grade(scenario: Scenario) -> int:
    """Return the number of the strongest grade of an object, from 1 on; 0 if none has a grade."""
    grades = [1 + int(value) for key, value in scenario.genes if key.endswith(".grade")]
    return max(grades, default=0)


class Complexity(NamedTuple):
    """How complex a scenario is, compared in this order; less is simpler.

    The strongest grade of an object; the number of objects, and of genes off nominal; the distance
    of these from nominal, each from 0 to 1; digits.
    """

    grade: int
    objects: int
    genes: int
    distance: float
    digits: int


def complexity(scenario: Scenario, genome: Genome) -> Complexity:
    """Return how complex a scenario is."""
    present = dict(scenario.genes)
    off, distance = 0, 0.0
    for gene in genome.genes:
        shares = [
            abs(present[item.key] - item.nominal) / (item.high - item.low)
            for item in gene.properties
            if item.key in present and not item.key.endswith(OBJECT_PLACES)
        ]
        off += any(share > 0 for share in shares)
        for share in shares:
            distance += share
    objects = sum(key.endswith(".velocity") for key in present)
    digits = sum(len(repr(value)) for value in present.values())
    return Complexity(strongest_grade(scenario), objects, off, round(distance, 2), digits)


class BudgetSpentError(Exception):
    """The budget of flights is spent."""


class Trials:
    """Flies each scenario once, within a budget, and remembers the simplest that failed."""

    def __init__(
        self, first: Scenario, fails: Callable[[Scenario], bool], map: Map, budget: int
    ) -> None:
        self.map, self._fails, self._left = map, fails, budget
        self.genome = genome_of_scenario(first, map)
        self._known = {first: True}
        self.history = [first]
        self.flights = 0

    @property
    def best(self) -> Scenario:
        """The simplest scenario that failed."""
        return self.history[-1]

    def __call__(self, scenario: Scenario) -> bool:
        """Return whether a scenario fails; raise BudgetSpentError if no flight is left for it."""
        scenario = repair(scenario, self.map)
        if scenario not in self._known:
            if self._left <= 0:
                raise BudgetSpentError
            self._left -= 1
            self.flights += 1
            self._known[scenario] = self._fails(scenario)
        failed = self._known[scenario]
        if failed and complexity(scenario, self.genome) < complexity(self.best, self.genome):
            self.history.append(scenario)
        return failed
