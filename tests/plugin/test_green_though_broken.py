"""Ways in which a session could be green although the landing system is broken: all are red in CI.

Each row of ``TRICKS`` is a small project and a command.  The landing system comes down three metres
off in fog, and a fast dog hits it; in most flights it lands well.  The rows of lost corpora are in
``test_lost_cases.py``.
"""

from __future__ import annotations

import dataclasses
import fnmatch
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field

import pytest

from pytest_garl.cases.case_file import dump_case, load_case
from tests.support.case_project import cases, replace_text
from tests.support.landing_project import CONFTEST, SYSTEMS, TESTS, project, run

RED = pytest.ExitCode.TESTS_FAILED
REFUSED = pytest.ExitCode.INTERRUPTED
"""pytest's status for errors at collection."""
SEARCH = ("--garl-budget=8", "--garl-workers=0")
UNASSERTED = "no selected test fails for these violations: *IV:dog:"
NOTHING_FLOWN = "nothing was flown, although flights were asked for: "


@dataclass(frozen=True, slots=True, kw_only=True)
class Trick:
    """A project and a command: ``files`` replace those of the project, ``words`` are printed."""

    words: str
    files: Mapping[str, str] = field(default_factory=dict)
    args: tuple[str, ...] = SEARCH
    environment: Mapping[str, str] = field(default_factory=dict)
    status: int = RED


HEAD = (
    "import pytest, unittest\nfrom systems import *\n"
    "MARK = pytest.mark.garl(system=Good, maps=['lawn'])\n"
)
MARKED = f"{HEAD}pytestmark = MARK\n"
ALL_TESTS = TESTS.format(system="Good", maps="['lawn']")
ENDS_PROCESS = f"{SYSTEMS}\nclass Ends(Good):\n    def step(self, observation): %s\n"
TESTS_OF_ENDS = TESTS.format(system="Ends", maps="['lawn']")


def _ends(*lines: str) -> dict[str, str]:
    """Return the files of a project whose landing system runs some code in each step."""
    return {"systems.py": ENDS_PROCESS % "; ".join(lines), "test_it.py": TESTS_OF_ENDS}


INHERITED = f"""{HEAD}
class Careful(Good):
    dodges = True

@pytest.mark.garl(system=Careful, maps=["lawn"])
class TestCareful:
    def test_a(self, landing): assert not landing.collisions

@pytest.mark.garl(system=Good, maps=["lawn"])
class TestGood(TestCareful): pass
"""
TWO_SYSTEMS = f"""{HEAD}
class Other(Good): pass

@pytest.mark.garl(system=Good, maps=["lawn"])
def test_reads_nothing(landing): pass

@pytest.mark.garl(system=Other, maps=["lawn"])
def test_asserts(landing):
    assert not landing.collisions
    assert landing.distance_to_landing_m <= 1.5
"""
WORDS_OF_TWO_MARKS = "has 2 marks garl, and a test flies one of them"


TRICKS = {
    # Tests that fail for the violation are not there, or cannot fail.
    "k": Trick(args=(*SEARCH, "-k", "test_time"), words=UNASSERTED),
    "conftest drops tests": Trick(
        files={
            "conftest.py": f"{CONFTEST}\n"
            "def pytest_collection_modifyitems(items):\n"
            "    items[:] = [item for item in items if 'test_time' in item.name]\n"
        },
        words=UNASSERTED,
    ),
    "tests read nothing": Trick(
        files={"test_it.py": f"{MARKED}def test_a(landing): pass\n"}, words=UNASSERTED
    ),
    "usefixtures only": Trick(
        files={"test_it.py": f"{MARKED}@pytest.mark.usefixtures('landing')\ndef test_a(): pass\n"},
        words=UNASSERTED,
    ),
    "skip on failure": Trick(
        files={
            "test_it.py": f"{MARKED}def test_a(landing):\n"
            "    if landing.collisions or landing.final_distance_m > 1: pytest.skip('later')\n"
        },
        words=UNASSERTED,
    ),
    "asserts stripped": Trick(
        args=(*SEARCH, "--assert=plain"),
        environment={"PYTHONOPTIMIZE": "1"},
        words=UNASSERTED,
    ),
    "xfail mark": Trick(
        files={
            "test_it.py": ALL_TESTS + "\npytestmark = [pytestmark, pytest.mark.xfail(reason='')]\n"
        },
        words=UNASSERTED,
    ),
    "xfail from conftest": Trick(
        files={
            "conftest.py": f"import pytest\n{CONFTEST}\n"
            "def pytest_collection_modifyitems(items):\n"
            "    for item in items: item.add_marker(pytest.mark.xfail)\n"
        },
        words=UNASSERTED,
    ),
    "hook passes all": Trick(
        files={
            "conftest.py": f"import pytest\n{CONFTEST}\n"
            "@pytest.hookimpl(wrapper=True, tryfirst=True)\n"
            "def pytest_runtest_makereport(item, call):\n"
            "    report = yield\n"
            "    report.outcome = 'passed'\n"
            "    return report\n"
        },
        words=UNASSERTED,
    ),
    "another system fails in its slots": Trick(files={"test_it.py": TWO_SYSTEMS}, words=UNASSERTED),
    # Something else flies.
    "a class inherits a mark": Trick(
        files={"test_it.py": INHERITED},
        words="FAILED test_it.py::TestGood::test_a?lawn-g00-s02? - collided with dog-1",
    ),
    "two marks of a module": Trick(
        files={
            "test_it.py": f"{HEAD}class Careful(Good): dodges = True\n"
            "pytestmark = [pytest.mark.garl(system=Careful, maps=['lawn']), MARK]\n"
            "def test_a(landing): assert not landing.collisions\n"
        },
        words=WORDS_OF_TWO_MARKS,
        status=REFUSED,
    ),
    "two marks of a test": Trick(
        files={
            "test_it.py": f"{HEAD}@MARK\n@pytest.mark.garl(system=Good, maps=['court'])\n"
            "def test_a(landing): assert landing.final_distance_m <= 1.5\n"
        },
        words=WORDS_OF_TWO_MARKS,
        status=REFUSED,
    ),
    "another fixture of this name": Trick(
        files={
            "test_it.py": f"{MARKED}@pytest.fixture\ndef landing(): return None\n"
            "def test_a(landing): pass\n"
        },
        words="its 'landing' is not the fixture of pytest-garl",
        status=REFUSED,
    ),
    # Nothing flies.
    "marker without fixture": Trick(
        files={"test_it.py": f"{MARKED}def test_a(): pass\n"},
        words="test_a: carries @pytest.mark.garl and does not take the fixture 'landing'",
        status=REFUSED,
    ),
    "marked parameter without fixture": Trick(
        files={
            "test_it.py": f"{HEAD}@pytest.mark.parametrize('system', [pytest.param(Good, "
            "marks=MARK)])\ndef test_a(system): pass\n"
        },
        words="test_a: carries @pytest.mark.garl and does not take the fixture 'landing'",
        status=REFUSED,
    ),
    "fixture asked for too late": Trick(
        files={"test_it.py": f"{MARKED}def test_a(request): request.getfixturevalue('landing')\n"},
        words="test_a: carries @pytest.mark.garl and does not take the fixture 'landing'",
        status=REFUSED,
    ),
    "unittest": Trick(
        files={
            "test_it.py": f"{HEAD}@MARK\n@pytest.mark.usefixtures('landing')\n"
            "class TestLands(unittest.TestCase):\n    def test_a(self): pass\n"
        },
        words="test_a: the fixture 'landing' needs an item for each flight",
        status=REFUSED,
    ),
    "no marked test": Trick(
        files={"test_it.py": "def test_a(): pass\n"},
        words=f"{NOTHING_FLOWN}no test that ran takes the fixture 'landing'",
    ),
    "other tests selected": Trick(
        files={"test_other.py": "def test_a(): pass\n"},
        args=(*SEARCH, "-k", "test_a"),
        words=f"{NOTHING_FLOWN}no test that ran takes the fixture 'landing'",
    ),
    "no marked test on a map": Trick(
        files={"test_it.py": "def test_a(): pass\n"}, args=("--garl-map=lawn",), words=NOTHING_FLOWN
    ),
    "module skipped": Trick(
        files={
            "test_it.py": "import pytest\npytest.importorskip('not_there')\n" + ALL_TESTS,
            "test_other.py": "def test_a(): pass\n",
        },
        words=NOTHING_FLOWN,
    ),
    "tests skipped": Trick(
        files={
            "test_it.py": ALL_TESTS + "\npytestmark = [pytestmark, pytest.mark.skip(reason='')]\n"
        },
        words=NOTHING_FLOWN,
    ),
    # The process ends.
    "exits in process": Trick(
        files=_ends("import os", "os._exit(0)"),
        words="its process ended with exit status 0",
    ),
    "exits by a name imported before": Trick(
        files={
            "systems.py": "from os import _exit\n" + ENDS_PROCESS % "_exit(0)",
            "test_it.py": TESTS_OF_ENDS,
        },
        words="its process ended with exit status 0",
    ),
    "becomes another program": Trick(
        files=_ends("import os", "os.execlp('true', 'true')"),
        words="its process ended with exit status 0",
    ),
    "swallows what stops it": Trick(
        files={
            "systems.py": f"import os\n{SYSTEMS}\n"
            "class Ends(Good):\n"
            "    def step(self, observation):\n"
            "        try: os._exit(0)\n"
            "        except BaseException: return Land()\n",
            "test_it.py": TESTS_OF_ENDS,
        },
        words="its process ended with exit status 0",
    ),
    "exits in a thread after its flight": Trick(
        files={
            "systems.py": f"import os, threading\n{SYSTEMS}\n"
            "class Ends(Good):\n"
            "    def step(self, observation):\n"
            "        threading.Timer(0.1, os._exit, (0,)).start()\n"
            "        return Land()\n",
            "test_it.py": f"{HEAD}import time\npytestmark = pytest.mark.garl(system=Ends)\n"
            "def test_a(landing): time.sleep(2)\n",
        },
        args=("--garl-budget=1", "--garl-workers=0"),
        words="",
        status=pytest.ExitCode.INTERNAL_ERROR,
    ),
    "sys.exit": Trick(files=_ends("import sys", "sys.exit(0)"), words="SystemExit"),
}


@pytest.mark.parametrize("name", TRICKS)
def test_a_trick_does_not_make_a_broken_system_green(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    trick = TRICKS[name]
    project(pytester)
    for file, text in trick.files.items():
        (pytester.path / file).write_text(text)
    for variable, value in {"CI": "true", **trick.environment}.items():
        monkeypatch.setenv(variable, value)
    result = run(pytester, *trick.args)
    assert result.ret == trick.status
    # Lines are as long as the terminal is wide.
    output = " ".join((result.stdout.str() + result.stderr.str()).split())
    assert fnmatch.fnmatchcase(output, f"*{trick.words}*")
    assert "INTERNALERROR" not in output


def test_deselecting_all_tests_is_no_success(pytester: pytest.Pytester) -> None:
    project(pytester)
    result = run(pytester, *SEARCH, "-k", "nothing_at_all")
    assert result.ret == pytest.ExitCode.NO_TESTS_COLLECTED


OFF = "off = 3.0 if scenario"
FARTHER_OFF = "off = 9.0 if scenario"
WORSE = "its margin is -8.25, the worst known is -2.25"
OTHERWISE = "the search's first violation of the kind fails without fog too"


@pytest.mark.parametrize(
    ("known", "broken", "words"),
    [
        ("edge", (), "FAILED test_it.py::test_distance[[]lawn-g00-s00] - landed 3.0 m off"),
        ("git add", ((OFF, FARTHER_OFF),), WORSE),
        ("accepted", ((OFF, FARTHER_OFF),), WORSE),
        ("git add", (('scenario["environment.fog"]', 'scenario["environment.rain"]'),), OTHERWISE),
        ("accepted", (('scenario["environment.fog"]', 'scenario["environment.rain"]'),), OTHERWISE),
    ],
)
def test_a_saved_case_does_not_make_a_broken_system_green(
    searched: pytest.Pytester,
    monkeypatch: pytest.MonkeyPatch,
    known: str,
    broken: tuple[tuple[str, str], ...],
    words: str,
) -> None:
    (path,) = [each for each in cases(searched) if each.name.startswith("lawn-I-nothing")]
    case = load_case(path)
    if known == "edge":
        path.write_text(dump_case(dataclasses.replace(case, reason="edge")))
    if known == "accepted":
        shutil.rmtree(searched.path / ".git")
        for each in cases(searched):
            each.write_text(dump_case(dataclasses.replace(load_case(each), accepted=True)))
    for old, new in broken:
        replace_text(searched.path / "tiny_simulator.py", old, new)
    monkeypatch.setenv("CI", "true")
    result = run(searched, "--garl-budget=8", "--garl-workers=0")
    assert result.ret == RED
    output = " ".join((result.stdout.str() + result.stderr.str()).split())
    assert fnmatch.fnmatchcase(output, f"*{words}*")
