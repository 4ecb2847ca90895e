"""A saved case that nothing can fly any more is red; one that this session leaves out is not."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case
from pytest_garl.cases.corpus import Corpus
from tests.support.broken_lander import case_of_broken_lander
from tests.support.case_project import add_cases_to_git, replace_text
from tests.support.landing_project import write_project

CASES = "scenarios/regressions"


def a_case(system: str = "systems:Raises", map: str = "lawn", **changes: object) -> Case:
    """Return an accepted case of a system that raises at its first step."""
    plain = case_of_broken_lander()
    signature = f"V:ZeroDivisionError@{system.partition(':')[0]}.step"
    return dataclasses.replace(
        plain,
        system=system,
        accepted=True,
        scenario=dataclasses.replace(plain.scenario, map=map),
        violation=dataclasses.replace(plain.violation, signature=signature),
        test="test_it.py::test_distance",
        **changes,  # type: ignore[arg-type]
    )


def save(project: Path, case: Case) -> Path:
    path = Corpus(project / CASES).save(case)
    assert path is not None
    return path


@pytest.fixture
def file(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the case of a project whose landing system raises."""
    monkeypatch.delenv("CI", raising=False)
    write_project(pytester.path, "Raises")
    return save(pytester.path, a_case())


def test_the_step_summary_names_a_lost_case(
    pytester: pytest.Pytester, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drop_map(pytester.path, file)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(pytester.path / "summary.md"))
    run(pytester)
    (line,) = (pytester.path / "summary.md").read_text().splitlines()[2:3]
    assert line.startswith("Lost: scenarios/regressions/systems/lawn-V-ZeroDivisionError-")
    assert "flies on lawn any more, only on court" in line


def run(pytester: pytest.Pytester, *args: str) -> pytest.RunResult:
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", "--garl-workers=0", *args)


def lost(result: pytest.RunResult) -> list[str]:
    """Return the failed items that say why nothing flies a case."""
    return [line for line in result.outlines if line.startswith("FAILED ") and "::lost" in line]


def test_a_case_that_is_flown_is_not_lost(pytester: pytest.Pytester, file: Path) -> None:
    result = run(pytester)
    assert result.ret == pytest.ExitCode.OK, result.outlines
    result.assert_outcomes(xfailed=1, skipped=2)


def rename_module(project: Path, file: Path) -> None:
    (project / "systems.py").rename(project / "landers.py")
    replace_text(project / "test_it.py", "from systems", "from landers")


def rename_class(project: Path, file: Path) -> None:
    replace_text(project / "systems.py", "class Raises", "class Throws")
    replace_text(project / "test_it.py", "system=Raises", "system=Throws")


def drop_map(project: Path, file: Path) -> None:
    replace_text(project / "test_it.py", "['lawn']", "['court']")


def drop_map_of_a_fixed_case(project: Path, file: Path) -> None:
    drop_map(project, file)
    replace_text(file, 'status = "open"', 'status = "fixed"')


def move_into_subfolder(project: Path, file: Path) -> None:
    (file.parent / "old").mkdir()
    file.rename(file.parent / "old" / file.name)


def move_one_folder_up(project: Path, file: Path) -> None:
    file.rename(file.parent.parent / file.name)


def write_suffix_in_capitals(project: Path, file: Path) -> None:
    file.rename(file.with_suffix(".TOML"))


def append_a_suffix(project: Path, file: Path) -> None:
    file.rename(file.with_suffix(".toml.orig"))


def move_to_another_system(project: Path, file: Path) -> None:
    file.parent.rename(file.parent.with_name("landers"))


def fly_another_system(project: Path, file: Path) -> None:
    replace_text(project / "test_it.py", "system=Raises", "system=Good")


def delete_committed_folder(project: Path, file: Path) -> None:
    add_cases_to_git(project)
    shutil.rmtree(project / CASES)


def break_the_file_of_another_system(project: Path, file: Path) -> None:
    other = file.parent.with_name("gone") / "broken.toml"
    other.parent.mkdir()
    other.write_text("schema = ")


def rename_the_test_that_asserts(project: Path, file: Path) -> None:
    file.unlink()
    save(project, a_case(assertion="12345678"))
    replace_text(project / "test_it.py", "def test_distance", "def test_near")


LOSSES: dict[Callable[[Path, Path], None], str] = {
    rename_module: "systems:Raises cannot be imported: there is no module systems",
    rename_class: "systems:Raises cannot be imported: the module systems has no Raises",
    drop_map: "no test of systems:Raises flies on lawn any more, only on court",
    drop_map_of_a_fixed_case: "no test of systems:Raises flies on lawn any more",
    move_into_subfolder: "nothing reads this file: expected regressions/SYSTEM/lawn-V",
    move_one_folder_up: "nothing reads this file: expected regressions/SYSTEM/lawn-V",
    write_suffix_in_capitals: "nothing reads this file: expected regressions/SYSTEM/lawn-V",
    append_a_suffix: "nothing reads this file, which holds a case",
    move_to_another_system: "nothing looks for it in landers/; move it to systems/",
    fly_another_system: "flies systems:Good, and no test flies systems:Raises",
    delete_committed_folder: "the folder has no case any more, but git's index has 1",
    break_the_file_of_another_system: "not valid TOML",
    rename_the_test_that_asserts: "is asserted by test_it.py::test_distance, which is gone",
}


@pytest.mark.parametrize("lose", LOSSES, ids=lambda lose: lose.__name__)
def test_a_lost_case_is_one_red_item(
    pytester: pytest.Pytester, file: Path, lose: Callable[[Path, Path], None]
) -> None:
    lose(pytester.path, file)
    result = run(pytester)
    assert result.ret == pytest.ExitCode.TESTS_FAILED, result.outlines
    assert len(lost(result)) == 1
    assert LOSSES[lose] in result.stdout.str()
    assert "no saved cases" not in result.stdout.str()


def test_a_folder_that_is_named_and_missing_is_a_usage_error(
    pytester: pytest.Pytester, file: Path
) -> None:
    result = run(pytester, "-o", "garl_cases=scenarios/regresions")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    assert "garl_cases: there is no folder" in result.stderr.str()
    (pytester.path / "pytest.ini").write_text("[pytest]\ngarl_cases = kept\n")
    assert run(pytester).ret == pytest.ExitCode.USAGE_ERROR
    (pytester.path / "kept").mkdir()
    assert run(pytester).ret == pytest.ExitCode.OK


def test_a_search_makes_the_folder_that_is_named(pytester: pytest.Pytester, file: Path) -> None:
    result = run(pytester, "-o", "garl_cases=new", "--garl-budget=1", "--garl-shrink=0")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert lost(result) == []


def test_other_files_beside_the_cases_are_no_loss(pytester: pytest.Pytester, file: Path) -> None:
    folder = file.parent
    for name in ("README.md", ".gitkeep", ".notes.toml", "film.mp4", "old.bak"):
        (folder / name).write_text("about these cases")
        (folder.parent / name).write_text("about these cases")
    assert run(pytester).ret == pytest.ExitCode.OK


@pytest.mark.parametrize(
    "args",
    [
        ["-k", "test_distance"],
        ["-m", "not slow", "-k", "not court"],
        ["--deselect", "test_it.py::test_distance"],
        ["--garl-map=lawn", "test_it.py"],
        ["test_it.py::test_time"],
        ["-p", "cacheprovider", "--lf"],
    ],
    ids=" ".join,
)
def test_what_a_session_leaves_out_is_no_loss(
    pytester: pytest.Pytester, file: Path, args: list[str]
) -> None:
    replace_text(pytester.path / "test_it.py", "['lawn']", "['court', 'lawn']")
    save(pytester.path, a_case(map="court"))
    assert lost(run(pytester, *args)) == []


def test_the_marker_selects_a_lost_case(pytester: pytest.Pytester, file: Path) -> None:
    drop_map(pytester.path, file)
    assert len(lost(run(pytester, "-m", "garl"))) == 1
    assert lost(run(pytester, "-k", "test_time")) == []


def test_a_session_without_landing_tests_is_not_asked(
    pytester: pytest.Pytester, file: Path
) -> None:
    drop_map(pytester.path, file)
    pytester.makepyfile(test_unit="def test_unit(): pass")
    assert run(pytester, "test_unit.py").ret == pytest.ExitCode.OK


def in_two_folders(project: Path) -> None:
    """Move the tests of two landing systems into folders of their own, with a case of each."""
    for name in ("a", "b"):
        folder = project / name
        folder.mkdir()
        (folder / f"system_{name}.py").write_text((project / "systems.py").read_text())
        text = (project / "test_it.py").read_text().replace("from systems", f"from system_{name}")
        (folder / f"test_{name}.py").write_text(text)
        case = a_case(system=f"system_{name}:Raises")
        save(project, dataclasses.replace(case, test=f"{name}/test_{name}.py::test_distance"))
    shutil.rmtree(project / CASES / "systems")
    (project / "test_it.py").unlink()


def test_folders_that_run_one_at_a_time_lose_no_case_of_each_other(
    pytester: pytest.Pytester, file: Path
) -> None:
    in_two_folders(pytester.path)
    for args in (["a"], ["b"], ["a/test_a.py"], []):
        assert run(pytester, *args).ret == pytest.ExitCode.OK, args


def test_a_case_of_another_folder_whose_test_moved_is_no_loss_here(
    pytester: pytest.Pytester, file: Path
) -> None:
    """The file in the case's key is gone, and its system is found by the other session only."""
    in_two_folders(pytester.path)
    (pytester.path / "b" / "test_b.py").rename(pytester.path / "b" / "test_landing.py")
    assert run(pytester, "a").ret == pytest.ExitCode.OK
    assert run(pytester).ret == pytest.ExitCode.OK
    shutil.rmtree(pytester.path / "b")
    result = run(pytester, "a")
    assert len(lost(result)) == 1
    assert "there is no module system_b" in result.stdout.str()


def test_a_test_that_moved_to_another_file_loses_no_case(
    pytester: pytest.Pytester, file: Path
) -> None:
    project = pytester.path
    shutil.copy(project / "test_it.py", project / "test_that.py")
    fly_another_system(project, file)
    assert lost(run(pytester, "test_it.py")) == []
    assert run(pytester).ret == pytest.ExitCode.OK
    (project / "test_that.py").unlink()
    assert len(lost(run(pytester, "test_it.py"))) == 1


def test_a_deleted_test_file_loses_the_case_in_a_session_of_all_tests(
    pytester: pytest.Pytester, file: Path
) -> None:
    in_two_folders(pytester.path)
    (pytester.path / "b" / "test_b.py").unlink()
    (pytester.path / "conftest.py").write_text("import sys; sys.path.append('b')\n")
    result = run(pytester, "a")
    assert len(lost(result)) == 1
    assert "no test flies system_b:Raises" in result.stdout.str()


def test_a_module_that_is_skipped_at_collection_loses_no_case(
    pytester: pytest.Pytester, file: Path
) -> None:
    in_two_folders(pytester.path)
    path = pytester.path / "b" / "test_b.py"
    path.write_text("import pytest\npytest.importorskip('not_there')\n" + path.read_text())
    assert lost(run(pytester)) == []


def test_two_classes_of_one_module_share_a_folder(pytester: pytest.Pytester, file: Path) -> None:
    project = pytester.path
    replace_text(
        project / "systems.py", "class Exits", "class Raises2(Raises): pass\n\nclass Exits"
    )
    text = (project / "test_it.py").read_text().replace("system=Raises", "system=Raises2")
    (project / "test_that.py").write_text(text)
    save(project, a_case(system="systems:Raises2"))
    result = run(pytester)
    assert result.ret == pytest.ExitCode.OK, result.outlines
    result.assert_outcomes(xfailed=2, skipped=4)


def test_a_hook_that_expects_all_failures_hides_no_lost_case_from_a_build_server(
    pytester: pytest.Pytester, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drop_map(pytester.path, file)
    with (pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "import pytest\ndef pytest_collection_modifyitems(items):\n"
            "    for item in items: item.add_marker(pytest.mark.xfail)\n"
        )
    assert run(pytester).ret == pytest.ExitCode.OK
    monkeypatch.setenv("CI", "true")
    result = run(pytester)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(["1 failure hidden by a mark xfail or by a hook:*"])


def test_a_hook_may_skip_a_lost_case(pytester: pytest.Pytester, file: Path) -> None:
    """As with a hook that skips all tests with the marker where nothing is to be flown."""
    drop_map(pytester.path, file)
    with (pytester.path / "conftest.py").open("a") as conftest:
        conftest.write(
            "import pytest\ndef pytest_collection_modifyitems(items):\n"
            "    for item in items: item.add_marker(pytest.mark.skip)\n"
        )
    result = run(pytester)
    assert result.ret == pytest.ExitCode.OK
    result.assert_outcomes(skipped=4)


def test_xdist_reports_a_lost_case_once(pytester: pytest.Pytester, file: Path) -> None:
    pytest.importorskip("xdist")
    drop_map(pytester.path, file)
    result = run(pytester, "-n2")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert len(lost(result)) == 1
    named = run(pytester, "-n2", "-o", "garl_cases=typo")
    assert named.ret == pytest.ExitCode.TESTS_FAILED
    assert "there is no folder" in named.stdout.str()


def test_a_committed_case_alone_may_be_deleted(pytester: pytest.Pytester, file: Path) -> None:
    other = save(pytester.path, dataclasses.replace(a_case(), system="systems:Exits"))
    add_cases_to_git(pytester.path)
    other.unlink()
    assert run(pytester).ret == pytest.ExitCode.OK
    file.unlink()
    assert len(lost(run(pytester))) == 1
    subprocess.run(["git", "rm", "-rq", "--cached", CASES], cwd=pytester.path, check=True)
    assert run(pytester).ret == pytest.ExitCode.OK


def checked(project: Path, *args: str) -> tuple[int, str]:
    """Return exit status and output of ``garl cases check``."""
    start = "from pytest_garl.cli import main; main()"
    command = [sys.executable, "-c", start, "cases", *args, "check"]
    done = subprocess.run(command, cwd=project, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.parametrize(
    "lose", [drop_map, move_one_folder_up, fly_another_system], ids=lambda lose: lose.__name__
)
def test_check_names_what_a_session_names(
    pytester: pytest.Pytester, file: Path, lose: Callable[[Path, Path], None]
) -> None:
    assert checked(pytester.path) == (0, "1 cases, 0 problems\n")
    lose(pytester.path, file)
    status, output = checked(pytester.path)
    assert status == 1
    assert LOSSES[lose] in output
    assert "1 problems" in output


def test_check_collects_files_that_pytest_cannot_collect_together(
    pytester: pytest.Pytester, file: Path
) -> None:
    in_two_folders(pytester.path)
    for name in ("a", "b"):
        (pytester.path / name / f"test_{name}.py").rename(pytester.path / name / "test_same.py")
        for case in (pytester.path / CASES / f"system_{name}").glob("*.toml"):
            replace_text(case, f"test_{name}.py", "test_same.py")
    assert checked(pytester.path) == (0, "2 cases, 0 problems\n")
    (pytester.path / "b" / "test_same.py").write_text("import not_there")
    status, output = checked(pytester.path)
    assert status == 1
    assert "b/test_same.py: cannot be collected: ModuleNotFoundError" in output


def test_check_takes_the_folder_of_the_ini_key(pytester: pytest.Pytester, file: Path) -> None:
    (pytester.path / "pytest.ini").write_text("[pytest]\ngarl_cases = kept\n")
    status, output = checked(pytester.path)
    assert status == 1
    assert "garl_cases: there is no folder" in output
    (pytester.path / CASES).rename(pytester.path / "kept")
    assert checked(pytester.path) == (0, "1 cases, 0 problems\n")
    assert "there is no folder typo" in checked(pytester.path, "--folder", "typo")[1]
