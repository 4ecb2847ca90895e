"""Red means broken, green means safe: what excuses a failing item, and what does not."""

from __future__ import annotations

import pytest

from tests.plugin.test_plugin import project, run

PARALLEL = pytest.mark.parametrize("parallel", [(), ("-n2",)], ids=["alone", "xdist"])


def write_tests(pytester: pytest.Pytester, system: str, tests: str) -> None:
    project(pytester, system)
    head = (
        "import pytest\nfrom systems import *\n"
        f"pytestmark = pytest.mark.garl(system={system}, maps=['lawn'])\n"
    )
    (pytester.path / "test_it.py").write_text(head + tests)


COLLISIONS = "\ndef test_collisions(landing):\n    assert not landing.collisions\n"
DISTANCE = "\ndef test_distance(landing):\n    assert landing.distance_to_landing_m <= 1.5\n"


@PARALLEL
@pytest.mark.parametrize(
    "first",
    [
        "\n@pytest.mark.skip\ndef test_first(landing): pass\n",
        "\n@pytest.mark.xfail(reason='known')\ndef test_first(landing): pass\n",
        "\ndef test_first(scenario): assert scenario.map == 'lawn'\n",
        "\n@pytest.fixture\ndef absent(landing): pytest.skip('no camera')\n"
        "def test_first(absent, landing): pass\n",
    ],
    ids=["skipped", "xfailed", "scenario", "fixture"],
)
def test_a_crash_fails_an_item_whatever_happens_to_the_first(
    pytester: pytest.Pytester, first: str, parallel: tuple[str, ...]
) -> None:
    write_tests(pytester, "Raises", first + DISTANCE + COLLISIONS)
    result = run(pytester, "--garl-budget=4", "--garl-workers=1", *parallel)
    found = result.parseoutcomes()
    assert (found["failed"], found.get("passed", 0), found.get("errors", 0)) == (1, 0, 0)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*ZeroDivisionError: no plan*"])
