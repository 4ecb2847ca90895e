from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

from pytest_garl.cases.case import Case
from pytest_garl.npcs.policy_catalogue import policy_spec
from pytest_garl.plugin.session.search_setup import npc_policy_of
from tests.cases.samples import OBJECT_NAMES, case, case_with_changes


def test_case_flies_with_its_moves_and_changes() -> None:
    def arguments(each: Case) -> dict[str, Any]:
        target: Any = SimpleNamespace(case=each, live=False)
        return dict(npc_policy_of(target, policy_spec("greedy")).arguments)

    changes = json.loads(arguments(case_with_changes())["changes"])
    assert changes == {
        OBJECT_NAMES[-1]: [[0, "environment.fog", 0.01], [2, "environment.sun_position", -0.01]]
    }
    # So that the searches' keys of other cases stay what they were.
    assert arguments(case()).keys() == {"moves"}
