"""Verdicts as plain JSON values and back."""

from __future__ import annotations

import dataclasses
from typing import Any

from pytest_garl.verdicts.verdict import Margin, Verdict


def to_dict(verdict: Verdict) -> dict[str, Any]:
    """Return a dict of plain values."""
    return dataclasses.asdict(verdict)


def from_dict(values: dict[str, Any]) -> Verdict:
    """Return the verdict that :func:`to_dict` was given."""
    margins = tuple(Margin(**item) for item in values["margins"])
    return Verdict(**{**values, "margins": margins})
