"""The same bytes whatever the environment says about the CPU, and other bytes without the pin."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pytest_garl import cpu_dispatch
from pytest_garl.cases.case import Case
from pytest_garl.cases.case_file import dump_case
from pytest_garl.cases.corpus import Corpus
from pytest_garl.execution.job import FlightJob
from pytest_garl.execution.local_pool import temporary_pool
from pytest_garl.execution.on_demand import fly_all
from pytest_garl.execution.reference import Reference
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.scenarios.maps.loading import load_map

Found = tuple[Path, Case]
ROOT = Path(__file__).parents[2]
WITHOUT_AVX512 = {
    "OPENCV_CPU_DISABLE": "AVX512-SKX",
    "OPENCV_IPP": "avx2",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}
WITHOUT_AVX2 = {
    "OPENBLAS_CORETYPE": "Nehalem",
    "OPENCV_CPU_DISABLE": "AVX512-SKX,AVX2,FP16,AVX",
    "OPENCV_IPP": "sse42",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
}
SETTINGS: dict[str, dict[str, str]] = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "Zen": {"OPENBLAS_CORETYPE": "Zen"},
    "Nehalem": {"OPENBLAS_CORETYPE": "Nehalem"},
    "without AVX-512": WITHOUT_AVX512,
    "without AVX2": WITHOUT_AVX2,
}
FLY = """
import json, sys
import numpy as np
from pathlib import Path
from pytest_garl import cpu_dispatch
from pytest_garl.npcs.recorded import recorded_spec
from pytest_garl.cases.case_file import load_case
from pytest_garl.execution.reference import system_named
from pytest_garl.simulation.fly import fly
from pytest_garl.verdicts.judge import judge
rng = np.random.default_rng(0)
product = rng.random((31, 57)) @ rng.random((57, 23))
refused = ""
try:
    cpu_dispatch.check()
except Exception as error:
    refused = str(error)
cases = [load_case(Path(file), ()) for file in sys.argv[1:]]
flown = [
    fly(case.scenario, system_named(case.system), recorded_spec(dict(case.moves), {}))
    for case in cases
]
judged = [judge(flight, case.limits) for flight, case in zip(flown, cases)]
print(json.dumps({
    "refused": refused,
    "product": product.tobytes().hex(),
    "verdicts": [each.signature for each in judged],
    "hashes": [each.sha256 for each in flown],
    "cpus": [each.cpu for each in flown],
}))
"""
GARL = "from pytest_garl.cli import main; main()"
needs_avx2 = pytest.mark.skipif(not cpu_dispatch.has_baseline(), reason="this CPU has no AVX2")


def case_of_each(wanted: Callable[[Case], bool], best: Callable[..., Any]) -> list[Found]:
    """Return a saved case of each landing system: of those wanted the shortest, or the longest."""
    found: dict[str, list[Found]] = {}
    for entry in Corpus(ROOT / "scenarios" / "regressions").all_entries():
        case = entry.case
        if case is not None and not case.changes and wanted(case):
            found.setdefault(case.system, []).append((entry.path, case))
    return [best(found[system], key=lambda each: length(each[1])) for system in sorted(found)]


def length(case: Case) -> int:
    """Count the decisions of its objects, one for every half second."""
    return max((len(moves) for _, moves in case.moves), default=0)


SHORT = case_of_each(lambda case: length(case) >= 25, min)
"""Long enough that the landing system detects, plans and comes down."""
ROBUST = case_of_each(lambda case: not case.edge, max)


OPENCV = [each for each in SHORT if "opencv" in each[1].system]
"""The landing system whose flights take a second."""
ENDS = ("Haswell", "without AVX2")
"""The setting of the class itself, and that which differs most from it."""


def flown_by_a_child(cases: Sequence[Found]) -> list[tuple[str, str]]:
    """Return verdict and hash of each case, flown as a search flies."""
    flown = []
    with temporary_pool(1) as (ledger, pool):
        for _, case in cases:
            map = load_map(case.scenario.map)
            module, _, qualname = case.system.partition(":")
            job = FlightJob.for_system(
                Reference(module=module, file="", qualname=qualname),
                map,
                recorded_spec(dict(case.moves), {}),
                limits=case.limits,
                timeout_s=60.0,
                path=(str(ROOT),),
                flights=ledger.path.parent / "flights",
            )
            done = next(iter(fly_all(ledger, pool, job, [case.scenario])))
            flown.append((done.signature, done.sha256))
    return flown


def flown_unpinned(setting: dict[str, str], cases: Sequence[Found]) -> dict[str, Any]:
    """Fly in a process that chooses its instructions by itself, as this setting lets it."""
    pinned = cpu_dispatch.environment()
    outside = {name: value for name, value in os.environ.items() if name not in pinned}
    # That NumPy does not know a group, or the CPU does not have it, is only a warning.
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FLY, *(str(path) for path, _ in cases)],
        env={**outside, **cpu_dispatch.THREADS, **setting},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_there_is_a_case_of_each_landing_system() -> None:
    assert len(SHORT) == len(ROBUST) == 3


@needs_avx2
@pytest.mark.sim
@pytest.mark.parametrize(
    ("cases", "settings"),
    [
        # MM-MLS detects with a network and plans with BLAS; that bytes of the others depend on
        # the CPU is shown below.
        *(
            pytest.param(
                [each],
                ENDS,
                id=each[1].system,
                marks=[] if "mm_mls" in each[1].system else [pytest.mark.long],
            )
            for each in SHORT
        ),
        pytest.param(SHORT, tuple(SETTINGS), id="all", marks=pytest.mark.long),
    ],
)
def test_one_hash_under_every_setting(
    monkeypatch: pytest.MonkeyPatch, cases: Sequence[Found], settings: Sequence[str]
) -> None:
    flown = {}
    for name in settings:
        with monkeypatch.context() as outside:
            for key, value in SETTINGS[name].items():
                outside.setenv(key, value)
            flown[name] = flown_by_a_child(cases)
    assert flown == dict.fromkeys(settings, flown["Haswell"])


@needs_avx2
@pytest.mark.sim
def test_the_command_flies_as_children_do(tmp_path: Path) -> None:
    path, case = OPENCV[0]
    # The flight of the file may be one of an earlier simulator.
    ((signature, sha256),) = flown_by_a_child(OPENCV)
    evidence = replace(case.evidence, trajectory_sha256=sha256, cpu=cpu_dispatch.BASELINE)
    path = tmp_path / path.name
    path.write_text(dump_case(replace(case, evidence=evidence)))
    found = subprocess.run(
        [sys.executable, "-c", GARL, "cases", "replay", str(path)],
        env={**os.environ, **WITHOUT_AVX2},
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert "the same flight to the byte" in found.stdout, found.stderr
    assert signature in found.stdout


@needs_avx2
@pytest.mark.sim
@pytest.mark.parametrize(
    "cases",
    [
        pytest.param(ROBUST[1:2], id="opencv"),
        pytest.param(ROBUST, id="all systems", marks=pytest.mark.long),
    ],
)
def test_without_the_pin_bytes_differ_and_are_refused(cases: Sequence[Found]) -> None:
    avx2 = flown_unpinned(cpu_dispatch.environment(), cases)
    old = flown_unpinned(WITHOUT_AVX2, cases)
    assert not avx2["refused"]
    assert "expected x86_64-avx2-haswell" in old["refused"]
    assert avx2["cpus"] == [cpu_dispatch.BASELINE] * len(cases)
    assert cpu_dispatch.BASELINE not in old["cpus"]
    assert avx2["product"] != old["product"]
    assert avx2["hashes"] != old["hashes"]
    # Where there is no AVX2 not the bytes are promised but the verdict, of robust cases.
    assert avx2["verdicts"] == old["verdicts"]
