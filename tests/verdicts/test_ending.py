"""The condition that ends a signature, and the ending without it."""

from __future__ import annotations

import dataclasses

import pytest

from pytest_garl.scenarios.groups import GROUPS
from pytest_garl.verdicts.ending import CAUSES, ending_of, with_cause
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
from tests.verdicts.flights import flight


@pytest.mark.parametrize(
    ("ending", "conditions", "signature"),
    [
        ("II:lost:descent", ("fog",), "II:lost:descent:fog"),
        ("off:seen", ("jump",), "off:seen:jump"),
        ("II:lost:descent", (), "II:lost:descent"),
        ("II:lost:descent", ("fog", "wind"), "II:lost:descent"),
        ("III:tree:descent", ("fog",), "III:tree:descent"),
        ("IV:dog:descent:seen", ("fog",), "IV:dog:descent:seen"),
        ("I:decoy-same-id:seen", ("decoy-1",), "I:decoy-same-id:seen"),
        ("II:gave-up-in-sight:search", ("decoy-3",), "II:gave-up-in-sight:search:decoy"),
        ("V:ValueError@step", ("fog",), "V:ValueError@step"),
        ("slid:motors-on", ("jump",), "slid:motors-on"),
        ("late:standing", ("wind",), "late:standing"),
        ("", ("fog",), ""),
    ],
)
def test_the_only_condition_ends_a_signature_that_names_no_cause(
    ending: str, conditions: tuple[str, ...], signature: str
) -> None:
    assert with_cause(ending, conditions, ()) == signature
    assert ending_of(signature) == ending


def test_condition_beside_an_object_is_not_the_only_cause() -> None:
    assert with_cause("II:lost:descent", ("fog",), ("person-1",)) == "II:lost:descent"


def test_causes_are_the_weather_and_all_groups() -> None:
    groups = {each.partition("-")[0] for each in GROUPS}
    assert {"fog", "snow", "light", "heading", *groups} <= CAUSES


def test_verdict_has_the_signature_with_the_cause_and_the_ending_without_it() -> None:
    foggy = dataclasses.replace(flight("landed", (3.0, 0.0, 0.2)), conditions=("fog",))
    verdict = judge(foggy, Limits())
    assert (verdict.signature, verdict.ending) == ("I:nothing:unseen:fog", "I:nothing:unseen")
    several = dataclasses.replace(foggy, conditions=("fog", "wind"))
    assert judge(several, Limits()).signature == "I:nothing:unseen"
