from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pytest_garl.cases.census import system_problem
from pytest_garl.errors import LandingSystemError
from pytest_garl.execution.reference import check_system, reference_to, system_named
from pytest_garl.execution.sources import source_hashes
from pytest_garl.landing_system import Airframe, Land
from pytest_garl.program import ProgramFailedError, ProgramSystem
from pytest_garl.simulation.system_under_test.calls import crash_of
from tests.support.landing_project import project, run

STACK = """
from pathlib import Path
from pytest_garl import Airframe, Land
from pytest_garl.errors import LandingSystemError
from pytest_garl.program import ProgramFailedError, ProgramSystem

class Flown:
    def __init__(self, says): self.says = says
    def reset(self, mission): pass
    def step(self, observation):
        if self.says == "nothing":
            raise ProgramFailedError("KeyError", "'id'", where="lander.main", trace="line 7")
        return Land()

class OwnProgram(ProgramSystem):
    def __init__(self, script, *, name=None, sources=()):
        super().__init__(
            name or Path(script).stem, folder=None, sources=sources, airframe=Airframe(size_m=0.5)
        )
        self.script = script
        self.home = (self.folder / script).parent
        self.settings = (script,)
    def check(self):
        if not (self.folder / self.script).is_file():
            raise LandingSystemError(f"there is no {self.script} in {self.folder}")
    def __call__(self):
        return Flown((self.folder / self.script).read_text().strip())
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield a folder from which modules are imported, and forget them afterwards."""
    monkeypatch.syspath_prepend(str(tmp_path))
    known = {*sys.modules}
    (tmp_path / "own_stack.py").write_text(STACK)
    (tmp_path / "lander").mkdir()
    (tmp_path / "lander" / "lander.sh").write_text("land")
    yield tmp_path
    for name in {*sys.modules} - known:
        del sys.modules[name]


def module(folder: Path, name: str, *lines: str) -> str:
    """Write a module that makes programs; return its name."""
    text = "\n".join(("from own_stack import OwnProgram", *lines))
    (folder / f"{name}.py").write_text(f"{text}\n")
    return name


def test_a_program_is_found_again_by_module_and_name(folder: Path) -> None:
    module(folder, "stack_a", 'marks = [OwnProgram("lander/lander.sh")]')
    program = system_named("stack_a:lander")
    assert isinstance(program, ProgramSystem)
    reference = reference_to(program)
    assert (reference.name, reference.file) == ("stack_a:lander", str(folder / "stack_a.py"))
    assert reference.load() is program
    assert program.airframe == Airframe(size_m=0.5)
    assert isinstance(program().step(None), Land)


def test_a_program_needs_a_name_of_its_own_and_a_module_that_makes_it(folder: Path) -> None:
    line = 'OwnProgram("lander/lander.sh")'
    module(folder, "stack_b", line, line)
    with pytest.raises(LandingSystemError, match=r"stack_b makes two programs with the name 'lan"):
        system_named("stack_b:lander")
    module(folder, "stack_c", line, f"def made():\n    return {line[:-1]}, name='late')")
    system_named("stack_c:lander")
    with pytest.raises(LandingSystemError, match="the program late is made inside a function"):
        check_system(sys.modules["stack_c"].made())
    module(folder, "stack_d", 'OwnProgram("my-lander.sh")')
    with pytest.raises(LandingSystemError, match=re.escape("name='my-lander'")):
        system_named("stack_d:my_lander")


def test_a_program_that_cannot_be_started_is_refused(folder: Path) -> None:
    module(folder, "stack_e", 'OwnProgram("gone.sh")')
    with pytest.raises(LandingSystemError, match=r"there is no gone\.sh in"):
        system_named("stack_e:gone")


def test_its_sources_are_its_own_files_its_settings_and_what_carries_it(folder: Path) -> None:
    home = folder / "lander"
    (home / "model").mkdir()
    (home / "model" / "weights.bin").write_bytes(b"1")
    (home / "__pycache__").mkdir()
    (home / "__pycache__" / "x.py").write_text("")
    (home / "test_lander.py").write_text("")
    module(folder, "stack_f", 'OwnProgram("lander/lander.sh")')
    program = system_named("stack_f:lander")
    before = dict(source_hashes(program))
    assert {*before} == {
        "lander/lander.sh",
        "lander/model/weights.bin",
        "own_stack.py",
        "pytest_garl/program.py",
        "the settings of lander",
    }
    (home / "model" / "weights.bin").write_bytes(b"2")
    after = dict(source_hashes(program))
    assert [name for name in before if before[name] != after[name]] == ["lander/model/weights.bin"]
    program.settings = ("lander/lander.sh", "--slow")
    again = dict(source_hashes(program))
    assert [name for name in after if after[name] != again[name]] == ["the settings of lander"]


def test_patterns_choose_the_sources_and_must_match(folder: Path) -> None:
    module(folder, "stack_g", 'OwnProgram("lander/lander.sh", sources=["lander/*.sh"])')
    assert "lander/lander.sh" in dict(source_hashes(system_named("stack_g:lander")))
    module(folder, "stack_h", 'OwnProgram("lander/lander.sh", sources=["*.cpp"])')
    with pytest.raises(LandingSystemError, match=r"sources='\*\.cpp': no file in"):
        source_hashes(system_named("stack_h:lander"))


def test_the_census_takes_a_module_that_makes_programs_for_their_home(folder: Path) -> None:
    module(folder, "stack_i", 'OwnProgram("lander/lander.sh")')
    assert system_problem("stack_i:lander", folder) == ""
    system_named("stack_i:lander")
    assert system_problem("stack_i:lander", folder) == ""
    assert "has no other" in system_problem("stack_i:other", folder)


def test_an_error_of_a_program_is_recorded_as_its_own() -> None:
    error = ProgramFailedError("KeyError", "'id'", where="lander.main", trace="line 7")
    crash = crash_of(error, "step")
    assert (crash.kind, crash.error, crash.where) == ("raised", "KeyError", "lander.main")
    assert (crash.message, crash.traceback) == ("'id'", "line 7")


def test_a_search_flies_a_program_and_reports_its_error(pytester: pytest.Pytester) -> None:
    project(pytester, "OwnProgram('lander.sh')")
    tests = pytester.path / "test_it.py"
    tests.write_text(tests.read_text().replace("systems import *", "own_stack import OwnProgram"))
    (pytester.path / "own_stack.py").write_text(STACK)
    (pytester.path / "lander.sh").write_text("land")
    result = run(pytester, "--garl-budget=2", "--garl-workers=1", "-q")
    result.stdout.no_fnmatch_line("*KeyError*")
    assert result.parseoutcomes()["passed"] > 2
    (pytester.path / "lander.sh").write_text("nothing")
    result = run(pytester, "--garl-budget=2", "--garl-workers=1", "-q")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["*KeyError: 'id'*"])
