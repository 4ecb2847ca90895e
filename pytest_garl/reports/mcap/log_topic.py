"""The topic ``/events``: what happened, and what the landing system said of itself, as a log."""

from __future__ import annotations

import re
from collections.abc import Iterator

from foxglove.messages import Log, LogLevel

from pytest_garl.flight.flight import Flight
from pytest_garl.messages import shortened
from pytest_garl.reports.mcap.export import Export, Place
from pytest_garl.reports.mcap.values import Logged, ns, stamp
from pytest_garl.verdicts.verdict import Verdict

TOPIC = "/events"
SIMULATOR, SYSTEM, VERDICT = "simulator", "landing system", "verdict"
MOST_CHARS = 1000
_LEVELS = {
    "crashed": LogLevel.Error,
    "close_failed": LogLevel.Error,
    "gave_up": LogLevel.Warning,
    "time_out": LogLevel.Warning,
    "abort_command": LogLevel.Warning,
}
_FOLDERS = re.compile(r"(?<![\w.:/])(?:~|[A-Za-z]:)?[/\\](?:[^\s/\\'\":]+[/\\])+")
"""The folders of a path that begins at a root: messages of exceptions may hold some."""


def events(export: Export, verdict: Verdict) -> Iterator[Logged]:
    """Yield what is flown, all events and the system's own words in order, and the verdict."""
    flight, end_ns = export.flight, ns(export.flight.elapsed_s)
    for text in _introduction(export):
        yield _logged(0, LogLevel.Info, SIMULATOR, text)
    told = [*_happened(flight), *_said(flight)]
    told += [
        (ns(found.time_s), LogLevel.Warning, VERDICT, f"{found.signature}: {found.story}")
        for found in verdict.findings
    ]
    for each in sorted(told, key=lambda each: each[0]):
        yield _logged(*each)
    # What a test of the user's own asserts has no verdict; its signature comes from the run.
    signature = export.signature or verdict.signature
    level = LogLevel.Error if signature else LogLevel.Info
    yield _logged(end_ns, level, VERDICT, f"{signature or 'no violation'}: {verdict.story}")


def _introduction(export: Export) -> Iterator[str]:
    versions = ", ".join(f"{name} {number}" for name, number in export.flight.versions)
    yield f"flight {export.name}{f', flown with {versions}' if versions else ''}"
    place = export.place
    if place is not None and (error := place.placed.scenario["camera.calibration_error_percent"]):
        yield (
            f"the camera's focal length differs by {error:+.1f} % from the one that the landing "
            "system was told; /camera/calibration has the true one"
        )
    if place is not None and _is_turned(place):
        yield "the camera is turned against the UAV; /tf has its true attitude"


def _is_turned(place: Place) -> bool:
    return any(
        place.placed.scenario[f"camera.mounting_{axis}_deg"] for axis in ("roll", "pitch", "yaw")
    )


def _happened(flight: Flight) -> Iterator[tuple[int, LogLevel, str, str]]:
    # Feet touch the ground in each landing; the last contact of a collision ended the flight.
    hit_s = flight.contacts[-1].time_s if flight.outcome == "collision" else None
    for event in flight.events:
        # The system's phases are logged with its notes below.
        if event.name != "phase":
            level = _LEVELS.get(event.name, LogLevel.Info)
            if event.name == "contact" and event.time_s == hit_s:
                level = LogLevel.Error
            yield ns(event.time_s), level, SIMULATOR, f"{event.name}: {event.text}"


def _said(flight: Flight) -> Iterator[tuple[int, LogLevel, str, str]]:
    """Yield the system's phase and note whenever they change."""
    phase = note = ""
    for step in flight.steps:
        said = step.diagnostics
        if said is None:
            continue
        if said.phase and said.phase != phase:
            yield ns(step.time_s), LogLevel.Info, SYSTEM, f"phase {said.phase}"
        if said.note and said.note != note:
            yield ns(step.time_s), LogLevel.Debug, SYSTEM, said.note
        phase, note = said.phase, said.note


def _logged(time_ns: int, level: LogLevel, name: str, text: str) -> Logged:
    words = shortened(without_folders(text), MOST_CHARS)
    message = Log(timestamp=stamp(time_ns), level=level, name=name, message=words)
    return Logged(time_ns=time_ns, topic=TOPIC, message=message)


def without_folders(text: str) -> str:
    """Return a text with the names of files but not of their folders, which may name a user."""
    return _FOLDERS.sub("", text)
