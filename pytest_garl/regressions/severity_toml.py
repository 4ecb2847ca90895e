"""The section of a case file that says what the violation takes."""

from __future__ import annotations

from pytest_garl.execution.severity import NO_SEVERITY, Severity
from pytest_garl.files.toml import Table, quoted
from pytest_garl.scenarios.story import GRADES
from pytest_garl.verdicts.verdict import LONGEST_S

MOST_OBJECTS = 1000
FASTEST_MPS = 1000.0
"""More is no object of a map, and no speed of a body."""
_OF_BODY = {"grade", "type", "objects", "interference_s", "speed_mps", "window_s", "untried"}
_OF_CONDITIONS = {"conditions", "values", "largest", "largest_share", "unread", "untried"}
_OF_SHRUNK = {
    "body": "# The adversary that it takes; the weaker, the worse.",
    "conditions": "# The conditions that it takes; the fewer, the worse.",
}
_NOT_SHRUNK = "# Unusual in the flight that was found; the case is not shrunk."


def severity_lines(severity: Severity, *, is_shrunk: bool) -> list[list[str]]:
    """Return the section, in a list of one; an empty list for an empty severity."""
    untried = _names("untried", severity.untried)
    comment = _OF_SHRUNK.get(severity.about, "") if is_shrunk else _NOT_SHRUNK
    if severity.about == "body":
        window_s = severity.window_s
        return [
            [
                comment,
                "[severity]",
                *([f"grade = {quoted(severity.grade)}"] if severity.grade else []),
                f"type = {quoted(severity.type)}",
                f"objects = {severity.objects}",
                f"interference_s = {severity.interference_s!r}",
                f"speed_mps = {severity.speed_mps!r}",
                *([] if window_s is None else [f"window_s = {window_s!r}  # of its entry"]),
                *untried,
            ]
        ]
    if severity.about == "conditions":
        names, values = (
            ", ".join(quoted(each) for each in texts)
            for texts in (severity.conditions, severity.values)
        )
        return [
            [
                comment,
                "[severity]",
                f"conditions = [{names}]",
                *([f"values = [{values}]"] if severity.values else []),
                f"largest = {quoted(severity.largest)}",
                f"largest_share = {severity.largest_share!r}",
                *_names("unread", severity.unread),
                *untried,
            ]
        ]
    return []


def _names(key: str, names: tuple[str, ...]) -> list[str]:
    return [f"{key} = [{', '.join(quoted(each) for each in names)}]"] if names else []


def _read_names(table: Table, key: str) -> tuple[str, ...]:
    return tuple(table.strings(key)) if key in table.values else ()


def read_severity(top: Table) -> Severity:
    """Return the severity in a document, empty without one; raise ScenarioError for a wrong key."""
    if "severity" not in top.values:
        return NO_SEVERITY
    table = top.table("severity")
    if "conditions" in table.values:
        table.refuse_unknown(_OF_CONDITIONS)
        conditions = tuple(table.strings("conditions"))
        values = _read_names(table, "values")
        if values and len(values) != len(conditions):
            expected = f"one text for each of {len(conditions)} conditions"
            raise table.error("values", f"found {len(values)} texts, expected {expected}")
        return Severity(
            about="conditions",
            conditions=conditions,
            values=values,
            largest=table.string("largest"),
            largest_share=table.number("largest_share", low=0.0, high=1.0),
            unread=_read_names(table, "unread"),
            untried=_read_names(table, "untried"),
        )
    table.refuse_unknown(_OF_BODY)
    return Severity(
        about="body",
        grade=table.string("grade", allowed=GRADES) if "grade" in table.values else "",
        type=table.string("type"),
        objects=table.integer("objects", high=MOST_OBJECTS),
        interference_s=table.number("interference_s", low=0.0, high=LONGEST_S),
        speed_mps=table.number("speed_mps", low=0.0, high=FASTEST_MPS),
        window_s=table.number("window_s", low=0.0, high=LONGEST_S)
        if "window_s" in table.values
        else None,
        untried=_read_names(table, "untried"),
    )
