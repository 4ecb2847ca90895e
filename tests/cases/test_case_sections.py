from __future__ import annotations

from dataclasses import MISSING, fields

import pytest

from pytest_garl.cases.case import CaseEvidence, Prevention, Violation, Worst
from pytest_garl.cases.case_sections import (
    EVIDENCE,
    LIMITS,
    PREVENTABLE,
    SEVERITY,
    VIOLATION,
    WORST,
    Section,
)
from pytest_garl.execution.severity import Severity
from pytest_garl.verdicts.verdict import Limits


@pytest.mark.parametrize(
    ("dataclass", "section"),
    [
        (Violation, VIOLATION),
        (Worst, WORST),
        (Prevention, PREVENTABLE),
        (Limits, LIMITS),
        (CaseEvidence, EVIDENCE),
        (Severity, [key for section in SEVERITY.values() for key in section]),
    ],
)
def test_a_section_has_a_row_for_each_field_of_its_dataclass(
    dataclass: type, section: Section
) -> None:
    """A field without a row would be lost in the file."""
    names = {each.name for each in fields(dataclass)} - {"about"}
    assert {key.field or key.name for key in section} == names


@pytest.mark.parametrize(
    ("dataclass", "section"),
    [
        (Prevention, PREVENTABLE),
        (CaseEvidence, EVIDENCE),
        *((Severity, section) for section in SEVERITY.values()),
    ],
)
def test_the_field_of_an_optional_key_has_a_default(dataclass: type, section: Section) -> None:
    defaults = {each.name: each.default for each in fields(dataclass)}
    assert all(defaults[key.name] is not MISSING for key in section if key.optional)
