"""``garl cases``: show saved cases, fly them again, and delete stale ones."""

from __future__ import annotations

import dataclasses
import os
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click
from click.core import ParameterSource
from rich.console import Console
from rich.progress import Progress

from pytest_garl.cases.case import NO_GATE_TEXTS, Case, NoGateReason
from pytest_garl.cases.case_file import load_case
from pytest_garl.cases.corpus import Corpus, replace_file, rewrite_file
from pytest_garl.cases.description import unusual_in_flight
from pytest_garl.cases.reference_proofs import Proofs
from pytest_garl.cases.replay import Replay, replay
from pytest_garl.cases.story_text import grade_in_words
from pytest_garl.cli.case_tables import (
    case_table,
    environment_changes,
    print_table,
    renamed_table,
    scenario_table,
)
from pytest_garl.cli.pytest_settings import find_settings
from pytest_garl.cli.shared import FOLDER, say
from pytest_garl.errors import CorpusError, GarlError
from pytest_garl.files.run_files import RUN_FOLDER
from pytest_garl.messages import command, printable
from pytest_garl.shrinking.plan import FEWEST_FOR_SAVED_CASE

if TYPE_CHECKING:
    from pytest_garl.cases.renewal import Renewal
    from pytest_garl.plugin.items.project_collection import ProjectTests

NO_PROOF = 3
"""Exit status of a replay that proves nothing."""
EXIT_STATUS = {"FIXED": 0, "FAILED": 1, "STALE": NO_PROOF, "UNDECIDED": NO_PROOF}


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Project:
    root: Path
    corpus: Corpus
    named: bool
    """Whether the command line names the folder."""

    @property
    def maps(self) -> tuple[Path, ...]:
        return self.corpus.map_folders

    def case(self, file: Path) -> Case:
        return load_case(file, self.maps)

    def proved(self, case: Case) -> Case:
        """Return a case with the reference that the latest run here proved."""
        folder = str(find_settings(self.root).values.get("garl_dir") or RUN_FOLDER)
        return Proofs(self.root / folder).renewed(case)

    def collected(self) -> tuple[ProjectTests, Corpus]:
        """Return the landing tests, and the corpus that pytest flies, or that of ``--folder``."""
        from pytest_garl.plugin.items.project_collection import collect_project

        tests = collect_project(self.root, self.corpus.folder if self.named else None)
        folder = tests.cases
        if folder.is_relative_to(self.root):
            folder = folder.relative_to(self.root)
        return tests, Corpus(folder, self.maps)


@click.group()
@FOLDER
@click.pass_context
def cases(context: click.Context, folder: Path) -> None:
    """Show, replay and manage saved violations.

    A case is a file under scenarios/regressions/<module>/. Run these commands where you run pytest.
    """
    root = Path.cwd()
    named = context.get_parameter_source("folder") is ParameterSource.COMMANDLINE
    if named and not (folder.is_dir() or folder.is_symlink()):
        raise click.BadParameter(f"there is no folder {printable(str(folder))}", param=None)
    corpus = Corpus(folder, (root / "scenarios" / "maps",))
    context.obj = _Project(root=root, corpus=corpus, named=named)


FILE = click.argument("file", type=click.Path(path_type=Path, exists=True, dir_okay=False))
FILES = click.argument(
    "files",
    metavar="FILE...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
)


@cases.command("list")
@click.pass_obj
def list_(project: _Project) -> None:
    """List all cases.

    A row has status, signature, robustness and number of objects.
    """
    found = project.corpus.all_entries()
    if not found:
        say(f"no cases in {project.corpus.folder}; a search saves what it finds")
        return
    print_table(case_table(found))
    for entry in found:
        if entry.case is None:
            say(entry.problem)
    new = [
        str(entry.path)
        for entry in found
        if entry.case is not None
        and entry.case.status != "fixed"
        and not entry.case.edge
        and not project.corpus.is_accepted(entry)
    ]
    if new:
        say("\nNew, so that pytest fails on them until they are fixed, committed or accepted:")
        say("    garl cases accept " + " \\\n        ".join(command(each) for each in new))


@cases.command()
@FILE
@click.pass_obj
def show(project: _Project, file: Path) -> None:
    """Show what happens in a case, in words and units."""
    case = project.case(file)
    say(f"{case.id}  {case.status}  {case.system}")
    say(f"{case.violation.signature}: {case.violation.description}")
    if case.severity.about:
        means = grade_in_words(case.severity.grade)
        if case.is_shrunk:
            say(f"It takes {case.severity.text}{f' ({means})' if means else ''}.")
        else:
            say(f"Not shrunk: nobody knows what it takes. {unusual_in_flight(case.severity)}")
    say("")
    print_table(scenario_table(case, project.maps))
    for key, by in environment_changes(case):
        say(f"during the flight {key} changes by {by:+.2f}")
    if case.prevention.text:
        say(f"\n{case.prevention.text}.")
    if not case.gates:
        say(f"\nIt gates nothing: {NO_GATE_TEXTS[case.reason]}.")
    tried = f"{case.robustness}; " if case.robustness else ""
    moved = f"; the policy {case.policy} moved the objects" if case.moves else ""
    say(f"\n{tried}{case.shrinking}{moved}")
    say(f"Fly it: {command('garl', 'cases', 'replay', file)}")


@cases.command("replay")
@FILE
@click.option(
    "--live",
    is_flag=True,
    help="Let the NPC policy move the objects, instead of their recorded moves.",
)
@click.option(
    "--video",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the flight as an .mp4, or a small .gif: the camera's view beside a map (needs "
    "ffmpeg, or the extra: video).",
)
@click.pass_context
def replay_(context: click.Context, file: Path, live: bool, video: Path | None) -> None:
    """Fly a case again, and say if it is fixed.

    The answer is FIXED, FAILED, STALE or UNDECIDED (exit status 0, 1, 3, 3). The tests that found
    it judge: pytest flies this one case in a process of its own. If the case names no test, the
    built-in verdict judges.
    """
    project: _Project = context.obj
    case = project.case(file)
    if video is not None:
        from pytest_garl.reports.film.film_file import check_film_file

        # Checked before the flight, which takes longer.
        check_film_file(video, makes_folder=True)
    replayed = replay(project.proved(case), project.root, project.maps, live=live)
    _show_replay(replayed)
    if video is not None:
        from pytest_garl.cli.film_command import draw
        from pytest_garl.cli.named_flight import flown_again

        draw(flown_again(file, case, replayed, project.root, live=live), video)
        say(f"drawn: {video}")
    context.exit(EXIT_STATUS[replayed.result])


def _show_replay(replayed: Replay) -> None:
    click.secho(replayed.result, bold=True, fg="green" if replayed.result == "FIXED" else "red")
    say(f"{replayed.signature or 'no violation'}: {replayed.description}")
    for reason in replayed.reasons:
        say(reason)
    say(f"judged by {replayed.judged_by}")
    if replayed.same_flight is not None:
        same = replayed.same_flight
        say("the same flight to the byte" if same else "another flight than the recorded one")


@cases.command()
@FILES
@click.pass_obj
def accept(project: _Project, files: tuple[Path, ...]) -> None:
    """Make cases known: they may fail until they are fixed.

    Use it in a project without git. A committed case is known already.
    """
    found = [(file, project.case(file)) for file in files]
    for file, case in found:
        replace_file(file, dataclasses.replace(case, accepted=True), project.maps)
        say(f"{file}: accepted; it is expected to fail ({case.violation.signature})")


@cases.command()
@FILES
@click.pass_obj
def promote(project: _Project, files: tuple[Path, ...]) -> None:
    """Mark cases as fixed: from now on they must pass.

    The command flies each case first, with its recorded moves and, if an escape from a live policy
    exists, with that policy too. A case stays open if it fails, if the landing system gives up
    needlessly, if it is undecided, or if nothing shows that a repair of the landing system made it
    pass; the others are marked all the same.
    """
    refused = []
    for file, case in [(file, project.case(file)) for file in files]:
        try:
            remarks = _flown_as_fixed(project, file, case)
        except GarlError as error:
            refused.append(str(error))
            continue
        # A case that passes is not unpreventable.
        reason: NoGateReason = "edge" if case.edge else ""
        replace_file(file, dataclasses.replace(case, status="fixed", reason=reason), project.maps)
        for line in (f"{file}: fixed; from now on it must pass", *remarks):
            say(line)
    if refused:
        raise GarlError("\n".join(refused))


def _flown_as_fixed(project: _Project, file: Path, case: Case) -> list[str]:
    """Fly a case that is said to be fixed; return remarks, or raise GarlError if it is not."""
    remarks = []
    for live in (False, True) if case.live else (False,):
        replayed = replay(project.proved(case), project.root, project.maps, live=live)
        how = "a live policy" if live else "its recorded moves"
        if replayed.result != "FIXED":
            raise GarlError(f"{file}: {_refusal(replayed, how)}; it stays {case.status}")
        if replayed.outcome == "gave_up":
            remarks.append(f"with {how} the landing system gave up, which its limits allow")
        if not live:
            remarks.append(f"judged by {replayed.judged_by}")
    return remarks


def _refusal(replayed: Replay, how: str) -> str:
    if replayed.result == "FAILED":
        return f"still fails with {how} ({replayed.signature or '; '.join(replayed.reasons)})"
    state = "passes, but is stale" if replayed.result == "STALE" else "is not decided"
    return f"{state} with {how}: {'; '.join(replayed.reasons)}"


@cases.command()
@FILE
@click.option(
    "--flights",
    type=click.IntRange(min=FEWEST_FOR_SAVED_CASE),
    default=40,
    show_default=True,
    help="Maximal number of flights.",
)
@click.option("--workers", default=2, show_default=True, help="Number of worker processes.")
@click.option(
    "--as-it-fails",
    is_flag=True,
    help="If an open case fails in another way than the saved one: make it a case of that.",
)
@click.pass_obj
def shrink(project: _Project, file: Path, flights: int, workers: int, *, as_it_fails: bool) -> None:
    """Shrink a case further, from its own record.

    The command replaces the file only by a case that is no worse in any respect (objects, genes,
    moves, size, neighbours that fail) and better in at least one. The new file is named by what it
    holds, so it may have another name.
    """
    from pytest_garl.plugin.items.case_tests import case_setup
    from pytest_garl.shrinking.investigation import NOTHING_SIMPLER
    from pytest_garl.shrinking.reshrink import shrink_case

    case = project.case(file)
    if as_it_fails and (case.status != "open" or case.assertion):
        kind = "a fixed case must pass" if case.status != "open" else "an assertion judges it"
        raise GarlError(f"{file}: --as-it-fails is for an open case of the verdict: {kind}")
    setup = case_setup(case, project.root)
    say(f"{file}: shrinking, in at most {flights} flights", err=True)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("flights", total=flights)
        result = shrink_case(
            case,
            project.root,
            project.maps,
            flights,
            workers,
            setup,
            as_it_fails=as_it_fails,
            on_flown=lambda flown: progress.update(bar, completed=flown),
        )
    spent = f"{result.flights} flights"
    if result.case is None and result.reason != NOTHING_SIMPLER:
        replay = command("garl", "cases", "replay", file)
        raise GarlError(f"{file}: {result.reason}; `{replay}` shows how it ends")
    if result.case is None:
        say(f"{file}: {result.reason} ({spent}); it stays as it is")
        return
    path = replace_file(file, result.case, project.maps)
    if result.signature != case.ending:
        done = f"now a case of {result.signature}, which was one of {case.ending}"
    elif result.case.id == case.id:
        done = "its evidence is renewed"
    else:
        done = f"removed in all {result.case.removed}"
    say(f"{path}: {done} ({spent})")


@cases.command()
@click.argument(
    "files",
    metavar="[FILE]...",
    nargs=-1,
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
)
@click.option(
    "--workers",
    type=click.IntRange(min=0),
    default=lambda: os.cpu_count() or 1,
    show_default="one per CPU core",
    help="Number of worker processes.",
)
@click.pass_obj
def renew(project: _Project, files: tuple[Path, ...], workers: int) -> None:
    """Renew hashes and words of cases that fail as before.

    It flies all cases, or FILEs, with today's sources. Do that after an upgrade, before you repair
    your landing system: only then does a later pass count as a repair. If the flight is the
    recorded one, but today's version calls the violation something else, the file gets the new
    signature and name. A case whose flight differs stays as it is, and the exit status is 1.
    """
    from pytest_garl.cases.renewal import RenewalResult, renew

    tests, corpus = project.collected()
    if files:
        chosen = {file: project.case(file) for file in files}
    else:
        entries = corpus.all_entries()
        chosen = {entry.path: entry.case for entry in entries if entry.case is not None}
        for entry in entries:
            if entry.case is None:
                say(entry.problem, err=True)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        bar = progress.add_task("flights")
        done = renew(
            chosen,
            tests.collection,
            tests.simulator,
            project.maps,
            workers,
            lambda flown, total: progress.update(bar, completed=flown, total=total),
        )
    done = [_written(each, project.maps) for each in done]
    renamed = [each for each in done if each.result == "renamed"]
    if renamed:
        print_table(renamed_table(renamed))
    refused = [each for each in done if each.result == "not renewed"]
    for each in refused:
        say(f"{each.path}: {each.reason}", err=True)
    counts = Counter(each.result for each in done)
    names = [name for name in get_args(RenewalResult) if counts[name]]
    say(f"{len(done)} cases: {', '.join(f'{counts[name]} {name}' for name in names) or 'none'}")
    if renamed:
        say(f"git sees the new names after: {command('git', 'add', '-A', corpus.folder)}")
    if refused:
        raise SystemExit(1)


def _written(renewal: Renewal, map_folders: tuple[Path, ...]) -> Renewal:
    """Write a renewed case; return what became of it."""
    if renewal.case is None:
        return renewal
    try:
        path = rewrite_file(renewal.path, renewal.before, renewal.case, map_folders)
    except CorpusError as error:
        return dataclasses.replace(renewal, result="not renewed", reason=str(error), case=None)
    return dataclasses.replace(renewal, written=path)


@cases.command()
@click.option("--yes", is_flag=True, help="Delete without asking.")
@click.pass_obj
def prune(project: _Project, yes: bool) -> None:
    """Fly all cases that are not fixed; delete stale ones.

    A stale case passes, but nothing shows that the landing system was repaired (see the table in
    docs/cases.md). A case that fails, or is undecided, stays.
    """
    kept = 0
    for entry in project.corpus.all_entries():
        if entry.case is None or entry.case.status == "fixed":
            continue
        replayed = replay(project.proved(entry.case), project.root, project.maps)
        if replayed.result != "STALE":
            kept += 1
            continue
        say(f"{entry.path}: passes, but {'; '.join(replayed.reasons)}")
        if yes or click.confirm("delete it?"):
            entry.path.unlink()
    say(f"{kept} cases are not stale")


@cases.command()
@click.pass_obj
def check(project: _Project) -> None:
    """Check all files without flying.

    Each must be readable, named after its content, and flown by a test. pytest collects the test
    files of the project that have the marker, and those that cases name. A case that none of them
    flies is lost.
    """
    from pytest_garl.cases.census import census

    tests, corpus = project.collected()
    problems = [f"{file}: cannot be collected: {reason}" for file, reason in tests.broken]
    lost = {each.path: each.reason for each in census(corpus, tests.collection)}
    found = corpus.all_entries() if corpus.folder.is_dir() or corpus.folder.is_symlink() else ()
    for entry in found:
        case = entry.case
        if case is None:
            lost.pop(entry.path, None)
            problems.append(entry.problem)
            continue
        if entry.name != case.id:
            problems.append(
                f"{entry.path}: its content has the name {case.id}; it was changed by hand, or "
                "renamed"
            )
        test = project.root / case.test.partition("::")[0]
        if "::" in case.test and not test.is_file():
            problems.append(f"{entry.path}: key 'test': there is no file {test}")
    problems += [f"{path}: {reason}" for path, reason in lost.items()]
    for problem in problems:
        say(problem, err=True)
    say(f"{len(found)} cases, {len(problems)} problems")
    if problems:
        raise SystemExit(1)
