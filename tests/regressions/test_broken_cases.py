"""Hostile and oversized cases and baselines: one short message each, on their own entry."""

from __future__ import annotations

import dataclasses
import os
import subprocess
from pathlib import Path

import pytest

from pytest_garl.baselines import file as baselines
from pytest_garl.errors import OptionError, ScenarioError
from pytest_garl.regressions.case_file import dumps, load, load_header, loads
from pytest_garl.regressions.corpus import CorpusError, entries, every_entry, save, save_patch
from pytest_garl.scenarios.maps import map as package
from pytest_garl.scenarios.maps.map import load_map
from pytest_garl.verdicts.verdict import Limits
from tests.baselines.test_file import baseline
from tests.regressions.test_case_file import NAMES, SYSTEM, case, changing

TEXT = dumps(case())
MOVES = "[[2, 0.0, 0.0], [1, 0.6, -0.8]]"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (MOVES, "[[10000, 0.0, 1.0]]", "found .10000, 0.0, 1.0. after 0 moves, .* most 600"),
        (MOVES, f"[{'[10000, 0.0, 1.0], ' * 20_000}]", "expected at most 600 moves in all"),
        (MOVES, "[[600, 0.0, 1.0], [1, 0.0, 1.0]]", "after 600 moves, expected at most 600"),
        ("0.6, -0.8", f"{'9' * 400}, -0.8", r"found \[1, 9+...9+, -0.8\], expected a list"),
        ("0.6, -0.8", "1e200, -0.8", "found .1, 1e.200, -0.8., expected a list"),
        ("[1, 0.6", f"[0x{'f' * 5000}, 0.6", "found list too long to be shown"),
        ("margin = 0.0", f"margin = {'9' * 400}", "'violation.margin': found 999"),
        ("time_s = 120.0", "time_s = 300.5", "'limits.time_s': found 300.5, .* from 0 to 300$"),
        ("distance_m = 1.5", "distance_m = 1001", "'limits.distance_m': found 1001"),
        (SYSTEM, "../../x:Straight", "'system': found '../../x:Straight', expected 'module:cl"),
        (SYSTEM, ".x:Straight", "'system': found '.x:Straight', expected 'module:class'"),
        (SYSTEM, "x:Straight()", "'system': found"),
        (SYSTEM, "x y:Straight", "'system': found"),
        ('map = "lawn"', 'map = "../../../etc/passwd"', "'map': unknown map '../../../etc/pass"),
        ("neighbours = 3", f"neighbours = {2**63}", "'evidence.neighbours': found 9223"),
    ],
)
def test_a_case_that_would_eat_the_machine_or_leave_the_tree_is_refused(
    old: str, new: str, words: str
) -> None:
    assert old in TEXT
    with pytest.raises(ScenarioError, match=words) as caught:
        loads(TEXT.replace(old, new), load_map, source="lawn-x.toml")
    assert "lawn-x.toml" in str(caught.value)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("system", ["a-b.c_d.2nd:Outer.Inner", "stack:Länder"])
def test_what_python_can_import_is_taken(system: str) -> None:
    text = TEXT.replace(SYSTEM, system)
    assert loads(text, load_map).system == system


def test_moves_for_the_longest_flight_are_taken() -> None:
    found = loads(TEXT.replace(MOVES, "[[599, 0.0, 0.0], [1, 0.6, -0.8]]"), load_map)
    assert len(dict(found.moves)[NAMES[-1]]) == 600


def test_a_change_of_the_environment_beyond_the_longest_flight_is_refused() -> None:
    text = dumps(changing())
    assert loads(text.replace("[[0, ", "[[599, "), load_map)
    with pytest.raises(ScenarioError, match=r"found \[600, 'environment.fog', 0.01\], expected"):
        loads(text.replace("[[0, ", "[[600, "), load_map)
    with pytest.raises(ScenarioError, match=r"found \[0, 'environment.fog', 999"):
        loads(text.replace("0.01]", f"{'9' * 400}]", 1), load_map)


def test_escape_sequences_in_a_case_are_written_out() -> None:
    text = TEXT.replace("A dog. It bites.", "A \\u001b[2Jdog.\\u202e")
    assert loads(text, load_map).violation.story == "A \\x1b[2Jdog.\\u202e"


@pytest.mark.parametrize("value", [300.001, -1.0, float("nan"), float("inf"), "120", True])
def test_a_limit_of_time_has_a_limit(value: float) -> None:
    assert Limits(time_s=300.0).time_s == 300.0
    with pytest.raises(OptionError, match=r"limits: found time_s=.* expected a number from 0 to"):
        Limits(time_s=value)


def test_other_limits_that_make_no_sense_are_told() -> None:
    with pytest.raises(OptionError, match=r"found distance_m=-0.5, expected a number from 0 to 10"):
        Limits(distance_m=-0.5)
    with pytest.raises(OptionError, match="found abort='no', expected 'ok' or 'violation'"):
        Limits(abort="no")  # type: ignore[arg-type]


def _folder(tmp_path: Path) -> Path:
    folder = tmp_path / "landing"
    folder.mkdir()
    (folder / "good.toml").write_text(TEXT)
    return folder


@pytest.mark.parametrize(
    "text",
    ["seed = " + "[" * 3000, "seed = " + "9" * 5000, "x" * 1_000_001, "[" * 3000],
    ids=["nested", "digits", "large", "header"],
)
def test_a_file_that_cannot_be_parsed_is_a_fault_of_its_own(tmp_path: Path, text: str) -> None:
    folder = _folder(tmp_path)
    (folder / "bad.toml").write_text(text)
    bad, good = entries(tmp_path, SYSTEM, ())
    assert bad.head is None
    assert bad.problem.startswith(f"{folder / 'bad.toml'}: ")
    assert len(bad.problem) < 300
    assert good.case == case()


def test_a_case_that_is_no_regular_file_is_a_fault_of_its_own(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    (folder / "device.toml").symlink_to("/dev/zero")
    os.mkfifo(folder / "pipe.toml")
    (folder / "sub.toml").mkdir()
    found = {entry.name: entry.problem for entry in every_entry(tmp_path, ())}
    assert "found a device, expected a regular file" in found["device"]
    assert "found a pipe, expected a regular file" in found["pipe"]
    assert "found a folder, expected a regular file" in found["sub"]
    assert found["good"] == ""


def test_a_link_that_leads_nowhere_is_told_and_not_passed_over(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    (folder / "lost.toml").symlink_to("gone.toml")
    (folder / "round.toml").symlink_to("round.toml")
    for found in (entries(tmp_path, SYSTEM, ()), every_entry(tmp_path, ())):
        problems = {entry.name: entry.problem for entry in found}
        assert "found a symbolic link that leads nowhere (No such file" in problems["lost"]
        assert "found a symbolic link that leads nowhere (Too many" in problems["round"]
        assert problems["good"] == ""


@pytest.mark.parametrize("target", ["elsewhere", "landing", "landing/round.toml"])
def test_a_folder_that_is_a_link_to_nothing_is_told(tmp_path: Path, target: str) -> None:
    (tmp_path / "landing").symlink_to(target)
    for found in (entries(tmp_path, SYSTEM, ()), every_entry(tmp_path, ())):
        (entry,) = found
        assert entry.case is None
        assert "found a symbolic link that leads nowhere" in entry.problem


def test_a_folder_of_cases_that_cannot_be_read_is_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(self: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(CorpusError, match="cannot be read: Permission denied"):
        every_entry(tmp_path, ())


def test_the_head_of_a_case_is_read_within_the_limit(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(TEXT + "#" * 1_000_000)
    for read in (load, load_header):
        with pytest.raises(ScenarioError, match="bytes, expected at most 1000000"):
            read(tmp_path / "a.toml")


BASELINE = baselines.dumps(baseline())


@pytest.mark.parametrize(
    ("start", "end", "new", "words"),
    [
        ("cpu = ", "\n", "[" * 3000, "nested too deeply"),
        ("distance_m = ", ",", "9" * 400, "'set.0..limits.distance_m': found 999"),
        ("flights = ", "\n]", "[[" + "9" * 400 + ', "landed", "", false, "", []]', "the seed 99"),
        ("flights = ", "\n]", '["' + "x" * 5000 + '"', r"'set\[0\].flights\[0\]': found 'xxx"),
        ("flights = ", "\n]", '[[0, "landed", "", false, "", [1]]', "found 1 values of genes"),
    ],
)
def test_a_broken_baseline_is_one_short_error(start: str, end: str, new: str, words: str) -> None:
    begin = BASELINE.index(start) + len(start)
    text = BASELINE[:begin] + new + BASELINE[BASELINE.index(end, begin) :]
    with pytest.raises(ScenarioError, match=words) as caught:
        baselines.loads(text, load_map, source="base.toml")
    assert "base.toml" in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_gene_too_large_for_a_float_is_one_error() -> None:
    row = BASELINE.index("\n  [", BASELINE.index("flights = ")) + len("\n  [")
    value = BASELINE.index("[", row) + 1
    text = f"{BASELINE[:value]}{'9' * 400}{BASELINE[BASELINE.index(',', value) :]}"
    with pytest.raises(ScenarioError, match=r"flights\[0\]': environment.dust: found 999.* to 1$"):
        baselines.loads(text, load_map, source="base.toml")


def test_no_baseline_is_saved_that_could_not_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baselines, "LARGEST_BYTES", len(BASELINE) - 1)
    with pytest.raises(baselines.BaselineError, match=r"flights in .* bytes, expected at most"):
        baselines.save(tmp_path / "base.toml", baseline())
    (tmp_path / "base.toml").write_text(BASELINE)
    with pytest.raises(ScenarioError, match=r"bytes, expected at most .* `garl baseline save`"):
        baselines.load(tmp_path / "base.toml")


@pytest.mark.parametrize("name", ['la"wn', "la\\wn", "la wn", "ländle", "a'b;c$d", "-m", "m" * 50])
def test_the_patch_of_a_case_on_a_map_with_a_strange_name_applies(
    tmp_path: Path, name: str
) -> None:
    maps = tmp_path / "scenarios" / "maps"
    maps.mkdir(parents=True)
    (maps / f"{name}.toml").write_text((Path(package.__file__).parent / "lawn.toml").read_text())
    plain = case()
    strange = dataclasses.replace(
        plain, scenario=dataclasses.replace(plain.scenario, map=load_map(name, [maps]).name)
    )
    folder = tmp_path / "cases"
    patch = save_patch(tmp_path / "patches", folder, tmp_path, strange)
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    subprocess.run(["git", "apply", str(patch)], cwd=tmp_path, check=True)
    (entry,) = every_entry(folder, (maps,))
    assert entry.problem == ""
    assert entry.case == strange


def test_a_corpus_that_is_a_link_to_nothing_is_one_error(tmp_path: Path) -> None:
    (tmp_path / "regressions").symlink_to("gone")
    with pytest.raises(CorpusError, match="regressions: found a symbolic link that leads nowhere"):
        every_entry(tmp_path / "regressions", ())
    with pytest.raises(CorpusError, match="regressions: found a symbolic link that leads nowhere"):
        entries(tmp_path / "regressions", SYSTEM, ())


def test_a_long_signature_makes_no_file_name_that_is_too_long(tmp_path: Path) -> None:
    strange = case(signature=f"own:test_{'x' * 400}:12345678")
    path = save(tmp_path, strange)
    assert path is not None
    assert len(path.name) < 100
    assert load(path) == strange


def test_a_link_to_a_file_beside_the_cases_is_no_lost_case(tmp_path: Path) -> None:
    _folder(tmp_path)
    (tmp_path / "notes.txt").write_text("")
    (tmp_path / "link").symlink_to("notes.txt")
    assert [entry.name for entry in every_entry(tmp_path, ())] == ["good"]
