from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from pytest_garl.adversary.catalogue import policy_spec
from pytest_garl.baselines.record import BaselineSpec, baseline_from_ledger
from pytest_garl.errors import BaselineError
from tests.baselines.samples import LAWN, baseline_set, job, write_ledger


def test_equal_specs_draw_equal_scenarios_and_a_longer_one_begins_alike() -> None:
    assert BaselineSpec(count=5).scenarios(LAWN) == BaselineSpec(count=9).scenarios(LAWN)[:5]
    assert BaselineSpec(count=5).scenarios(LAWN) != BaselineSpec(count=5, seed=1).scenarios(LAWN)
    worst = max(each["environment.fog"] for each in BaselineSpec(count=50).scenarios(LAWN))
    assert (
        worst
        <= 0.15
        < max(
            each["environment.fog"]
            for each in BaselineSpec(count=50, weather="full").scenarios(LAWN)
        )
    )


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
