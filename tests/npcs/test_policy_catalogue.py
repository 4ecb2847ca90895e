from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.errors import PolicyError
from pytest_garl.npcs.policy_catalogue import (
    DEFAULT_POLICY,
    learned_policies,
    policy_names,
    policy_spec,
    scripted_policies,
)


def test_each_file_of_a_policy_declares_one() -> None:
    assert DEFAULT_POLICY in learned_policies()
    for name in scripted_policies():
        assert policy_spec(name).make()


def test_no_two_policies_share_a_name() -> None:
    assert len(set(policy_names())) == len(policy_names())


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(PolicyError, match=r"'gredy'.*dqn.*greedy.*\.npz"):
        policy_spec("gredy")


def test_the_catalogue_imports_no_policy_and_no_numpy() -> None:
    code = (
        "import sys; from pytest_garl.npcs.policy_catalogue import policy_names; policy_names(); "
        "print(*[name for name in sys.modules if 'numpy' in name or '.policies' in name])"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_the_page_on_policies_has_a_row_for_each() -> None:
    page = (Path(__file__).parents[2] / "docs" / "adversary.md").read_text()
    table = page[page.index("\n## Policies") : page.index("\n## Bodies")]
    rows = re.findall(r"^\| `([a-z0-9_-]+)`.* \| .+ \|$", table, re.MULTILINE)
    assert sorted(rows) == sorted(policy_names())
