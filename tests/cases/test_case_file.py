from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_garl.cases.case import (
    Escape,
    NoGateReason,
    Preventable,
    Prevention,
)
from pytest_garl.cases.case_file import dump_case, load_case, parse_case
from pytest_garl.errors import ScenarioError
from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.messages import printable
from pytest_garl.scenarios.chromosome import decode
from pytest_garl.scenarios.genes import genome_for
from pytest_garl.scenarios.genome_like import with_destinations
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.units import snapped
from pytest_garl.scenarios.validity import repair
from tests.cases.samples import LAWN, OBJECT_NAMES, case, case_with_changes

ROOT = Path(__file__).parents[2]


def test_file_keeps_a_case_and_its_bytes() -> None:
    text = dump_case(case())
    assert parse_case(text, load_map) == case()
    assert dump_case(parse_case(text, load_map)) == text


COMMITTED = [
    path
    for folder in ("scenarios/regressions", "docs/tutorial/scenarios/regressions")
    for path in sorted((ROOT / folder).glob("*/*.toml"))
]


@pytest.mark.parametrize("path", COMMITTED, ids=lambda path: path.stem)
def test_committed_case_is_read_and_keeps_its_name(path: Path) -> None:
    committed = load_case(path)
    assert committed.id == path.stem
    assert dump_case(committed) == path.read_text(encoding="utf-8")


@pytest.mark.parametrize("answer", ["preventable", "sensor-limited", "unpreventable"])
@pytest.mark.parametrize("observed_s", [None, 2.4])
def test_file_keeps_what_was_preventable(answer: Preventable, observed_s: float | None) -> None:
    reason = cast(NoGateReason, "" if answer == "preventable" else answer)
    escape: Escape = "motors off" if answer == "preventable" and observed_s is None else "flight"
    found = Prevention(answer=answer, inevitable_s=0.5, observed_s=observed_s, escape=escape)
    judged = dataclasses.replace(case(), prevention=found, reason=reason)
    text = dump_case(judged)
    assert parse_case(text, load_map) == judged
    assert ("gates = false" in text) is bool(reason)
    assert ('escape = "motors off"' in text) is (escape == "motors off")


@given(st.text())
def test_file_keeps_any_description(description: str) -> None:
    strange = case(description=description)
    assert parse_case(dump_case(strange), load_map) == case(description=printable(description))


def test_file_keeps_destinations() -> None:
    genome = with_destinations(genome_for(LAWN))
    row = genome.random(np.random.default_rng(1))
    scenario = repair(decode(row, genome, map="lawn", seed=9), LAWN).without(*OBJECT_NAMES[:-1])
    bound = dataclasses.replace(case(), scenario=scenario, policy="destination")
    assert parse_case(dump_case(bound), load_map) == bound


def test_file_keeps_changes_of_the_environment() -> None:
    text = dump_case(case_with_changes())
    assert (
        f'{OBJECT_NAMES[-1]} = [[0, "environment.fog", 0.01], [2, "environment.sun_position"'
        in text
    )
    assert parse_case(text, load_map) == case_with_changes()
    assert dump_case(parse_case(text, load_map)) == text
    assert case_with_changes().id != case().id
    assert "[changes]" not in dump_case(case())


def test_file_names_the_kind_of_a_decoy_and_its_number_is_read() -> None:
    plain = case()
    conditions = {"decoy-1.kind": 3.0, "decoy-1.x_m": 4.0}
    scenario = snapped(plain.scenario.replace(conditions), LAWN)
    with_decoy = dataclasses.replace(plain, scenario=scenario)
    text = dump_case(with_decoy)
    assert '[scenario.decoy-1]\nkind = "helipad-h"\n' in text
    assert parse_case(text, load_map) == with_decoy
    with_number = parse_case(text.replace('"helipad-h"', "3.0"), load_map)
    assert with_number == with_decoy
    assert with_number.id == with_decoy.id
    with pytest.raises(ScenarioError, match=r"x.toml: key 'scenario.decoy-1.kind': found 'mat'"):
        parse_case(text.replace("helipad-h", "mat"), load_map, source="x.toml")


def test_file_keeps_names_with_quotes_and_backslashes() -> None:
    strange = dataclasses.replace(case(), system="stack:Länder", test='te"st.py::test\\it')
    odd = dataclasses.replace(LAWN, name='la"wn\\')
    strange = dataclasses.replace(
        strange, scenario=dataclasses.replace(strange.scenario, map=odd.name)
    )
    assert parse_case(dump_case(strange, lambda _: odd), lambda _: odd) == strange


def test_file_keeps_the_test_and_the_hashes_of_the_sources() -> None:
    plain = case()
    assert (plain.evidence.system_sha256, plain.evidence.simulator_sha256) == ("ef" * 32, "12" * 32)
    with_node_id = dataclasses.replace(plain, test="tests/test_it.py::TestIt::test_a")
    assert parse_case(dump_case(with_node_id), load_map) == with_node_id
    assert with_node_id.id == plain.id
    assert with_node_id.asserting_test == ""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[[2, 0.0, 0.0]", "[[2.5, 0.0, 0.0]", "expected a list of \\[times, x, y\\]"),
        ("[[2, 0.0, 0.0]", "[[0, 0.0, 0.0]", "times of at least 1"),
        ("0.6, -0.8", "0.9, -0.8", "at most 1"),
        ("0.6, -0.8", "nan, -0.8", "at most 1"),
        ('status = "open"', 'status = "known"', "'status': found 'known'"),
        ('status = "open"', 'status = "unavoidable"', "'status': found 'unavoidable'"),
        ('status = "open"', 'status = "open"\navoidable = "live"', "'avoidable': unknown key"),
        ('status = "open"', 'status = "open"\nreason = "edge"', "beside 'gates = false'"),
        ('status = "open"', 'status = "open"\ngates = false', "'reason'"),
        ("schema = 2", "schema = 1", "'schema': found 1, expected 2"),
        (f'system_sha256 = "{"ef" * 32}"\n', "", "'evidence.system_sha256': missing"),
        (f'simulator_sha256 = "{"12" * 32}"\n', "", "'evidence.simulator_sha256': missing"),
        ("[policy]", "[polices]", "'polices': unknown key"),
        ("neighbours = 3", "neighbours = -3", "'evidence.neighbours'"),
        ("time_s = 120.0", "time_s = -1.0", "'limits.time_s'"),
        ('"stack.landing:Lander"', '"Lander"', "expected 'module:class'"),
    ],
)
def test_error_of_a_broken_file_names_source_and_key(old: str, new: str, words: str) -> None:
    text = dump_case(case())
    assert old in text
    with pytest.raises(ScenarioError, match=words) as caught:
        parse_case(text.replace(old, new), load_map, source="lawn-x.toml")
    assert "lawn-x.toml" in str(caught.value)


BODY = Severity(
    about="body",
    grade="careless",
    type="person",
    objects=2,
    interference_s=0.0,
    speed_mps=1.4,
    window_s=3.0,
)
CONDITIONS = Severity(
    about="conditions",
    conditions=("fog", "wind"),
    values=("visibility 11 m", "mean 3 m/s"),
    largest="visibility 11 m",
    largest_share=0.9,
)


def test_a_file_says_whether_its_severity_is_what_it_takes() -> None:
    severe = dataclasses.replace(case(), severity=CONDITIONS)
    assert "# The conditions that it takes" in dump_case(severe)
    raw = dataclasses.replace(
        severe, evidence=dataclasses.replace(severe.evidence, neighbours=0, neighbours_failed=0)
    )
    assert "# Unusual in the flight that was found; the case is not shrunk." in dump_case(raw)


@pytest.mark.parametrize(
    "severity",
    [
        BODY,
        dataclasses.replace(BODY, when="while the marker is covered"),
        dataclasses.replace(BODY, grade="", window_s=None, untried=("dog-1", "fog")),
        CONDITIONS,
        Severity(about="conditions"),
        dataclasses.replace(CONDITIONS, untried=("wind",), idle=("fog",)),
        NO_SEVERITY,
    ],
)
def test_file_keeps_what_the_violation_takes(severity: Severity) -> None:
    severe = dataclasses.replace(case(), severity=severity)
    text = dump_case(severe)
    assert parse_case(text, load_map) == severe
    assert ("[severity]" in text) == bool(severity.about)
    # The names of cases do not depend on it.
    assert severe.id == case().id


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('grade = "careless"', 'grade = "angry"', "'severity.grade': found 'angry'"),
        ("objects = 2", "objects = -1", "'severity.objects'"),
        ("speed_mps = 1.4", "speed_mps = -1.0", "'severity.speed_mps'"),
        ("window_s = 3.0", "window_s = 3000.0", "'severity.window_s'"),
        ('grade = "careless"', "largest_share = 0.5", "'severity.largest_share': unknown key"),
    ],
)
def test_wrong_severity_is_an_error_that_names_its_key(old: str, new: str, words: str) -> None:
    text = dump_case(dataclasses.replace(case(), severity=BODY))
    with pytest.raises(ScenarioError, match=words):
        parse_case(text.replace(old, new), load_map)


def test_each_condition_of_a_severity_has_its_values() -> None:
    text = dump_case(dataclasses.replace(case(), severity=CONDITIONS))
    values = 'values = ["visibility 11 m", "mean 3 m/s"]\n'
    assert values in text
    words = "'severity.values': found 0 texts, expected one text for each of 2 conditions"
    with pytest.raises(ScenarioError, match=words):
        parse_case(text.replace(values, ""), load_map)
