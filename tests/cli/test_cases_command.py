from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pytest_garl.cases.case import Prevention
from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import Corpus, replace_file
from pytest_garl.cases.reference_proofs import Proofs
from pytest_garl.cases.replay import SourceHashes
from pytest_garl.cli import main
from pytest_garl.cli.cases_command import _Project
from pytest_garl.execution.severity import Severity
from pytest_garl.verdicts.verdict import Limits
from tests.cases.samples import case as dog_case
from tests.support.broken_lander import LAWN, broken_project
from tests.support.ffmpeg import hide_encoders


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return the case file of a project whose lander is broken, relative to the project."""
    yield from broken_project(tmp_path, monkeypatch)


def garl(*args: str | Path) -> Result:
    return CliRunner().invoke(main, ["cases", *map(str, args)], env={"COLUMNS": "200"})


def repair_lander() -> None:
    Path("broken").unlink()


def test_list_and_show_describe_a_case(file: Path) -> None:
    listed = garl("list")
    assert "stack_of_test/lawn-V-ZeroDivisionError-" in listed.output
    assert "open" in listed.output
    shown = garl("show", file).output
    assert "raised: ZeroDivisionError: no plan." in shown
    assert "fog, visibility 100 m" in shown
    assert "a person of up to 0.00 m/s" in shown


def test_list_names_new_cases_until_they_are_accepted(file: Path) -> None:
    new = garl("list").output
    assert "pytest fails on them until they are fixed, committed or accepted" in new
    assert new.endswith(f"garl cases accept {file}\n")
    assert garl("accept", file).exit_code == 0
    assert "garl cases accept" not in garl("list").output


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("pytest.ini", "[pytest]\ngarl_cases = kept\n"),
        ("pyproject.toml", '[tool.pytest.ini_options]\ngarl_cases = "kept"\n'),
    ],
)
def test_commands_look_into_the_folder_that_pytest_s_settings_name(
    file: Path, name: str, text: str
) -> None:
    Path("scenarios/regressions").rename("kept")
    assert garl("list").output.startswith("no cases in scenarios/regressions")
    Path(name).write_text(text)
    listed = garl("list").output
    assert file.stem in listed
    assert "garl cases accept kept/" in listed
    assert garl("check").exit_code == 0
    Path("empty").mkdir()
    assert garl("--folder=empty", "list").output.startswith("no cases in empty")
    Path(name).write_text(text.replace("[", "(", 1))
    broken = garl("list")
    assert broken.exit_code == 1
    assert broken.output.startswith(f"Error: {name}: ")


def test_show_omits_neighbours_if_none_was_flown(file: Path) -> None:
    case = load_case(file)
    evidence = dataclasses.replace(case.evidence, neighbours=0, neighbours_failed=0)
    file = replace_file(file, dataclasses.replace(case, evidence=evidence))
    assert "neighbours" not in garl("show", file).output
    assert "0/0" not in garl("list").output


def test_show_says_until_when_a_collision_was_preventable(file: Path) -> None:
    found = Prevention(answer="sensor-limited", inevitable_s=0.5, observed_s=0.3)
    judged = dataclasses.replace(load_case(file), prevention=found, reason="sensor-limited")
    file = replace_file(file, judged)
    output = garl("show", file).output
    assert "sensor-limited: an escape exists 1.0 s before the contact, none 0.5 s" in output
    assert "It gates nothing: an escape exists, but the camera did not show the body" in output
    assert "open (sensor-limited)" in garl("list").output


def test_show_says_which_adversary_the_violation_takes(file: Path) -> None:
    person = Severity(about="body", grade="careless", type="person", objects=2, speed_mps=1.4)
    case = dataclasses.replace(load_case(file), severity=person)
    output = garl("show", replace_file(file, case)).output
    assert (
        "\nIt takes a careless person at 1.4 m/s, 1 other there (it knows nothing of the UAV).\n"
    ) in output


def test_promoted_case_gates_again(file: Path) -> None:
    judged = dataclasses.replace(load_case(file), reason="unpreventable")
    file = replace_file(file, judged)
    repair_lander()
    assert garl("promote", file).exit_code == 0
    fixed = load_case(file)
    assert (fixed.status, fixed.gates) == ("fixed", True)


def test_promote_refuses_a_lander_that_gives_up_needlessly(file: Path) -> None:
    file = replace_file(file, dataclasses.replace(load_case(file), limits=Limits()))
    repair_lander()
    assert "still fails with its recorded moves (II:" in garl("promote", file).output
    assert load_case(file).status == "open"


def test_promote_marks_those_that_are_fixed_of_several_cases(file: Path) -> None:
    copy = file.with_name("copy.toml")
    copy.write_text(file.read_text())
    case = load_case(file)
    another = dataclasses.replace(case.scenario, seed=case.scenario.seed + 1)
    needless = replace_file(copy, dataclasses.replace(case, scenario=another, limits=Limits()))
    repair_lander()
    done = garl("promote", needless, file)
    assert done.exit_code != 0
    assert f"{needless}: still fails with its recorded moves (II:" in done.output
    assert f"{file}: fixed; from now on it must pass" in done.output
    assert (load_case(needless).status, load_case(file).status) == ("open", "fixed")


def test_promote_requires_a_replay_that_is_fixed(file: Path) -> None:
    failed = garl("replay", file)
    assert failed.output.startswith("FAILED\nV:ZeroDivisionError@stack_of_test.step")
    assert failed.exit_code == 1
    refused = garl("promote", file)
    assert "still fails with its recorded moves" in refused.output
    assert load_case(file).status == "open"
    repair_lander()
    fixed = garl("replay", file)
    assert fixed.output.startswith("FIXED\nno violation")
    assert fixed.exit_code == 0
    assert garl("promote", file).exit_code == 0
    assert load_case(file).status == "fixed"


def test_prune_deletes_a_case_that_passes_on_a_changed_map(file: Path) -> None:
    file.write_text(file.read_text().replace(LAWN.sha256, "0" * 64))
    assert garl("replay", file).exit_code == 1
    assert "1 cases are not stale" in garl("prune", "--yes").output
    repair_lander()
    stale = garl("replay", file)
    assert stale.output.startswith("STALE")
    assert "the map 'lawn' has changed\njudged by the built-in verdict" in stale.output
    assert stale.exit_code == 3
    assert "passes, but the map 'lawn' has changed" in garl("prune", "--yes").output
    assert not file.exists()


def test_shrink_simplifies_a_saved_case(file: Path) -> None:
    result = garl("shrink", file, "--flights=20", "--workers=0")
    assert result.exit_code == 0, result.output
    (path,) = Path("scenarios/regressions/stack_of_test").glob("*.toml")
    case = load_case(path)
    assert case.scenario["environment.fog"] == 0.0
    assert len(case.scenario.removed_objects) == len(LAWN.all_objects)
    assert case.status == "open"


def test_shrink_refuses_a_case_that_passes(file: Path) -> None:
    before = file.read_text()
    repair_lander()
    output = garl("shrink", file, "--workers=0").output
    assert "does not fail in the same way any more with its recorded moves" in output
    assert file.read_text() == before


def test_check_names_every_problem(file: Path) -> None:
    assert garl("check").output == "1 cases, 0 problems\n"
    file.write_text(file.read_text().replace("seed = 3", "seed = 4"))
    file.with_name("other.toml").write_text("schema = ")
    checked = garl("check")
    assert "it was changed by hand" in checked.output
    assert "not valid TOML" in checked.output
    assert checked.exit_code == 1


def test_missing_system_gives_one_clear_error(file: Path) -> None:
    file.write_text(file.read_text().replace("stack_of_test:Lander", "stack_of_test:Landr"))
    result = garl("replay", file)
    assert "system 'stack_of_test:Landr': cannot be imported from" in result.output
    assert result.exit_code == 1


def test_replay_draws_a_video(file: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    assert "drawn: it.mp4" in garl("replay", file, "--video=it.mp4").output
    assert Path("it.mp4").read_bytes()[4:8] == b"ftyp"


def test_list_shows_signatures_without_emoji(tmp_path: Path) -> None:
    Corpus(tmp_path).save(dog_case())
    listed = CliRunner().invoke(
        main, ["cases", "--folder", str(tmp_path), "list"], env={"COLUMNS": "200"}
    )
    assert "IV:dog:last-metre:unseen" in listed.output


def test_commands_print_no_escape_sequences_of_cases_or_names(file: Path) -> None:
    text = file.read_text()
    hostile = text.replace("V:ZeroDivisionError@", "[red]\\u001b[2J:[/x]@")
    hostile = hostile.replace("raised: ZeroDivisionError", "raised \\u202e: ZeroDivisionError")
    strange = file.with_name("a\x1b[31mb.toml")
    strange.write_text(hostile)
    file.with_name("broken\x1b[2J.toml").write_text("schema = ")
    shown = {}
    for command in ("list", "check", "show"):
        # With colours, as on a terminal: click removes escape sequences elsewhere.
        args = ["cases", command, *([str(strange)] if command == "show" else [])]
        done = CliRunner().invoke(main, args, env={"COLUMNS": "200"}, color=True)
        shown[command] = done.output
        assert "Traceback" not in done.output
        assert not {"\x1b", "\u202e"} & {*done.output}
    assert "[red]\\x1b[2J:[/x]@stack_of_test" in shown["list"]
    assert "[red]\\x1b[2J:[/x]@stack_of_test" in shown["show"]
    assert "raised \\u202e: ZeroDivisionError" in shown["show"]
    assert "stack_of_test/a\\x1b[31mb" in shown["list"]
    assert "replay 'scenarios/regressions/stack_of_test/a\\x1b[31mb.toml" in shown["show"]
    assert "broken\\x1b[2J.toml: not valid TOML" in shown["check"]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("raise RuntimeError('\\x1b[2J')", r"RuntimeError: \x1b[2J"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("def", "SyntaxError"),
    ],
)
def test_check_names_a_module_that_raises_on_import(file: Path, code: str, words: str) -> None:
    Path("stack_of_test.py").write_text(code)
    checked = garl("check")
    assert words in checked.output
    assert "0 problems" not in checked.output
    assert checked.exit_code == 1


@pytest.mark.parametrize("system", ["../../x:Straight", "x.:Straight", "x:Stra ight", "/x:y"])
def test_invalid_system_name_is_never_imported(
    file: Path, system: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = importlib.import_module

    def refuse(name: str) -> object:
        assert name.startswith("pytest_garl.")
        return real(name)

    monkeypatch.setattr("importlib.import_module", refuse)
    file.write_text(file.read_text().replace("stack_of_test:Lander", system))
    for command in (["check"], ["replay", file]):
        result = garl(*command)
        assert f"key 'system': found '{system}', expected 'module:class'" in result.output
        assert result.exit_code == 1


def test_list_in_a_pipe_keeps_whole_names(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    output = garl("list").output
    assert f"{file.parent.name}/{file.stem} " in output
    assert "V:ZeroDivisionError@stack_of_test.step " in output
    assert "…" not in output


def test_video_without_an_encoder_is_refused_before_the_flight(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hide_encoders(monkeypatch)
    result = garl("replay", file, "--video=flight.mp4")
    assert result.exit_code == 1
    assert "pip install 'pytest-garl[video]'" in result.output
    assert "FAILED" not in result.output


def test_a_proof_is_read_from_the_folder_of_the_runs(tmp_path: Path) -> None:
    (tmp_path / "pytest.ini").write_text("[pytest]\ngarl_dir = out\n")
    (tmp_path / "out").mkdir()
    sources = SourceHashes(system_sha256="11", simulator_sha256="22", map_sha256="33")
    Proofs(tmp_path / "out").note(dog_case(), sources)
    project = _Project(root=tmp_path, corpus=Corpus(tmp_path / "cases"), named=False)
    assert SourceHashes.of(project.proved(dog_case()).evidence) == sources
