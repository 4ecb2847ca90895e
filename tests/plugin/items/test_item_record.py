from __future__ import annotations

import dataclasses
import json
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import execnet.gateway_base
import pytest

import pytest_garl.plugin
from pytest_garl.plugin.items.item_record import ItemRecord
from tests.support.case_project import run
from tests.support.landing_project import project

FULL = ItemRecord(
    slot="court-g00-s01",
    no_flight="nothing to fly",
    flight="0123 court-g00-s01",
    outcome="collision",
    signature="IV:dog:cruise",
    story="hit a dog",
    excuse="nobody could",
    final_distance_m=1.25,
    elapsed_s=14.2,
    trajectory_sha256="abcd",
    expected=True,
    outside="case.toml is outside",
    unproven="the simulator has changed",
    renewable="case.toml",
    page="pages/kinds/dog.html",
    system="lander:Lander",
    map="court",
    search="0123",
    failure_signature="own:test_it:a",
    user_message="assert 1 == 2",
    shows_violation=True,
    left_to_another=True,
    reported_failure="0123 IV:dog:cruise",
    duplicate_of="0123 IV:dog:cruise",
    excused_by="known.toml",
    not_repeated=True,
    savable=True,
    failing_case="case.toml",
    severity="a careless dog",
    maybe_fixed="case.toml",
    stale="case.toml passes",
    passes_elsewhere="case.toml: MuJoCo flies here",
    found="the gate failed",
    gate="Lander on court",
    gate_report=("gate FAILED", "1 pair broke"),
    violated_probes=("Lander on court: wind", "Lander on court: fog"),
    lost="case.toml: nothing flies it",
    fatal="no ledger",
)


def report() -> pytest.TestReport:
    where = ("test_it.py", 0, "test_it")
    return pytest.TestReport("test_it.py::test_it", where, {}, "passed", None, "call")


def test_example_fills_every_field() -> None:
    for field in dataclasses.fields(ItemRecord):
        assert getattr(FULL, field.name) != field.default, field.name


@pytest.mark.parametrize("field", dataclasses.fields(ItemRecord), ids=lambda field: field.name)
def test_report_keeps_each_field_through_xdist(field: dataclasses.Field[object]) -> None:
    record = dataclasses.replace(ItemRecord(), **{field.name: getattr(FULL, field.name)})
    one = report()
    record.add_to(one)
    assert {name for name, _ in one.user_properties} == {f"garl.{field.name}"}
    sent = execnet.gateway_base.loads(execnet.gateway_base.dumps(one._to_json()))
    assert ItemRecord.of(pytest.TestReport._from_json(sent)) == record


def test_report_keeps_all_fields_through_json() -> None:
    """Plugins such as pytest-reportlog write reports as JSON, which knows no tuples."""
    one = report()
    FULL.add_to(one)
    sent = json.loads(json.dumps(one._to_json()))
    assert ItemRecord.of(pytest.TestReport._from_json(sent)) == FULL


def test_unfilled_record_adds_no_property() -> None:
    one = report()
    ItemRecord().add_to(one)
    assert one.user_properties == []
    assert ItemRecord.of(one) == ItemRecord()


def test_properties_of_others_are_kept_and_passed_over() -> None:
    one = report()
    others = [("garl.unknown", 1), ("slot", "mine"), ("signature", "mine")]
    one.user_properties += others
    ItemRecord(signature="").add_to(one)
    assert one.user_properties == [*others, ("garl.signature", "")]
    assert ItemRecord.of(one) == ItemRecord(signature="")


def test_later_record_replaces_the_fields_that_it_fills() -> None:
    one = report()
    ItemRecord(signature="IV:dog", gate_report=("a", "b"), page="one.html").add_to(one)
    ItemRecord(signature="", gate_report=("c",)).add_to(one)
    assert ItemRecord.of(one) == ItemRecord(signature="", gate_report=("c",), page="one.html")


def test_report_of_a_collection_says_nothing() -> None:
    skipped = pytest.CollectReport("test_it.py", "skipped", ("test_it.py", 1, "no"), [])
    assert ItemRecord.of(skipped) == ItemRecord()


def test_only_the_record_knows_the_properties_of_reports() -> None:
    folder = Path(pytest_garl.plugin.__file__).parent
    knowing = {path.name for path in folder.rglob("*.py") if "user_properties" in path.read_text()}
    assert knowing == {"item_record.py", "tally.py"}


@pytest.mark.parametrize(
    "again", [("rerunfailures", "--reruns=1"), ("pytest-retry", "--retries=1")]
)
def test_junit_names_each_property_of_a_repeated_test_once(
    pytester: pytest.Pytester, again: tuple[str, str]
) -> None:
    project(pytester)
    run(pytester, "--garl-budget=8", "--garl-workers=0", "--junitxml=out.xml", "-p", *again)
    cases = list(ElementTree.parse(Path(pytester.path) / "out.xml").iter("testcase"))
    assert any(case.find("failure") is not None for case in cases)
    for case in cases:
        names = Counter(each.get("name") for each in case.iter("property"))
        assert names["garl.signature"] == 1
        assert set(names.values()) == {1}
