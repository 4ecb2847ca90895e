"""The genome as data, composite genes of nuclear genes of properties, and how it is drawn from.

In a sparse chromosome few optional genes are active, and all others are nominal.  Most faults show
with two or three interacting conditions (Kuhn, Wallace and Gallo 2004), and a scenario in which
little is unusual says what a failure is due to.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.groups import WEATHER
from pytest_garl.scenarios.quantities import Group, Quantity
from pytest_garl.scenarios.task import Task

if TYPE_CHECKING:
    from pytest_garl.scenarios.maps.map import Map

WeatherRange = Literal["confined", "full"]
ACTIVE = "active."
"""Begins the key of a bit of activity."""
CONFINED_WEATHER = 0.15
"""Upper end of a weather gene unless the full range is asked for (paper, section 4.2.3)."""
COUNT_SHARES = (0.1, 0.3, 0.3, 0.3)
"""Shares of scenarios with 0, 1, 2 and 3 active genes."""
MOST_ACTIVE = len(COUNT_SHARES) - 1
"""Of a bred chromosome too: without it, five generations of the paper's operators make 8 of 18
groups active."""
OUTER_SHARE = 0.5
"""Share of the draws of a property that lie in the outer third of its range."""
ON, OFF = 0.75, 0.25
"""A bit of activity as it is drawn."""
ON_ABOVE = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class NuclearGene:
    """Properties that crossover never separates: a fog density, or a place (x, y).

    If the first one is a bit of activity (:data:`ACTIVE`), the others count only while it is above
    0.5: else a condition has its nominal value, and an object is not there.
    """

    name: str
    properties: tuple[Quantity, ...]

    @property
    def is_optional(self) -> bool:
        """Whether it has a bit of activity."""
        return self.properties[0].key.startswith(ACTIVE)

    @property
    def values(self) -> tuple[Quantity, ...]:
        """The properties without the bit of activity."""
        return self.properties[1:] if self.is_optional else self.properties


@dataclass(frozen=True, slots=True, kw_only=True)
class CompositeGene:
    """Nuclear genes of one subject: the environment, the marker, the NPCs."""

    name: str
    genes: tuple[NuclearGene, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Genome:
    """All properties that may vary in a scenario on one map, in a fixed order.

    ``task``, the values ``fixed``, by key, and the objects of the map that are ``removed`` are
    what its scenarios have in common.  In scenarios of a dense genome all optional genes may act,
    and act when drawn, instead of at most three.  Raises ScenarioError if a key occurs twice.
    """

    composites: tuple[CompositeGene, ...]
    task: Task = field(default_factory=Task)
    fixed: tuple[tuple[str, float], ...] = ()
    removed: tuple[str, ...] = ()
    is_dense: bool = False

    def __post_init__(self) -> None:
        twice = sorted({key for key in self.keys if self.keys.count(key) > 1})
        if twice:
            raise ScenarioError(
                f"genome: {', '.join(twice)} occurs more than once; keys must be unique"
            )

    @property
    def genes(self) -> tuple[NuclearGene, ...]:
        """All nuclear genes in order."""
        return tuple(gene for composite in self.composites for gene in composite.genes)

    @property
    def properties(self) -> tuple[Quantity, ...]:
        """All properties in order: the columns of a chromosome."""
        return tuple(item for gene in self.genes for item in gene.properties)

    @property
    def keys(self) -> tuple[str, ...]:
        """The properties' keys in order."""
        return tuple(item.key for item in self.properties)

    @property
    def size(self) -> int:
        """Number of properties."""
        return len(self.properties)

    @property
    def lower(self) -> NDArray[np.float64]:
        """Lower bounds, shape (size,)."""
        return np.array([item.low for item in self.properties])

    @property
    def upper(self) -> NDArray[np.float64]:
        """Upper bounds, shape (size,)."""
        return np.array([item.high for item in self.properties])

    @property
    def nominal(self) -> NDArray[np.float64]:
        """Nominal values, shape (size,): clear weather, noon, a marker at its GPS coordinate."""
        return np.array([item.nominal for item in self.properties])

    @property
    def borders(self) -> tuple[int, ...]:
        """Columns at which a nuclear gene begins, without 0: crossover cuts only there."""
        starts = np.cumsum([len(gene.properties) for gene in self.genes])
        return tuple(int(start) for start in starts[:-1])

    def random(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw a chromosome, shape (size,).

        Uniformly from the whole range; where genes are optional, few of them are active
        (``draw``).
        """
        if any(gene.is_optional for gene in self.genes):
            return draw(self, rng)
        return rng.uniform(self.lower, self.upper)

    def random_active(self, rng: np.random.Generator, names: Iterable[str]) -> NDArray[np.float64]:
        """Draw a chromosome, shape (size,), in which the named optional genes are active."""
        return draw(self, rng, names)

    def normalise(self, chromosome: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map gene units, (..., n), onto [0, 1], for distances between chromosomes."""
        scaled: NDArray[np.float64] = (chromosome - self.lower) / (self.upper - self.lower)
        return scaled


def draw(
    genome: Genome, rng: np.random.Generator, names: Iterable[str] | None = None
) -> NDArray[np.float64]:
    """Draw a chromosome, (n,), with at most three active optional genes, or all if dense.

    With ``names`` these are active.
    """
    optional = [gene.name for gene in genome.genes if gene.is_optional]
    active = {*optional} if names is None else {*names}
    if not genome.is_dense and names is None:
        count = min(int(rng.choice(len(COUNT_SHARES), p=COUNT_SHARES)), len(optional))
        active = {optional[index] for index in rng.choice(len(optional), size=count, replace=False)}
    row: list[float] = []
    for gene in genome.genes:
        is_active = not gene.is_optional or gene.name in active
        if gene.is_optional:
            row.append(ON if is_active else OFF)
        row += [_value(item, rng) if is_active else item.nominal for item in gene.values]
    return np.array(row)


def active_genes(genome: Genome, row: Mapping[str, float], seed: int) -> frozenset[str]:
    """Return the names of the optional genes that act: of those that are on, the three highest.

    So a bit of activity is a priority, and any operator breeds sparse scenarios.  The scenario's
    seed decides between equal ones, so that no gene is preferred for its place in the genome.  In a
    dense genome all that are on act.
    """
    priorities = {
        gene.name: row[gene.properties[0].key] for gene in genome.genes if gene.is_optional
    }
    names = [name for name, priority in priorities.items() if priority > ON_ABOVE]
    if len(names) > MOST_ACTIVE and not genome.is_dense:
        order = np.random.default_rng(seed).permutation(len(names))
        shuffled = [names[index] for index in order]
        names = sorted(shuffled, key=lambda name: -priorities[name])[:MOST_ACTIVE]
    return frozenset(names)


def _value(item: Quantity, rng: np.random.Generator) -> float:
    """Draw a value; of one that is not even half lie in the third farthest from nominal."""
    if item.even:
        return float(rng.uniform(item.low, item.high))
    below, above = item.nominal - item.low, item.high - item.nominal
    side = above if rng.uniform(0, below + above) >= below else -below
    outer = rng.random() < OUTER_SHARE
    share = rng.uniform(2 / 3, 1.0) if outer else rng.uniform(0.0, 2 / 3)
    return min(item.high, max(item.low, float(item.nominal + side * share)))


def weather_value(key: str, low: float, high: float, *, even: bool) -> Quantity:
    """Return the value of a weather gene within limits, as a share of its strongest effect."""
    return Quantity(
        key=key, low=low, high=high, nominal=low, meaning=WEATHER[key].meaning, even=even
    )


def sun_value(lowest: float = 0.0, *, even: bool) -> Quantity:
    """Return the sun's position on its way over the day, which ends as low as it begins."""
    return Quantity(
        key=SUN,
        low=lowest,
        high=1 - lowest,
        nominal=0.5,
        meaning="position of the sun (0: dawn in the east, 0.5: noon, 1: dusk in the west)",
        even=even,
    )


def place_gene(prefix: str, name: str, meaning: str) -> NuclearGene:
    """Return a gene of two properties x and y from -1 to 1, which crossover never separates."""
    return NuclearGene(
        name=name,
        properties=tuple(
            Quantity(
                key=f"{prefix}.{axis}",
                low=-1.0,
                high=1.0,
                meaning=f"{meaning}, {axis}",
                even=True,
            )
            for axis in ("x", "y")
        ),
    )


SUN = "environment.sun_position"
ENVIRONMENT = (*WEATHER, SUN)
"""Keys of the environment's properties; none is below 0 or above 1."""
CLEAR = dict.fromkeys(ENVIRONMENT, 0.0) | {SUN: 0.5}
"""Their nominal values: clear weather at noon."""


def genome_for(
    map: Map,
    *,
    weather: WeatherRange = "confined",
    extras: Iterable[CompositeGene] = (),
    task: Task | None = None,
) -> Genome:
    """Return the genome of scenarios on ``map``: environment, marker, its NPCs, extras.

    Without a task its scenarios have the map's marker.
    """
    top = CONFINED_WEATHER if weather == "confined" else 1.0
    values = [weather_value(key, 0.0, top, even=True) for key in WEATHER]
    environment = CompositeGene(
        name="environment",
        genes=tuple(
            NuclearGene(name=each.name, properties=(each,))
            for each in (*values, sun_value(even=True))
        ),
    )
    marker = CompositeGene(
        name="marker",
        genes=(place_gene("marker", "position", "place of the marker in its disc of 7.5 m"),),
    )
    objects = CompositeGene(
        name="objects", genes=tuple(object_gene(name) for name, _ in map.present_objects)
    )
    return Genome(
        composites=(environment, marker, objects, *extras),
        task=Task(marker=map.marker) if task is None else task,
    )


def group_gene(group: Group) -> CompositeGene:
    """Return the gene of a group of conditions, in physical units over all that can be flown."""
    gene = NuclearGene(name=group.name, properties=group.quantities)
    return CompositeGene(name=group.name, genes=(gene,))


def within(quantity: Quantity, low: float, high: float, **changes: Any) -> Quantity:
    """Return a quantity with narrower limits; the nearest value in them is its nominal one."""
    nominal = min(high, max(low, quantity.nominal))
    return replace(quantity, low=low, high=high, nominal=nominal, **changes)


def end_of_way(name: str, end: str) -> tuple[Quantity, ...]:
    """Return the place at one end of an NPC's way; both ends have the same nominal corner."""
    return tuple(
        Quantity(
            key=f"{name}.{end}_{axis}",
            low=-1.0,
            high=1.0,
            nominal=0.9,
            meaning=f"{end} over the map's bounds, {axis}",
            even=True,
        )
        for axis in ("x", "y")
    )


def object_gene(name: str) -> NuclearGene:
    """Return the gene of an NPC: where it starts, and how fast it is."""
    velocity = Quantity(
        key=f"{name}.velocity",
        low=0.0,
        high=1.0,
        meaning="speed as a share of the type's top speed",
        even=True,
    )
    return NuclearGene(name=name, properties=(*end_of_way(name, "start"), velocity))
