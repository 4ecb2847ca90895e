"""The saved cases fly to the byte and are judged alike, in every Python that is supported."""

from __future__ import annotations

from pathlib import Path

import pytest

from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.replay import system_of
from pytest_garl.cpu_dispatch import dispatched
from pytest_garl.execution.fly_and_judge import time_limit_s
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge

ROOT = Path(__file__).parents[2]
FILES = [
    (folder, file)
    for folder in (ROOT, ROOT / "docs" / "tutorial")
    for file in sorted(folder.glob("scenarios/regressions/*/*.toml"))
]


@pytest.mark.long
@pytest.mark.sim
@pytest.mark.parametrize(
    ("folder", "file"), FILES, ids=[f"{file.parent.name}-{file.stem}" for _, file in FILES]
)
def test_a_saved_case_is_flown_to_the_byte(
    folder: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(folder))
    case = load_case(file)
    if case.evidence.cpu != dispatched():
        pytest.skip(f"its hash is that of {case.evidence.cpu}, and this CPU is {dispatched()}")
    flight = fly(
        case.scenario,
        system_of(case, folder),
        case.behaviour.policy,
        map=load_map(case.scenario.map),
        time_limit_s=time_limit_s(case.limits),
    )
    verdict = judge(flight, case.limits)
    assert flight.sha256 == case.evidence.trajectory_sha256
    assert verdict.violation
    # A case's signature names its cause, too.
    assert case.violation.signature.startswith(verdict.signature)
