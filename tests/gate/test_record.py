from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.errors import BaselineError
from pytest_garl.gate.record import BaselineSpec, baseline_from_ledger
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.scenarios.domains.domain_file import domain_named
from pytest_garl.scenarios.scenario import Scenario
from tests.gate.samples import LAWN, baseline_set, job, write_ledger


def test_equal_specs_draw_equal_scenarios_and_a_longer_one_begins_alike() -> None:
    assert BaselineSpec(count=5).scenarios(LAWN) == BaselineSpec(count=9).scenarios(LAWN)[:5]
    assert BaselineSpec(count=5).scenarios(LAWN) != BaselineSpec(count=5, seed=1).scenarios(LAWN)


def test_the_scenarios_of_a_baseline_come_from_its_domain(tmp_path: Path) -> None:
    def drawn(name: str) -> list[Scenario]:
        return [*BaselineSpec(count=50, domain=domain_named(name, tmp_path)).scenarios(LAWN)]

    (tmp_path / "any.toml").write_text('extends = "paper"\npaper = "full"\n')
    confined, full = drawn("paper"), drawn("any.toml")
    assert max(each["environment.fog"] for each in confined) <= 0.15
    assert max(each["environment.fog"] for each in full) > 0.15
    assert {each["wind.mean_mps"] for each in confined} == {0}
    winds = [each["wind.mean_mps"] for each in drawn("calm")]
    assert 2 < max(winds) <= 3


@pytest.mark.parametrize("method", ["garl", "random", ""])
def test_a_baseline_of_a_search_names_the_search_method(tmp_path: Path, method: str) -> None:
    write_ledger(tmp_path / "ledger.sqlite", job(), method)
    (found,) = baseline_from_ledger(tmp_path / "ledger.sqlite").sets
    assert found == dataclasses.replace(baseline_set(1), method=method)
    assert bool(found.warning) is (method == "garl")


def test_a_ledger_with_an_unavailable_npc_policy_is_refused(tmp_path: Path) -> None:
    own = dataclasses.replace(policy_spec("waypoint"), name="mine", factory="mine:Policy")
    write_ledger(tmp_path / "ledger.sqlite", dataclasses.replace(job(), npcs=own))
    with pytest.raises(BaselineError, match=r"moved by 'mine' \(mine:Policy\), expected"):
        baseline_from_ledger(tmp_path / "ledger.sqlite")
    with pytest.raises(BaselineError, match="there is no ledger"):
        baseline_from_ledger(tmp_path / "none.sqlite")
