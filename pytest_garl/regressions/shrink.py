"""Shrinking: the simplest scenario that still fails in the same way.

Two passes.  The first is cheap: send everybody home whom the failure does not need, reset genes to
nominal, halving the set where all together is too much, then move what is left nearer to nominal by
bisection.  The second is Hypothesis's shrinker on whole steps from nominal, which finds what only
goes together.  Simpler means: fewer objects, fewer genes off nominal, nearer to nominal, and
numbers with fewer digits.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings
from hypothesis import strategies as st
from hypothesis.database import ExampleDatabase, choices_to_bytes

from pytest_garl.scenarios.extra_genes import genome_like
from pytest_garl.scenarios.genes import Genome, NuclearGene, Property
from pytest_garl.scenarios.maps.map import Map
from pytest_garl.scenarios.scenario import Scenario
from pytest_garl.scenarios.validity import repair

STEPS = 20
"""Steps from nominal to the end of a gene's range: a twentieth is read and compared at a glance."""
BISECTIONS = 3
"""Flights spent on how near to nominal one gene can go: to an eighth of its distance."""
_PLACES = ("start_x", "start_y", "destination_x", "destination_y")
"""No place of an object is simpler than another; only their digits count."""
PLACES = ("marker.x", "marker.y")
"""Where the marker lies; what an object did around it would go past it elsewhere."""
Change = Callable[[Scenario], Scenario]


class SpentError(Exception):
    """The budget of flights is spent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shrunk:
    """Every scenario that failed on the way, from the first to the simplest, and the flights."""

    history: tuple[Scenario, ...]
    flights: int

    @property
    def simplest(self) -> Scenario:
        """The last of them."""
        return self.history[-1]


class Trials:
    """Flies each scenario once, within a budget, and remembers the simplest that failed."""

    def __init__(
        self, first: Scenario, fails: Callable[[Scenario], bool], map: Map, budget: int
    ) -> None:
        self.map, self._fails, self._left = map, fails, budget
        self.genome = genome_of(first, map)
        self._known = {first: True}
        self.history = [first]
        self.flights = 0

    @property
    def best(self) -> Scenario:
        """The simplest scenario that failed."""
        return self.history[-1]

    def __call__(self, scenario: Scenario) -> bool:
        """Whether a scenario fails in the same way; raise SpentError where nobody knows yet."""
        scenario = repair(scenario, self.map)
        if scenario not in self._known:
            if self._left <= 0:
                raise SpentError
            self._left -= 1
            self.flights += 1
            self._known[scenario] = self._fails(scenario)
        failed = self._known[scenario]
        if failed and complexity(scenario, self.genome) < complexity(self.best, self.genome):
            self.history.append(scenario)
        return failed


def shrink(
    first: Scenario,
    fails: Callable[[Scenario], bool],
    map: Map,
    budget: int,
    *,
    colliding_object: str = "",
    passes: Sequence[Callable[[Trials, str], None]] | None = None,
) -> Shrunk:
    """Return the simplest scenario found with at most ``budget`` flights.

    ``first`` is known to fail; ``colliding_object`` is the one that the failure cannot do without.
    """
    trials = Trials(first, fails, map, budget)
    try:
        for each in (reset_and_bisect, by_hypothesis, tidy) if passes is None else passes:
            each(trials, colliding_object)
    except SpentError:
        pass
    return Shrunk(history=tuple(trials.history), flights=trials.flights)


def genome_of(scenario: Scenario, map: Map) -> Genome:
    """Return the genome of a scenario's own genes, weather in its full range."""
    return genome_like((key for key, _ in scenario.genes), map)


def complexity(scenario: Scenario, genome: Genome) -> tuple[int, int, float, int]:
    """Return objects present, genes off nominal, their distance, digits: what shrinking lowers."""
    present = dict(scenario.genes)
    off, distance = 0, 0.0
    for gene in genome.genes:
        shares = [
            abs(present[item.key] - item.nominal) / (item.high - item.low)
            for item in gene.properties
            if item.key in present and not item.key.endswith(_PLACES)
        ]
        off += any(share > 0 for share in shares)
        distance += sum(shares)
    objects = sum(key.endswith(".velocity") for key in present)
    digits = sum(len(repr(value)) for value in present.values())
    return objects, off, round(distance, 2), digits


def reset_and_bisect(trials: Trials, colliding_object: str) -> None:
    """Reset all that can be reset, in the largest pieces; then go nearer to nominal."""
    groups = _simplifications(trials, colliding_object)
    everything = [change for group in groups for change in group]
    if len(groups) > 1 and trials(_applied(trials.best, everything)):
        return _bisect(trials)
    for group in groups:
        _reset(trials, group)
    return _bisect(trials)


def bare(first: Scenario, map: Map, colliding_object: str) -> Scenario:
    """Return a scenario without all that its failure should not need.

    A collision needs the object that was hit, everything else is nominal; any other failure has
    its cause in weather, light or place, and needs no object.
    """
    return _nominal(first, map, colliding_object) if colliding_object else alone(first, map, "")


def clear(first: Scenario, map: Map, colliding_object: str) -> Scenario:
    """Return a scenario like ``bare``, but the marker stays where the object went around it."""
    places = {key: value for key, value in first.genes if key in PLACES}
    return repair(_nominal(first, map, colliding_object).replace(places), map)


def alone(first: Scenario, map: Map, colliding_object: str) -> Scenario:
    """Return a scenario with no object but the colliding object, everything else as it was."""
    names = [key.partition(".")[0] for key, _ in first.genes if key.endswith(".velocity")]
    return repair(first.without(*(name for name in names if name != colliding_object)), map)


def nobody(first: Scenario, map: Map) -> Scenario:
    """Return a scenario with everything nominal and no object."""
    return _nominal(first, map, "")


def _nominal(first: Scenario, map: Map, colliding_object: str) -> Scenario:
    groups = _simplifications(Trials(first, lambda _: False, map, 0), colliding_object)
    return repair(_applied(first, [change for group in groups for change in group]), map)


def _simplifications(trials: Trials, colliding_object: str) -> list[list[Change]]:
    """Return ways to make a scenario simpler: by objects, by weather, by light and place."""
    first = trials.best
    removable = [
        _sends_home(key.partition(".")[0])
        for key, _ in first.genes
        if key.endswith(".velocity") and key.partition(".")[0] != colliding_object
    ]
    weather: list[Change] = []
    rest: list[Change] = []
    for gene in trials.genome.genes:
        nominal = {item.key: item.nominal for item in gene.properties}
        head = next(iter(nominal)).partition(".")[0]
        if any(key.endswith(".velocity") for key in nominal):
            continue
        if all(first[key] == value for key, value in nominal.items()):
            continue
        is_weather = head == "environment" and "environment.sun_position" not in nominal
        (weather if is_weather else rest).append(_resets(nominal))
    return [group for group in (removable, weather, rest) if group]


def _sends_home(name: str) -> Change:
    return lambda scenario: scenario if name in scenario.removed_objects else scenario.without(name)


def _resets(values: dict[str, float]) -> Change:
    return lambda scenario: scenario.replace(values)


def _applied(scenario: Scenario, changes: Sequence[Change]) -> Scenario:
    for change in changes:
        scenario = change(scenario)
    return scenario


def _reset(trials: Trials, changes: Sequence[Change]) -> None:
    """Apply as many changes as the failure survives."""
    if trials(_applied(trials.best, changes)) or len(changes) == 1:
        return
    middle = len(changes) // 2
    _reset(trials, changes[:middle])
    _reset(trials, changes[middle:])


def _bisect(trials: Trials) -> None:
    """Bring what is off nominal as near to it as the failure survives."""
    for gene in trials.genome.genes:
        start = trials.best
        present = {key for key, _ in start.genes}
        moved = [
            item
            for item in gene.properties
            if item.key in present
            and not item.key.endswith(_PLACES)
            and start[item.key] != item.nominal
        ]
        if not moved:
            continue
        least, most = 0.0, 1.0
        for _ in range(BISECTIONS):
            share = (least + most) / 2
            near = {i.key: i.nominal + share * (start[i.key] - i.nominal) for i in moved}
            if trials(trials.best.replace(near)):
                most = share
            else:
                least = share


def tidy(trials: Trials, colliding_object: str) -> None:
    """Write values with as few digits as the failure survives."""
    for digits in (2, 3, 4):
        rounded = {key: round(value, digits) for key, value in trials.best.genes}
        if trials(trials.best.replace(rounded)):
            return


class _HandedOver(ExampleDatabase):
    """Holds one failing input, in the secondary part: what is in the primary counts as shrunk."""

    def __init__(self, choices: bytes) -> None:
        super().__init__()
        self._choices = choices

    def fetch(self, key: bytes) -> Iterable[bytes]:
        return [self._choices] if key.endswith(b".secondary") else []

    def save(self, key: bytes, value: bytes) -> None:
        """Keep nothing: the simplest is kept by the trials."""

    def delete(self, key: bytes, value: bytes) -> None:
        """Keep what was handed over."""


def by_hypothesis(trials: Trials, colliding_object: str) -> None:
    """Let Hypothesis shrink the failing scenario as whole steps from nominal.

    The failing input is handed over through the example database.
    """
    first = trials.best
    lines = list(_lines(trials, colliding_object))
    start = [steps for _, _, steps in lines]

    def build(drawn: Sequence[int]) -> Scenario:
        scenario = first
        for (change, _, _), value in zip(lines, drawn, strict=True):
            scenario = change(scenario, value)
        return scenario

    @settings(
        database=_HandedOver(choices_to_bytes(start)),
        max_examples=100_000,
        phases=(Phase.reuse, Phase.shrink),
        deadline=None,
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
        print_blob=False,
        verbosity=Verbosity.quiet,
    )
    @seed(0)
    @given(st.tuples(*(strategy for _, strategy, _ in lines)))
    def test(drawn: tuple[int, ...]) -> None:
        with contextlib.suppress(SpentError):
            # Hypothesis ends of itself where nothing new fails.
            assert not trials(build(drawn))

    with contextlib.suppress(AssertionError):
        # That it fails is known; the simplest is kept by the trials.
        test()


_Line = tuple[Callable[[Scenario, int], Scenario], st.SearchStrategy[int], int]


def _lines(trials: Trials, colliding_object: str) -> Iterator[_Line]:
    """Yield for each thing that may vary: how to apply a step, its strategy, the present step."""
    first = trials.best
    present = {key for key, _ in first.genes}
    for key in sorted(key for key in present if key.endswith(".velocity")):
        name = key.partition(".")[0]
        if name != colliding_object:
            yield _presence(name), st.integers(0, 1), 1
    for gene in trials.genome.genes:
        yield from _steps(gene, first, present)


def _presence(name: str) -> Callable[[Scenario, int], Scenario]:
    return lambda scenario, there: scenario if there else scenario.without(name)


def _steps(gene: NuclearGene, first: Scenario, present: set[str]) -> Iterator[_Line]:
    for item in gene.properties:
        if item.key not in present or item.key.endswith(_PLACES):
            continue
        value = first[item.key]
        if value == item.nominal:
            continue
        end = item.high if value > item.nominal else item.low
        step = max(1, round(STEPS * (value - item.nominal) / (end - item.nominal)))
        yield _stepped(item, end, step, value), st.integers(0, STEPS), step


def _stepped(
    item: Property, end: float, first: int, value: float
) -> Callable[[Scenario, int], Scenario]:
    """Return how to put a gene on a step; the first one is its present value, to the bit."""

    def apply(scenario: Scenario, step: int) -> Scenario:
        if all(key != item.key for key, _ in scenario.genes):
            return scenario
        on_grid = item.nominal + step / STEPS * (end - item.nominal)
        return scenario.replace({item.key: value if step == first else on_grid})

    return apply
