"""Programs that a test writes into a folder, and flights of them."""

from __future__ import annotations

import dataclasses
import shutil
import sys
from pathlib import Path
from typing import Any

from pytest_garl.external.external_program import ExternalProgram
from pytest_garl.flight.flight import Flight
from pytest_garl.landing_system import Airframe
from pytest_garl.simulation.fly import fly
from tests.support.flights import EMPTY, STAND, nominal

CLIENTS = Path(sys.modules[ExternalProgram.__module__].__file__ or "").parent / "clients"
RISES = """
import garl_client

link = garl_client.Link(reads=[])
x, y, _ = link.mission["home_m"]
for seen in link:
    if seen.frame == 5:
        {misbehaves}
    link.position([x, y, 2.0], diagnostics={{"phase": "rises", "target_m": [x, y, 0.0]}})
"""
"""It knows where it is without a camera, and does one thing in the sixth frame."""


def written(folder: Path, text: str, **options: Any) -> ExternalProgram:
    """Return a program of Python that has the client beside it."""
    shutil.copy(CLIENTS / "garl_client.py", folder)
    (folder / "lander.py").write_text(text)
    command = [sys.executable, "-S", "lander.py"]
    return ExternalProgram(command, folder=folder, name="lander", **options)


def flown(program: ExternalProgram, seconds: float = 1.0) -> Flight:
    return fly(nominal(), program, STAND, map=EMPTY, time_limit_s=seconds)


def at_once(**changes: Any) -> Airframe:
    return dataclasses.replace(Airframe(latency_s=0.0), **changes)
