"""A quantity: a named value with its unit, limits, meaning and source; and groups of them.

All that may vary in a scenario is a quantity: the strength of the wind, the visibility in fog, the
delay of a dog's story, the place of the marker.  Genes, domains, files, units and stories read
these values and copy none of them; a genome and a domain narrow their limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from pytest_garl.errors import ScenarioError

UNITS = {
    "_per_m3": "per cubic metre",
    "_mps": "m/s",
    "_mmph": "mm/h",
    "_degps": "degrees/s",
    "_deg": "degrees",
    "_percent": "%",
    "_ms": "ms",
    "_hz": "Hz",
    "_mm": "mm",
    "_m": "m",
    "_s": "s",
}
"""Units by the ending of a name, for a reader."""
_NEAR_ZERO = 1e-9
"""In every unit of a file a value that small has no effect."""
SIGNIFICANT_DIGITS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """One value: its key in scenarios and files, ``wind.mean_mps``, ends with its unit.

    A scenario that does not name it has its ``nominal`` value, which has no effect.  ``low`` and
    ``high`` are the limits of what the simulator can fly, or within them those of a genome.
    ``source`` says where the range of the domain `field` comes from.  A value of a ``whole`` one
    is rounded.  ``choices`` name the whole values from 0 on; such a value is rounded up: only 0
    is the first, unless it is ``whole`` as well.  Files and reports state the name.  An
    ``even`` one has no harsher end, as a direction or a time, and is drawn evenly; of any other
    one half of the draws of a sparse genome lie in the third that is farthest from nominal.
    One that ``acts_alone`` may matter without the other values of its group, as how a pad lies
    turned.  ``scale`` is "inverse" for a visibility, whose effect grows with 1 / value: it is
    strongest at ``low``, and infinite without effect.  Raises ScenarioError unless
    ``low <= nominal <= high`` and ``low < high``.
    """

    key: str
    low: float
    high: float
    nominal: float = 0.0
    meaning: str
    source: str = ""
    whole: bool = False
    choices: tuple[str, ...] = ()
    even: bool = False
    acts_alone: bool = False
    scale: Literal["linear", "inverse"] = "linear"

    def __post_init__(self) -> None:
        if not self.low <= self.nominal <= self.high or self.low == self.high:
            raise ScenarioError(
                f"quantity {self.key!r}: expected low <= nominal <= high and low < high, "
                f"found {self.low}, {self.nominal}, {self.high}"
            )

    @property
    def name(self) -> str:
        """The key without the group before it."""
        return self.key.partition(".")[2]

    @property
    def unit(self) -> str:
        """The unit that the key ends with, for a reader; empty without one."""
        return unit_of(self.key)

    @property
    def is_switch(self) -> bool:
        """Whether it is on or off: ``told.surveyed``."""
        return self.whole and (self.low, self.high) == (0, 1)

    @property
    def has_harsher_end(self) -> bool:
        """Whether more of it is harsher, as of no kind, direction, time or switch."""
        return not (self.choices or self.even or self.is_switch)

    def at(self, share: float) -> float:
        """Return the value at a share (0 to 1) of its strongest effect, rounded."""
        if self.scale == "inverse":
            return significant(self.low / share) if share > 0 else math.inf
        return significant(share * self.high)

    def share_of(self, value: float) -> float:
        """Return the share (0 to 1) of its strongest effect that a value has."""
        return self.low / value if self.scale == "inverse" else value / self.high

    def flown(self, value: float) -> float:
        """Return what is flown for a value: a whole one is rounded, a choice rounded up.

        A number beyond the last choice stands for that, so that a genome can draw it more often.
        """
        if not self.whole and not self.choices:
            return value
        number = float(round(value) if self.whole else math.ceil(value))
        return min(number, len(self.choices) - 1.0) if self.choices else number

    def text_of(self, value: float) -> str:
        """Return a value for a reader: the name of a choice, or the number."""
        return self.choices[int(self.flown(value))] if self.choices else f"{value:g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Quantities that one cause switches on together: wind has a speed, a direction, gusts.

    ``feeds`` is the field of an observation if the group changes nothing but that: a landing system
    that never reads it flies the same flight without the group.  It is empty for all others.
    """

    name: str
    meaning: str
    quantities: tuple[Quantity, ...]
    feeds: str = ""

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys in scenarios and files, such as ``wind.mean_mps``, in order."""
        return tuple(each.key for each in self.quantities)

    @property
    def nominal(self) -> dict[str, float]:
        """The nominal value of each key."""
        return {each.key: each.nominal for each in self.quantities}


def unit_of(name: str) -> str:
    """Return the unit that a name ends with, for a reader; empty without one."""
    return next((unit for ending, unit in UNITS.items() if name.endswith(ending)), "")


def significant(value: float, digits: int = SIGNIFICANT_DIGITS) -> float:
    """Return a value rounded to a number of significant digits; one near 0 becomes 0."""
    return float(f"{value:.{digits}g}") if abs(value) > _NEAR_ZERO else 0.0
