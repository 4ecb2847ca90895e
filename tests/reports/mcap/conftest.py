from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from pytest_garl.flight.flight import Flight
from pytest_garl.reports.film.drawing import Image
from pytest_garl.scenarios.placed import Placed
from tests.support.mcap_files import Recording, needs_extra, read_mcap
from tests.support.videos import LAWN, SCENARIO, Hovers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Exported:
    """A flight, what its landing system saw, and its file as it was read."""

    flight: Flight
    seen: list[Image]
    path: Path
    recording: Recording


@pytest.fixture(scope="package")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """Return a flight of three seconds over the lawn, exported."""
    needs_extra()
    from pytest_garl.npcs.policy_catalogue import policy_spec
    from pytest_garl.reports.mcap.export import Export, Place
    from pytest_garl.reports.mcap.writer import write_mcap
    from pytest_garl.simulation.fly import fly

    flight = fly(SCENARIO, Hovers, policy_spec("waypoint"), time_limit_s=3.0)
    seen = list(Hovers.seen)
    path = tmp_path_factory.mktemp("exported") / "flight.mcap"
    place = Place(placed=Placed(SCENARIO, LAWN), camera=Hovers.airframe.camera)
    write_mcap(Export(name="lawn-g00-s00", flight=flight, place=place), path)
    return Exported(flight=flight, seen=seen, path=path, recording=read_mcap(path))
