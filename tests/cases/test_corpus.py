"""The folder of saved cases: listed, saved into, with broken files and links."""

from __future__ import annotations

import dataclasses
import os
import subprocess
from pathlib import Path

import pytest

from pytest_garl.cases.case import Case, NoGateReason, Status
from pytest_garl.cases.case_file import dump_case, load_case
from pytest_garl.cases.corpus import Corpus, patch_of, read_acceptance, replace_file
from pytest_garl.errors import CorpusError
from pytest_garl.files import user_files
from pytest_garl.scenarios.maps import map as package
from pytest_garl.scenarios.maps.loading import load_map
from pytest_garl.scenarios.scenario import Scenario
from tests.cases.samples import OBJECT_NAMES, SYSTEM, case

TEXT = dump_case(case())


def test_corpus_saves_one_file_per_failure(tmp_path: Path) -> None:
    path = Corpus(tmp_path).save(case())
    assert path == tmp_path / "landing" / f"{case().id}.toml"
    assert Corpus(tmp_path).save(case(description="Another flight, the same signature.")) is None
    assert Corpus(tmp_path).save(case(signature="IV:dog:descent:seen")) is not None
    assert len(Corpus(tmp_path).all_entries()) == 2


def test_corpus_saves_a_fixed_failure_again(tmp_path: Path) -> None:
    path = Corpus(tmp_path).save(case())
    assert path is not None
    replace_file(path, dataclasses.replace(case(), status="fixed"))
    again = dataclasses.replace(case(), policy="greedy", moves=((OBJECT_NAMES[-1], ()),))
    assert Corpus(tmp_path).save(again) is not None
    found = Corpus(tmp_path).entries(SYSTEM)
    assert sorted(each.case.status for each in found if each.case) == ["fixed", "open"]


def test_new_corpus_reads_a_changed_file(tmp_path: Path) -> None:
    path = Corpus(tmp_path).save(case())
    assert path is not None
    assert Corpus(tmp_path).entries(SYSTEM)[0].case == case()
    path.write_text("schema = ")
    assert "not valid TOML" in Corpus(tmp_path).entries(SYSTEM)[0].problem


def test_patch_creates_the_file(tmp_path: Path) -> None:
    patch = patch_of(tmp_path / "scenarios" / "a.toml", tmp_path, "one\ntwo\n")
    assert patch.splitlines()[:2] == [
        "diff --git a/scenarios/a.toml b/scenarios/a.toml",
        "new file mode 100644",
    ]
    assert patch.endswith("@@ -0,0 +1,2 @@\n+one\n+two\n")


def test_corpus_reads_each_file_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Corpus(tmp_path).save(case())
    corpus, read = Corpus(tmp_path), []
    real = user_files.read_text

    def counted(path: Path) -> str:
        read.append(path.name)
        return real(path)

    for module in ("case_header", "case_file"):
        monkeypatch.setattr(f"pytest_garl.cases.{module}.read_text", counted)
    for _ in range(3):
        assert corpus.entries(SYSTEM)[0].case == case()
        assert [*corpus.expected_signatures(SYSTEM, "lawn")] == [case().violation.signature]
    # The header, to collect the case, and then all of it.
    assert len(read) == 2


def test_open_case_expects_its_signature_on_its_map(tmp_path: Path) -> None:
    corpus = Corpus(tmp_path)
    path = corpus.save(case())
    assert path is not None
    ((signature, entry),) = corpus.expected_signatures(SYSTEM, "lawn").items()
    assert (signature, entry.path) == (case().violation.signature, path)
    assert corpus.expected_signatures(SYSTEM, "court") == {}
    assert corpus.expected_signatures("stack.landing:Other", "lawn") == {}
    assert corpus.expected_signatures(SYSTEM, "lawn", accepted=True) == {}
    replace_file(path, dataclasses.replace(case(), accepted=True))
    assert [*Corpus(tmp_path).expected_signatures(SYSTEM, "lawn", accepted=True)] == [signature]


@pytest.mark.parametrize(
    ("status", "reason"),
    [("fixed", ""), ("open", "edge"), ("open", "sensor-limited"), ("open", "unpreventable")],
)
def test_cases_that_are_fixed_or_gate_nothing_expect_no_signature(
    tmp_path: Path, status: Status, reason: NoGateReason
) -> None:
    corpus = Corpus(tmp_path)
    corpus.save(dataclasses.replace(case(), status=status, reason=reason))
    assert corpus.expected_signatures(SYSTEM, "lawn") == {}


def test_robust_case_is_saved_beside_one_on_an_edge_and_a_second_one_on_an_edge_is_not(
    tmp_path: Path,
) -> None:
    corpus = Corpus(tmp_path)
    edge = dataclasses.replace(case(), reason="edge")
    other_moves = dataclasses.replace(edge, moves=((edge.moves[0][0], ((0.1, 0.0),)),))
    assert corpus.save(edge) is not None
    assert corpus.save(other_moves) is None
    robust = dataclasses.replace(other_moves, reason="")
    assert corpus.save(robust) is not None
    assert [*corpus.expected_signatures(SYSTEM, "lawn")] == [robust.violation.signature]
    assert corpus.save(dataclasses.replace(robust, moves=())) is None


@pytest.mark.parametrize("reason", ["", "sensor-limited"])
def test_a_case_that_is_not_shrunk_is_saved_unless_it_has_all_that_a_shrunk_one_takes(
    tmp_path: Path, reason: NoGateReason
) -> None:
    corpus, signature = Corpus(tmp_path), "II:never-seen"
    nominal = dataclasses.replace(case(signature), reason=reason)
    foggy = dataclasses.replace(nominal, scenario=in_weather({"environment.fog": 0.5}))
    assert foggy.is_shrunk
    path = corpus.save(foggy)
    assert path is not None

    def as_found(weather: dict[str, float]) -> Case:
        evidence = dataclasses.replace(case().evidence, neighbours=0, neighbours_failed=0)
        return dataclasses.replace(nominal, scenario=in_weather(weather), evidence=evidence)

    assert corpus.save(as_found({"environment.fog": 0.4, "environment.dust": 0.5})) is None
    assert corpus.save(as_found({"environment.dust": 0.5})) is not None
    replace_file(path, dataclasses.replace(foggy, status="fixed"))
    assert Corpus(tmp_path).save(as_found({"environment.fog": 0.4})) is not None


def in_weather(values: dict[str, float]) -> Scenario:
    weather = {key: 0.0 for key, _ in case().scenario.genes if key.startswith("environment.")}
    return case().scenario.replace(weather | values)


def test_save_sees_cases_of_other_processes(tmp_path: Path) -> None:
    corpus = Corpus(tmp_path)
    assert corpus.entries(SYSTEM) == ()
    Corpus(tmp_path).save(case())
    assert corpus.save(case(description="Another flight, the same signature.")) is None


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
def test_file_that_cannot_be_parsed_is_a_problem_of_its_entry(tmp_path: Path, text: str) -> None:
    folder = _folder(tmp_path)
    (folder / "bad.toml").write_text(text)
    bad, good = Corpus(tmp_path).entries(SYSTEM)
    assert bad.header is None
    assert bad.problem.startswith(f"{folder / 'bad.toml'}: ")
    assert len(bad.problem) < 300
    assert good.case == case()


def test_file_that_is_not_regular_is_a_problem_of_its_entry(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    (folder / "device.toml").symlink_to("/dev/zero")
    os.mkfifo(folder / "pipe.toml")
    (folder / "sub.toml").mkdir()
    found = {entry.name: entry.problem for entry in Corpus(tmp_path).all_entries()}
    assert "found a device, expected a regular file" in found["device"]
    assert "found a pipe, expected a regular file" in found["pipe"]
    assert "found a folder, expected a regular file" in found["sub"]
    assert found["good"] == ""


def test_dangling_link_is_a_problem_of_its_entry(tmp_path: Path) -> None:
    folder = _folder(tmp_path)
    (folder / "lost.toml").symlink_to("gone.toml")
    (folder / "round.toml").symlink_to("round.toml")
    for found in (Corpus(tmp_path).entries(SYSTEM), Corpus(tmp_path).all_entries()):
        problems = {entry.name: entry.problem for entry in found}
        assert "found a symbolic link that leads nowhere (No such file" in problems["lost"]
        assert "found a symbolic link that leads nowhere (Too many" in problems["round"]
        assert problems["good"] == ""


@pytest.mark.parametrize("target", ["elsewhere", "landing", "landing/round.toml"])
def test_dangling_folder_is_one_problem(tmp_path: Path, target: str) -> None:
    (tmp_path / "landing").symlink_to(target)
    for found in (Corpus(tmp_path).entries(SYSTEM), Corpus(tmp_path).all_entries()):
        (entry,) = found
        assert entry.case is None
        assert "found a symbolic link that leads nowhere" in entry.problem


def test_unreadable_corpus_raises_one_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(self: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(CorpusError, match=r"cannot be read: Permission denied; .*key garl_cases"):
        Corpus(tmp_path).all_entries()


@pytest.mark.parametrize("name", ['la"wn', "la\\wn", "la wn", "ländle", "a'b;c$d", "-m", "m" * 50])
def test_patch_applies_for_maps_with_strange_names(tmp_path: Path, name: str) -> None:
    maps = tmp_path / "scenarios" / "maps"
    maps.mkdir(parents=True)
    (maps / f"{name}.toml").write_text((Path(package.__file__).parent / "lawn.toml").read_text())
    plain = case()
    strange = dataclasses.replace(
        plain, scenario=dataclasses.replace(plain.scenario, map=load_map(name, [maps]).name)
    )
    corpus = Corpus(tmp_path / "cases", (maps,))
    patch = corpus.save_patch(strange, tmp_path / "patches", tmp_path)
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    subprocess.run(["git", "apply", str(patch)], cwd=tmp_path, check=True)
    (entry,) = corpus.all_entries()
    assert entry.problem == ""
    assert entry.case == strange


def test_no_patch_is_written_for_a_corpus_outside_of_the_project(tmp_path: Path) -> None:
    corpus = Corpus(tmp_path / "cases")
    with pytest.raises(CorpusError, match=r"expected a folder in the project .*garl_cases"):
        corpus.save_patch(case(), tmp_path / "patches", tmp_path / "project")
    assert not (tmp_path / "patches").exists()


def test_dangling_corpus_raises_one_error(tmp_path: Path) -> None:
    (tmp_path / "regressions").symlink_to("gone")
    with pytest.raises(CorpusError, match="regressions: found a symbolic link that leads nowhere"):
        Corpus(tmp_path / "regressions").all_entries()
    with pytest.raises(CorpusError, match="regressions: found a symbolic link that leads nowhere"):
        Corpus(tmp_path / "regressions").entries(SYSTEM)


def test_long_signature_gives_a_short_file_name(tmp_path: Path) -> None:
    strange = case(signature=f"own:test_{'x' * 400}:12345678")
    path = Corpus(tmp_path).save(strange)
    assert path is not None
    assert len(path.name) < 100
    assert load_case(path) == strange


def test_link_to_another_file_is_ignored(tmp_path: Path) -> None:
    _folder(tmp_path)
    (tmp_path / "notes.txt").write_text("")
    (tmp_path / "link").symlink_to("notes.txt")
    assert [entry.name for entry in Corpus(tmp_path).all_entries()] == ["good"]


def test_cases_in_the_index_of_git_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "cases" / "landing" / "a.toml"
    file.parent.mkdir(parents=True)
    file.touch()
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    assert not read_acceptance(tmp_path / "cases").accepts(file, case())
    subprocess.run(["git", "add", str(file)], cwd=tmp_path, check=True)
    assert read_acceptance(tmp_path / "cases").accepts(file, case())
    assert not read_acceptance(tmp_path / "cases").accepts(file.with_name("b.toml"), case())


def test_marked_cases_are_accepted_without_git(tmp_path: Path) -> None:
    acceptance = read_acceptance(tmp_path)
    assert "not a git repository" in acceptance.problem
    assert not acceptance.accepts(tmp_path / "a.toml", case())
    marked = dataclasses.replace(case(), accepted=True)
    assert acceptance.accepts(tmp_path / "a.toml", marked)


def test_missing_git_is_the_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert read_acceptance(tmp_path).problem.startswith("git: No such file")
