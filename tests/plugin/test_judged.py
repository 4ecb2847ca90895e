"""What the judge says reaches the tests of a search."""

from __future__ import annotations

import pytest

from tests.plugin.test_plugin import project, run

LANDED = '    outcome: Any = "landed"\n'
GAVE_UP = '    outcome: Any = "aborted"\n'
UNTOUCHED = "    contacts: tuple[Contact, ...] = ()\n"
TOUCHED = """\
    contacts: tuple[Contact, ...] = (
        Contact(
            time_s=14.2,
            body="ground",
            kind="ground",
            body_class="ground",
            position_m=(0.0, 0.0, 0.0),
            speed_mps=0.5,
            tilt_rad=0.0,
        ),
    )
"""


def test_touching_the_ground_off_the_marker_before_an_abort_fails_the_search(
    pytester: pytest.Pytester,
) -> None:
    project(pytester)
    path = pytester.path / "tiny_simulator.py"
    text = path.read_text()
    for old, new in ((LANDED, GAVE_UP), (UNTOUCHED, TOUCHED), ("if scenario.get(", "if 0 and (")):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    result = run(pytester, "--garl-budget=6", "--garl-workers=0", "--garl-weather=full")
    outcomes = result.parseoutcomes()
    assert outcomes["failed"] == 1
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*Touched the ground 3.0 m off the marker before it gave up*"])
    result.stdout.fnmatch_lines(["* I[?]:unknown * pytest test_it.py --garl-repeat=lawn-g*"])
    result.stdout.fnmatch_lines(["FAILED test_it.py::test_distance*"])
