from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from pytest_garl.errors import GarlError
from pytest_garl.npcs.domain_policy import GRADED, domain_with_policy, policy_in
from pytest_garl.npcs.policy_catalogue import DEFAULT_POLICY, policy_names
from pytest_garl.search.method_catalogue import (
    DEFAULT_METHOD,
    declaration_of,
    default_policy,
    make_method,
    method_names,
)
from tests.search.searches import bred, plan


def test_each_method_file_declares_its_method() -> None:
    assert DEFAULT_METHOD in method_names()
    for name in method_names():
        declared = declaration_of(name)
        assert callable(declared.make)
        assert declared.policy in policy_names()


def test_a_method_declares_its_policy_and_a_users_method_gets_the_default() -> None:
    assert default_policy("ga") == "destination"
    assert default_policy("online-rl") == "online-rl"
    assert default_policy("my_search:Hill") == DEFAULT_POLICY == default_policy(DEFAULT_METHOD)


def test_the_catalogue_imports_no_method_and_no_numpy() -> None:
    code = (
        "import sys; from pytest_garl.search.method_catalogue import method_names; method_names(); "
        "print(*[name for name in sys.modules if 'numpy' in name or '.methods' in name])"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_users_method_is_named_by_its_module() -> None:
    users = make_method("pytest_garl.search.methods.garl_paper:make", plan())
    assert bred(users, 2) == bred(make_method("garl-paper", plan()), 2)
    with pytest.raises(GarlError, match=r"'nowhere:method'.*cannot be loaded.*one of .*garl, "):
        make_method("nowhere:method", plan())


@pytest.mark.parametrize(
    ("text", "words"),
    [("raise RuntimeError('no GPU')", "RuntimeError: no GPU"), ("def (", "SyntaxError: invalid")],
)
def test_a_users_method_whose_module_cannot_be_imported_is_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, words: str
) -> None:
    (tmp_path / "method_that_raises.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(GarlError, match=rf"'method_that_raises:make': cannot be loaded \({words}"):
        make_method("method_that_raises:make", plan())


@pytest.mark.parametrize("name", ["field", "calm"])
def test_every_method_flies_with_graded_npcs_in_a_domain_that_names_a_grade(name: str) -> None:
    domain = domain_with_policy(name)
    policies = {policy_in(domain, default_policy(method)) for method in method_names()}
    assert policies == {GRADED}
    page = (Path(__file__).parents[2] / "docs" / "methods.md").read_text()
    assert f"`{name}`" in page.partition("(policy `graded`)")[0]


def test_the_page_on_methods_has_a_row_for_each_with_its_policy() -> None:
    page = (Path(__file__).parents[2] / "docs" / "methods.md").read_text()
    table = page[: page.index("\n## ")]
    rows = re.findall(r"^\| `([a-z0-9-]+)`.* \| (.+) \| `([a-z0-9_-]+)` \|$", table, re.MULTILINE)
    assert {name: policy for name, _, policy in rows} == {
        name: declaration_of(name).policy for name in method_names()
    }
    for name, text, _ in rows:
        extra = declaration_of(name).extra
        assert (f"pytest-garl[{extra}]" in text) == bool(extra), name
