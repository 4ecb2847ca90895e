"""The public names: what is typed is there, and nothing heavy is loaded before it is used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import pytest_garl
from pytest_garl.errors import OptionError
from pytest_garl.verdicts.verdict import Limits


def test_the_stub_has_the_names_that_the_package_loads() -> None:
    stub = ast.parse(Path(pytest_garl.__file__).with_suffix(".pyi").read_text())
    (names,) = (
        ast.literal_eval(node.value)
        for node in stub.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    assert list(pytest_garl.__all__) == names
    for name in names:
        assert getattr(pytest_garl, name) is not None


def test_limits_are_made_by_a_function_with_a_verbs_name() -> None:
    assert pytest_garl.limits(distance_m=1.0) == Limits(distance_m=1.0)


def test_a_name_that_is_no_limit_is_refused_with_the_names_that_are() -> None:
    message = "found distance, expected distance_m, time_s or abort, such as"
    with pytest.raises(OptionError, match=message):
        pytest_garl.limits(distance=3)  # type: ignore[call-arg]


def test_importing_the_package_loads_no_other_module_of_it() -> None:
    code = (
        "import sys, pytest_garl; print([n for n in sys.modules if n.startswith('pytest_garl.')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
