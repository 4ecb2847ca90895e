"""The same verdict on every class of CPU: here the newer instructions are switched off."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from pytest_garl.simulation.record import _instructions

OLD = {
    "OPENCV_CPU_DISABLE": "AVX512-SKX,AVX2,FMA3,AVX",
    "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL "
    "AVX2 FMA3",
    "OPENBLAS_CORETYPE": "Nehalem",
}
FLY = """
import json
import cv2
cv2.setNumThreads(1)
from landing_systems.opencv_mls import OpenCvLandingSystem
from pytest_garl.adversary.policies import policy_spec
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.maps import load_map
from pytest_garl.search.random_search import propose
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
from pytest_garl.verdicts.verdict import Limits
map = load_map("lawn")
for scenario in propose(map, genome_for(map), 5, 0, 6)[4:]:
    flight = fly(scenario, OpenCvLandingSystem, policy_spec("waypoint"), map=map)
    verdict = judge(flight, Limits())
    print(json.dumps([verdict.outcome, verdict.signature, flight.sha256]))
"""


def flown(environment: dict[str, str]) -> list[list[str]]:
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FLY],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.sim
def test_the_verdict_does_not_depend_on_the_instructions() -> None:
    new, old = flown({}), flown(OLD)
    assert [each[:2] for each in new] == [each[:2] for each in old]
    assert {each[0] for each in new} == {"aborted", "collision"}


@pytest.mark.parametrize(
    ("features", "name"),
    [
        ("SSE SSE2 SSE3 *SSE4.1 *SSE4.2 *AVX *FP16 *AVX2 *AVX512-SKX", "avx512"),
        ("SSE SSE2 SSE3 *SSE4.1 *SSE4.2 *AVX *FP16 *AVX2 *AVX512-SKX?", "avx2"),
        ("SSE SSE2 SSE3 *SSE4.1 *SSE4.2 *AVX? *FP16? *AVX2? *AVX512-SKX?", "base"),
    ],
)
def test_instructions_that_the_cpu_lacks_make_no_class(features: str, name: str) -> None:
    assert _instructions(features) == name
