"""The pages of kinds: which flight each shows, and what it says beside the flight."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from pytest_garl.cases.case import NO_GATE_TEXTS, Case
from pytest_garl.cases.story_text import grade_in_words
from pytest_garl.engine import engine_of
from pytest_garl.execution.ledger_queries import LedgerFlight
from pytest_garl.messages import command, shortened
from pytest_garl.reports.html.flight_tables import cut_text
from pytest_garl.reports.html.flight_task import FlightTask, ShownFlight, task_of
from pytest_garl.reports.html.naming import page_address, page_name, shown_file
from pytest_garl.reports.run_record import KindRecord, RunRecord, SavedCase, SearchRecord
from pytest_garl.reports.run_text import legend_of
from pytest_garl.scenarios.files import dump_scenario
from pytest_garl.verdicts.wording import headline

Fact = tuple[str, str]
MOST_TITLE = 220
"""Characters of a title: three lines; the description below says all."""
MOST_SLOTS = 60
"""Names of flights that a page lists; more are counted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KindPlan:
    """A page of a kind before its flight is worked out.

    ``found`` is the flight as the search found it if the page shows that of a saved case.
    """

    name: str
    search: SearchRecord
    kind: KindRecord
    task: FlightTask
    found: FlightTask | None

    @property
    def case(self) -> Case | None:
        """The saved case of the kind, None without one."""
        return self.saved.case if self.saved else None

    @property
    def saved(self) -> SavedCase | None:
        """The same with its file."""
        return self.kind.shown_case


@dataclass(frozen=True, slots=True, kw_only=True)
class KindPage:
    """What a page of a kind says.

    ``title`` is the cause of the kind and ``ending`` how the flight ended; without a known cause
    the ending is the title, and ``ending`` is empty.  ``facts`` are (label, text); ``commands``
    repeat the flight; ``other`` is the page with the flight as found, or that of the case: (text,
    address).
    """

    name: str
    title: str
    ending: str
    signature: str
    meaning: str
    where: str
    description: str
    subject: str
    facts: tuple[Fact, ...]
    commands: tuple[Fact, ...]
    slots: tuple[str, ...]
    more_slots: int
    origin: tuple[Fact, ...]
    other: Fact | None
    flight: ShownFlight

    @property
    def address(self) -> str:
        """Where the page lies in the folder of a report."""
        return page_address(self.name)


def plan_kinds(run: RunRecord, films: int) -> list[KindPlan]:
    """Return the pages of a run, search by search; the most frequent kinds have a film."""
    kinds = [(search, kind) for search in run.searches for kind in search.kinds]
    frequent = sorted(range(len(kinds)), key=lambda number: -kinds[number][1].count)
    filmed = {*frequent[:films]}
    plans = []
    for number, (search, kind) in enumerate(kinds):
        as_found = _task(run, search, search.by_slot[kind.first])
        task = _case_task(run, search, kind.shown_case) or as_found
        task = dataclasses.replace(task, with_film=number in filmed)
        plans.append(
            KindPlan(
                name=page_name(search.key.system, search.key.map, search.name, kind.signature),
                search=search,
                kind=kind,
                task=task,
                found=as_found if task.sha256 != as_found.sha256 else None,
            )
        )
    return plans


def _task(run: RunRecord, search: SearchRecord, flight: LedgerFlight) -> FlightTask:
    return task_of(flight, run.jobs[flight.id.search], run.ledger, search.camera)


def _case_task(run: RunRecord, search: SearchRecord, saved: SavedCase | None) -> FlightTask | None:
    """Return the flight of a saved case; None if there is none in the run."""
    if saved is None or saved.flight is None:
        return None
    return dataclasses.replace(
        _task(run, search, saved.flight),
        name=saved.name,
        scenario=dump_scenario(saved.case.scenario),
        policy=saved.case.policy,
        prevention=saved.case.prevention,
    )


def kind_page(plan: KindPlan, flight: ShownFlight) -> KindPage:
    """Return the page of a kind."""
    case, is_case = plan.case, _shows_case(plan)
    story, description = plan.task.result.verdict.story, flight.description
    if plan.kind.type == "own":
        story = description = plan.kind.story
    if case is not None and is_case:
        description = case.violation.description
    other = (f"{plan.kind.first}, as the search found it", f"{found_name(plan)}.html")
    return _page(
        plan,
        flight,
        name=plan.name,
        story=story,
        description=description,
        subject=_subject(plan),
        facts=_facts(plan),
        other=other if plan.found else None,
        title=plan.kind.title,
    )


def found_page(plan: KindPlan, flight: ShownFlight) -> KindPage:
    """Return the page with the flight as the search found it, beside that of the case."""
    assert plan.found is not None
    return _page(
        plan,
        flight,
        name=found_name(plan),
        story=plan.found.result.verdict.story,
        description=flight.description,
        subject=f"{plan.kind.first}, as the search found it",
        facts=(_unusual(plan.found),),
        other=(_subject(plan), f"{plan.name}.html"),
    )


def found_name(plan: KindPlan) -> str:
    """Return the name of the page with the flight as found."""
    return f"{plan.name}-as-found"


def _page(
    plan: KindPlan,
    flight: ShownFlight,
    *,
    name: str,
    story: str,
    description: str,
    subject: str,
    facts: tuple[Fact, ...],
    other: Fact | None,
    title: str = "",
) -> KindPage:
    kind, search = plan.kind, plan.search
    ending = _capitalised(shortened(headline(story), MOST_TITLE))
    return KindPage(
        name=name,
        title=_capitalised(title) or ending,
        ending=ending if title else "",
        signature=kind.signature,
        meaning=legend_of([kind.signature]).get(kind.type, ""),
        where=search.name,
        description=cut_text(description),
        subject=subject,
        facts=tuple(fact for fact in facts if fact[1]),
        commands=_commands(plan),
        slots=kind.slots[:MOST_SLOTS],
        more_slots=max(0, len(kind.slots) - MOST_SLOTS),
        origin=_origin(plan, flight),
        other=other,
        flight=flight,
    )


def _shows_case(plan: KindPlan) -> bool:
    return plan.saved is not None and plan.task.name == plan.saved.name


def _subject(plan: KindPlan) -> str:
    """Return which flight the page of a kind shows."""
    if plan.case is None or not _shows_case(plan):
        return f"{plan.kind.first}, the first flight"
    return f"the {tag_of(plan.case)}"


def tag_of(case: Case) -> str:
    """Return that a case is saved, and whether it was shrunk; that of a crash has no severity."""
    if case.is_shrunk:
        return "saved case, shrunk"
    return "saved case, not shrunk" if case.severity.about else "saved case"


def _capitalised(text: str) -> str:
    return text[:1].upper() + text[1:]


def _unusual(task: FlightTask) -> Fact:
    """Return what was unusual in a flight of which nobody knows what it took."""
    severity = task.result.severity
    text = severity.unusual or "nothing" if severity and severity.about else ""
    return "Unusual in this flight", text


def _facts(plan: KindPlan) -> tuple[Fact, ...]:
    kind, search, case = plan.kind, plan.search, plan.case
    shown = case if _shows_case(plan) else None
    severity = shown.severity if shown else plan.task.result.severity
    shows_shrunk, whose = shown is not None and shown.is_shrunk, "" if shown else " (saved case)"
    took = "It took", severity.text if severity else ""
    label, text = took if shows_shrunk else _unusual(plan.task)
    means = grade_in_words(severity.grade) if severity and severity.grade else ""
    least, _, least_text = kind.least.partition(": ")
    is_told = shows_shrunk or kind.severest == plan.task.name
    seen = kind.seen_in_control
    flights = f"{kind.count} of {search.flown} flights"
    return (
        (label, f"{text} ({means})" if text and means else text),
        (_capitalised(least), "" if is_told else least_text),
        ("Found in", f"{flights}; {seen}" if seen else flights),
        (f"Robustness{whose}", case.robustness if case else ""),
        (f"Preventable?{whose}", case.prevention.text if case else ""),
        ("Why it gates nothing", NO_GATE_TEXTS[case.reason] if case and case.reason else ""),
        (f"Shrinking removed{whose}", case.removed if case and case.is_shrunk else ""),
        ("Saved case", _status(plan.saved) if plan.saved else "none in this project"),
    )


def _status(saved: SavedCase) -> str:
    if saved.case.status == "fixed":
        return "fixed: it must pass"
    if not saved.case.gates:
        return "known, gates nothing" if saved.known else "new, gates nothing"
    return "known: expected to fail until it is fixed" if saved.known else "new: fails the tests"


def _commands(plan: KindPlan) -> tuple[Fact, ...]:
    commands = [("the first flight, as found", plan.kind.repeat)]
    if plan.saved is not None:
        file = shown_file(plan.saved.path)
        commands.insert(0, ("the saved case", command("garl", "cases", "replay", file)))
    return tuple(commands)


def _origin(plan: KindPlan, flight: ShownFlight) -> tuple[Fact, ...]:
    """Return hashes and versions, so that the page can be traced to what flew."""
    job = plan.task.job
    rows = [
        ("landing system", job.system.name),
        ("landing system's sources, SHA-256", job.system_sha256),
        ("simulator", job.simulator.name),
        ("map, SHA-256", job.map_sha256),
        ("NPC policy", plan.task.policy),
        ("trajectory, SHA-256", flight.sha256),
        ("CPU class", flight.cpu),
        ("physics engine", engine_of(flight.versions) or ""),
        *flight.versions,
    ]
    return tuple((name, value) for name, value in rows if value)
