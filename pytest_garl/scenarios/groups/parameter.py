"""One condition in physical units, and the group of those that act together."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pytest_garl.errors import ScenarioError


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One condition: its name ends with its unit, as in ``mean_mps``.

    A scenario that does not name it has its ``nominal`` value, which has no effect.  ``low`` and
    ``high`` are the limits of what the simulator can fly, not what a domain claims.  ``source``
    says where the range of the domain `field` comes from.  A value of a ``whole`` one is rounded.
    ``choices`` name the whole values from 0 on; such a value is rounded up: only 0 is the first.
    Files and reports state the name.
    An ``even`` one has no harsher end, as a direction or a time.
    """

    name: str
    nominal: float
    low: float
    high: float
    meaning: str
    source: str
    whole: bool = False
    choices: tuple[str, ...] = ()
    even: bool = False

    def __post_init__(self) -> None:
        if not self.low <= self.nominal <= self.high or self.low == self.high:
            raise ScenarioError(
                f"parameter {self.name!r}: expected low <= nominal <= high and low < high, "
                f"found {self.low}, {self.nominal}, {self.high}"
            )

    def text_of(self, value: float) -> str:
        """Return a value for a reader: the name of a choice, or the number."""
        return self.choices[math.ceil(value)] if self.choices else f"{value:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Parameters that one cause switches on together: wind has a speed, a direction, gusts.

    ``feeds`` is the field of an observation if the group changes nothing but that: a landing system
    that never reads it flies the same flight without the group.  It is empty for all others.
    """

    name: str
    meaning: str
    parameters: tuple[Parameter, ...]
    feeds: str = ""

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys in scenarios and files, such as ``wind.mean_mps``, in order."""
        return tuple(f"{self.name}.{each.name}" for each in self.parameters)

    @property
    def nominal(self) -> dict[str, float]:
        """The nominal value of each key."""
        return {key: each.nominal for key, each in zip(self.keys, self.parameters, strict=True)}
