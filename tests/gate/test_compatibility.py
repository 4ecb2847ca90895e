from __future__ import annotations

import dataclasses

from pytest_garl.cpu_dispatch import cpu_class_of_flights
from pytest_garl.execution.reference import Reference
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.gate.baseline_file import (
    Baseline,
)
from pytest_garl.gate.compatibility import environment_changes, incompatibilities
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.task import Start, Task
from pytest_garl.verdicts.verdict import Limits
from tests.gate.samples import baseline, baseline_set, job


def test_incompatibilities_name_conditions_but_not_the_landing_system() -> None:
    each = baseline_set()
    assert incompatibilities(each, job(), Task()) == ()
    assert incompatibilities(each, dataclasses.replace(job(), system_sha256="new"), Task()) == ()
    strict = dataclasses.replace(job(), limits=Limits(time_s=60.0))
    assert incompatibilities(each, strict, Task()) == (
        'limits: saved with distance 0.75 m, time 120 s, abort="needless", '
        'found distance 0.75 m, time 60 s, abort="needless"',
    )
    other = job(Reference(module="sitl", file="/a/sitl.py", qualname="fly"))
    assert incompatibilities(each, other, Task()) == (
        "simulator: saved with pytest_garl.simulation.fly:fly, found sitl:fly",
    )
    assert incompatibilities(dataclasses.replace(each, map_sha256="0" * 64), job(), Task())[
        0
    ].startswith("map lawn: ")
    learned = dataclasses.replace(job(), npcs=policy_spec("dqn"))
    trained = dataclasses.replace(each, npcs="dqn", npcs_sha256="0" * 64)
    assert incompatibilities(trained, learned, Task())[0].startswith(
        "weights of dqn: saved with 000"
    )


def test_environment_changes_name_cpu_and_versions() -> None:
    assert "numpy was 2.0.0, is " in " ".join(environment_changes(baseline()))
    gone = Baseline(cpu="z80", versions=(("no-such-package", "1"),), sets=())
    assert environment_changes(gone) == (
        f"the CPU was z80, is {cpu_class_of_flights()}",
        "no-such-package was 1, is absent",
    )


def test_another_marker_or_start_is_no_fair_comparison() -> None:
    found = incompatibilities(
        baseline_set(), job(), Task(marker=MarkerSpec(id=3), start=Start(mode="hover"))
    )
    assert found[0] == (
        "marker: saved with DICT_5X5_50 id 0 of 1.5 m, found DICT_5X5_50 id 3 of 1.5 m"
    )
    assert found[1].startswith("start: saved with Start(mode='ground'")
