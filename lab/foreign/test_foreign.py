"""Search for failures of the foreign systems; pytest collects this file only if it is named.

GARL_FOREIGN=FOLDER pytest lab/foreign/test_foreign.py -k blueos --garl-budget=60
"""

from __future__ import annotations

import pytest

from lab.foreign.catalogue import SYSTEMS
from pytest_garl import CompanionProgram, Landing


class _Landings:
    """What is expected of each landing."""

    def test_lands_on_the_marker(self, landing: Landing) -> None:
        """No farther from its centre than the limit."""
        assert landing.distance_to_landing_m <= landing.limits.distance_m

    def test_lands_in_time(self, landing: Landing) -> None:
        """Within two minutes."""
        assert landing.time_to_landing_s <= landing.limits.time_s

    def test_collides_with_nothing(self, landing: Landing) -> None:
        """No body but the ground, and that gently."""
        assert not landing.collisions

    def test_completes_the_mission(self, landing: Landing) -> None:
        """It may give up only where nobody could land."""
        assert landing.completed or landing.excused


def _marks(name: str) -> tuple[bool, pytest.MarkDecorator]:
    """Return whether the system's code is there, and how it is flown."""
    foreign = next(each for each in SYSTEMS if each.name == name)
    task, is_exact = foreign.task, isinstance(foreign.system, CompanionProgram)
    return not foreign.problem, pytest.mark.garl(
        system=foreign.system,
        maps=["court", "lawn"],
        marker=task.marker,
        start=task.start,
        deterministic=is_exact,
    )


class TestHowDoDronesWork(_Landings):
    """The precise landing of "How do drones work?"."""

    __test__, pytestmark = _marks("how-do-drones-work")


class TestBlueOs(_Landings):
    """The BlueOS extension "Precision Landing"."""

    __test__, pytestmark = _marks("blueos")


class TestCuavLanding(_Landings):
    """The precision landing for CUAV."""

    __test__, pytestmark = _marks("cuav-landing")


class TestKhairulSingle(_Landings):
    """The precision landing of Md Khairul Islam, with one marker."""

    __test__, pytestmark = _marks("khairul-single")


class TestPandyaCamera2(_Landings):
    """The landing target messages of "Pandya16"."""

    __test__, pytestmark = _marks("pandya-camera2")


class TestKyujinPrecisionLand(_Landings):
    """The two nodes of ROS 2 of "kyujin1"."""

    __test__, pytestmark = _marks("kyujin-precision-land")
