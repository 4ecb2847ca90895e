"""From ENU and FLU to NED and FRD, and back: each function is its own inverse.

ENU is x east, y north, z up, with the body's x forward, y left, z up (FLU).  NED is x north, y
east, z down, with the body's x forward, y right, z down (FRD).  Values that are no numbers pass
unchanged: the next reader says what is wrong with them.
"""

from __future__ import annotations

import math
from typing import Any

_HALF = math.sqrt(0.5)


def turned_vector(value: Any) -> Any:
    """Return a place or velocity (2,) or (3,) in the other frame."""
    if not _are_numbers(value) or len(value) not in (2, 3):
        return value
    x, y, *z = value
    return (y, x, *(-each for each in z))


def turned_attitude(value: Any) -> Any:
    """Return a quaternion (x, y, z, w) from body to world in the other frames."""
    if not _are_numbers(value) or len(value) != 4:
        return value
    x, y, z, w = value
    return (_HALF * (x + y), _HALF * (x - y), _HALF * (w - z), _HALF * (w + z))


def turned_yaw(value: Any) -> Any:
    """Return a heading in the other frame: from east to the left, or from north to the right."""
    return math.pi / 2 - value if _is_number(value) else value


def _are_numbers(value: Any) -> bool:
    return isinstance(value, list | tuple) and all(_is_number(each) for each in value)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
