"""The code of docs/extending.md runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"
BLOCK = re.compile(r"^```python\n# (?P<file>\w+\.py)\n(?P<code>.*?)^```$", re.DOTALL | re.MULTILINE)


def test_the_parts_of_the_page_fly_together(pytester: pytest.Pytester) -> None:
    blocks = [(found["file"], found["code"]) for found in BLOCK.finditer(PAGE.read_text())]
    assert len(blocks) == PAGE.read_text().count("```python") == 5
    for name, code in blocks:
        with (pytester.path / name).open("a") as file:
            file.write(code)
    pytester.makepyfile(
        my_landing="""
        from pytest_garl import Land

        class MyLandingSystem:
            def reset(self, mission): pass
            def step(self, observation): return Land()
        """,
        test_landing="""
        import pytest
        from my_landing import MyLandingSystem

        pytestmark = pytest.mark.garl(system=MyLandingSystem, maps=["lawn"])

        def test_lands(landing):
            assert landing.distance_to_landing_m <= landing.limits.distance_m
        """,
    )
    method = ("--garl-method=my_method:InFog", "-o", "pythonpath=.")
    result = pytester.runpytest_subprocess(
        "-p", "no:cacheprovider", "--garl-budget=3", "--garl-workers=1", "--garl-shrink=0", *method
    )
    result.assert_outcomes(failed=1, xfailed=2, passed=1)
    result.stdout.fnmatch_lines(["*landed 3.0 m off the marker*"])
