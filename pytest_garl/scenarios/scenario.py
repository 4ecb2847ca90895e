"""A scenario: one point of the search space, with everything that repeats its flight."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

from pytest_garl.errors import ScenarioError
from pytest_garl.scenarios.groups import DECIDED, EVENT_MOMENTS, QUANTITIES
from pytest_garl.scenarios.task import Task

MARKER_PLACE = ("marker.x", "marker.y")
"""Keys of the marker's place in its disc; both are 0 in the middle, which is nominal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One scenario: a map, a value for each property of its genes, and a seed of its own.

    ``genes`` holds (key, value) pairs in the genome's order, values in gene units: for
    example ``("environment.fog", 0.05)``, ``("marker.x", -0.3)``,
    ``("person-1.velocity", 0.8)``.  The meaning of a value in metres or lux is said by the
    genome's properties and the simulator.  ``seed`` feeds the sensor noise, the falling
    particles and the undirected object moves; it does not depend on the scenario's slot.
    ``removed_objects`` names the objects of the map that this scenario flies without; they have no
    genes.  A search removes none; shrinking removes those that a violation does not need.  ``task``
    is what the user states of the marker and the start, the same in all scenarios of a test.
    """

    map: str
    seed: int
    genes: tuple[tuple[str, float], ...]
    removed_objects: tuple[str, ...] = ()
    task: Task = field(default_factory=Task)

    def __getitem__(self, key: str) -> float:
        """Return the value of a property, or the nominal one of a condition that is not named.

        Raises ScenarioError for any other key that is not there.
        """
        for name, value in self.genes:
            if name == key:
                return value
        if key in QUANTITIES:
            return QUANTITIES[key].nominal
        raise ScenarioError(
            f"the scenario on map {self.map!r} has no gene {key!r}; "
            f"it has {', '.join(name for name, _ in self.genes)}"
        )

    def get(self, key: str, default: float) -> float:
        """Return the value of a property, or ``default`` where the genome lacks it."""
        return next((value for name, value in self.genes if name == key), default)

    @property
    def has_moved_marker(self) -> bool:
        """Whether the marker is not at its nominal place."""
        return any(self.get(key, 0.0) != 0 for key in MARKER_PLACE)

    @property
    def decided_events(self) -> tuple[str, ...]:
        """The groups whose event the director lets strike in flight."""
        return tuple(
            key.partition(".")[0]
            for key, value in self.genes
            if key.endswith(".after")
            and EVENT_MOMENTS[int(QUANTITIES[key].flown(value))] == DECIDED
        )

    def replace(self, values: Mapping[str, float]) -> Scenario:
        """Return a copy in which the named properties have other values."""
        for key in values:
            self[key]
        kept = {name: float(values.get(name, value)) for name, value in self.genes}
        conditions = {
            key: float(values.get(key, kept.get(key, each.nominal)))
            for key, each in QUANTITIES.items()
        }
        genes = tuple(pair for pair in kept.items() if pair[0] not in QUANTITIES)
        # In one order and without nominal ones, so that equal scenarios are equal values.
        genes += tuple(
            (key, value) for key, value in conditions.items() if value != QUANTITIES[key].nominal
        )
        return dataclasses.replace(self, genes=genes)

    def without(self, *names: str) -> Scenario:
        """Return a copy without these objects."""
        for name in names:
            self[f"{name}.velocity"]
        genes = tuple(pair for pair in self.genes if pair[0].partition(".")[0] not in names)
        return dataclasses.replace(
            self, genes=genes, removed_objects=tuple(sorted({*self.removed_objects, *names}))
        )
