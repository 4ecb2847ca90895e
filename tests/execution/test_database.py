"""A ledger that an error left open closes itself, without a warning."""

from __future__ import annotations

import gc
from pathlib import Path

from pytest_garl.execution.ledger import Ledger


def test_ledger_that_nobody_closed_is_closed_without_a_warning(tmp_path: Path) -> None:
    """Python 3.13 would warn, and a warning is an error here."""
    ledger = Ledger.create(tmp_path / "ledger.sqlite", {})
    circle: list[object] = [ledger.database]
    circle.append(circle)
    del ledger, circle
    gc.collect()
