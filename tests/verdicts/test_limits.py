"""Limits hold plain numbers: what a user's class of numbers says of itself decides nothing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from pytest_garl.errors import OptionError
from pytest_garl.verdicts.verdict import Limits


class Boastful(float):
    """Says that it lies between any two numbers."""

    def __ge__(self, other: Any) -> bool:
        return True

    def __le__(self, other: Any) -> bool:
        return True


@pytest.mark.parametrize("value", [Boastful(math.inf), Boastful(math.nan), True, "1", None])
def test_a_limit_is_a_number_in_its_range(value: Any) -> None:
    with pytest.raises(OptionError, match="found distance_m="):
        Limits(distance_m=value)


@pytest.mark.parametrize("value", [Boastful(0.5), np.float64(0.5)], ids=["boastful", "numpy"])
def test_a_limit_is_kept_as_a_plain_number(value: Any) -> None:
    limits = Limits(distance_m=value)
    assert type(limits.distance_m) is float
    assert limits == Limits(distance_m=0.5)


def test_a_whole_number_stays_one() -> None:
    # The keys of searches are made of it.
    assert repr(Limits(time_s=60).time_s) == "60"
