"""Checks whether a session is comparable with a baseline, and lists changes of the environment."""

from __future__ import annotations

from pytest_garl.execution.job import FlightJob
from pytest_garl.fiducial import MarkerSpec
from pytest_garl.flight.flight import version_of
from pytest_garl.gate.baseline_file import Baseline, BaselineSet
from pytest_garl.scenarios.task import Task
from pytest_garl.verdicts.wording import limits_text


def incompatibilities(base: BaselineSet, job: FlightJob, task: Task) -> tuple[str, ...]:
    """Return the conditions that differ from the set's; rates are comparable if there are none."""
    conditions = (
        ("limits", limits_text(base.limits), limits_text(job.limits)),
        *_task_conditions(base.task, task),
        (f"map {base.map}", base.map_sha256[:12], job.map_sha256[:12]),
        ("simulator", base.simulator, job.simulator.name),
        (f"weights of {base.npcs}", base.npcs_sha256[:12], job.npcs.sha256[:12]),
    )
    return tuple(
        f"{what}: saved with {saved}, found {found}"
        for what, saved, found in conditions
        if saved != found
    )


def _task_conditions(saved: Task, found: Task) -> tuple[tuple[str, str, str], ...]:
    return (
        ("marker", _marker_text(saved.marker), _marker_text(found.marker)),
        ("start", repr(saved.start), repr(found.start)),
    )


def _marker_text(marker: MarkerSpec) -> str:
    nested = f", nested {marker.nested}" if marker.nested else ""
    return f"{marker.dictionary} id {marker.id} of {marker.side_m:g} m{nested}"


def environment_changes(base: Baseline) -> tuple[str, ...]:
    """Return changes of the CPU class and of packages since the baseline was saved."""
    from pytest_garl.cpu_dispatch import cpu_class_of_flights

    cpu = cpu_class_of_flights()
    changes = [] if base.cpu == cpu else [f"the CPU was {base.cpu}, is {cpu}"]
    for name, saved in base.versions:
        present = version_of(name)
        if saved != present:
            changes.append(f"{name} was {saved}, is {present}")
    return tuple(changes)
