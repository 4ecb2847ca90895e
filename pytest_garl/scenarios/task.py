"""The task of a flight as its user states it: which marker lies there, and where the UAV starts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, get_args

from pytest_garl.errors import ScenarioError, of_a_user
from pytest_garl.fiducial import MarkerSpec, NestedMarker
from pytest_garl.files.user_files import Table, finite, quoted
from pytest_garl.messages import shown

__tracebackhide__ = of_a_user
StartMode = Literal["ground", "hover", "hold"]
START_HEIGHT_M = (2.0, 100.0)
"""Lowest and highest start in the air: above a take-off, below what the camera draws."""
START_OFFSET_M = 30.0
HOLD_S = 30.0
"""How long a UAV holds its place, for that mode: MM-MLS confirms a marker and plans within two
seconds, and people, dogs and birds come, stay and leave in this time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Where the flight begins: motors off on the ground at home, or hovering near the marker.

    With ``hold`` the UAV hovers and stays there: what the landing system commands is recorded and
    not flown, and its plans are judged (the paper's research question 3).  ``height_m`` and
    ``offset_m`` (x, y, from the mission's coordinate) count for ``hover`` and ``hold`` only.
    Raises ScenarioError for another mode, or a place that cannot be flown from.
    """

    mode: StartMode = "ground"
    height_m: float = 10.0
    offset_m: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.mode not in get_args(StartMode):
            raise ScenarioError(
                f"start: found mode = {shown(self.mode)}, expected 'ground', 'hover' or 'hold'"
            )
        low, high = START_HEIGHT_M
        height = finite(self.height_m)
        if height is None or not low <= height <= high:
            raise ScenarioError(
                f"start: found height_m = {shown(self.height_m)}, expected {low:g} to {high:g} m"
            )
        offset = [finite(each) for each in self.offset_m]
        near = [each for each in offset if each is not None and abs(each) <= START_OFFSET_M]
        if len(offset) != 2 or len(near) != 2:
            raise ScenarioError(
                f"start: found offset_m = {shown(self.offset_m)}, expected (x, y) within "
                f"{START_OFFSET_M:g} m of the told coordinate"
            )

    @property
    def hovers(self) -> bool:
        """Whether the flight begins in the air."""
        return self.mode != "ground"

    @property
    def holds(self) -> bool:
        """Whether the UAV stays at its start, whatever the landing system commands."""
        return self.mode == "hold"


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """What stays the same in all flights of a test: the marker and the start."""

    marker: MarkerSpec = field(default_factory=MarkerSpec)
    start: Start = field(default_factory=Start)


DEFAULT_TASK = Task()
"""The paper's marker, and a start from the ground."""


def task_lines(task: Task, above: str = "") -> list[str]:
    """Return the lines of a file that state what of a task is not the default.

    ``above`` is the path of the table that holds them, such as ``set.``.
    """
    lines: list[str] = []
    marker, start = task.marker, task.start
    if marker != DEFAULT_TASK.marker:
        lines += ["", f"[{above}task.marker]", *_spec_lines(marker)]
        if marker.nested:
            lines.append(f"nested = [{', '.join(_nested_text(each) for each in marker.nested)}]")
    if start != DEFAULT_TASK.start:
        x, y = start.offset_m
        lines += ["", f"[{above}task.start]", f"mode = {quoted(start.mode)}"]
        lines += [f"height_m = {start.height_m!r}", f"offset_m = [{x!r}, {y!r}]"]
    return lines


def _spec_lines(marker: MarkerSpec) -> list[str]:
    return [
        f"dictionary = {quoted(marker.dictionary)}",
        f"id = {marker.id}",
        f"side_m = {marker.side_m!r}",
    ]


def _nested_text(marker: NestedMarker) -> str:
    x, y = marker.offset_m
    return f"{{ id = {marker.id}, side_m = {marker.side_m!r}, offset_m = [{x!r}, {y!r}] }}"


def read_task(top: Table) -> Task:
    """Return the task in a document's table ``task``; what it does not state is the default.

    Raises ScenarioError that names source and key.
    """
    if "task" not in top.values:
        return DEFAULT_TASK
    table = top.table("task")
    table.refuse_unknown({"marker", "start"})
    return Task(marker=read_marker_spec(table), start=_read_start(table))


def read_marker_spec(top: Table) -> MarkerSpec:
    """Return the marker in a document's table ``marker``, the default one if there is none.

    Raises ScenarioError that names source and key.
    """
    if "marker" not in top.values:
        return DEFAULT_TASK.marker
    table = top.table("marker")
    table.refuse_unknown({"dictionary", "id", "side_m", "nested"})
    default = DEFAULT_TASK.marker
    dictionary = table.string("dictionary", default.dictionary)
    number = table.integer("id", default.id)
    side_m = table.number("side_m", default.side_m)
    nested = tuple(_read_nested(each) for each in table.tables("nested"))
    try:
        return MarkerSpec(dictionary=dictionary, id=number, side_m=side_m, nested=nested)
    except ScenarioError as error:
        raise top.error("marker", str(error)) from error


def _read_nested(table: Table) -> NestedMarker:
    table.refuse_unknown({"id", "side_m", "offset_m"})
    x, y = table.numbers("offset_m", 2, (0.0, 0.0))
    return NestedMarker(id=table.integer("id"), side_m=table.number("side_m"), offset_m=(x, y))


def _read_start(top: Table) -> Start:
    if "start" not in top.values:
        return DEFAULT_TASK.start
    table = top.table("start")
    table.refuse_unknown({"mode", "height_m", "offset_m"})
    default = DEFAULT_TASK.start
    mode, height_m = table.string("mode", default.mode), table.number("height_m", default.height_m)
    x, y = table.numbers("offset_m", 2, default.offset_m)
    try:
        return Start(mode=mode, height_m=height_m, offset_m=(x, y))  # type: ignore[arg-type]
    except ScenarioError as error:
        raise top.error("start", str(error)) from error
