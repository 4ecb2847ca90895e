"""The keys of a case file's sections, a row for each: by it the key is written, read and described.

To add a key, add a row here, and its field to the dataclass of the section.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, fields
from typing import Any, Literal, get_args

from pytest_garl.cases.case import Escape, Preventable
from pytest_garl.engine import Engine
from pytest_garl.files.user_files import LARGEST_INTEGER, Table, quoted
from pytest_garl.messages import printable
from pytest_garl.scenarios.story import GRADES
from pytest_garl.verdicts.verdict import (
    FARTHEST_M,
    LONGEST_S,
    AbortRule,
    PropertyName,
    ViolationType,
)

_MOST_OBJECTS = 1000
_FASTEST_MPS = 1000.0
"""More is no object of a map, and no speed of a body."""


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a section.

    ``kind`` is the type of its value: str, float, int, bool, list (of texts) or dict (a table of
    texts); or it is a tuple of the allowed texts.  The section's dataclass holds the value in
    ``field``, by default in that of the key's name.  An ``optional`` key is left out of the file
    if its field has its default.

    An editor shows ``meaning``, or the ``comment`` without one.  The comment stands in the file
    behind the value, after the text of the field ``unit`` if that is given.

    A number is from ``low`` to ``high``.  The reader refuses one above ``guard`` as well; the
    schema does not say so, because no flight has such a value.
    """

    name: str
    kind: type | tuple[str, ...]
    meaning: str = ""
    _: KW_ONLY
    field: str = ""
    optional: bool = False
    comment: str = ""
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    guard: float = math.inf


Section = Sequence[Key]
_HASH = "a hash; `garl cases renew` writes it"
_BESIDE = "the marker lies beside the map's coordinate"
_UNTRIED = Key("untried", list, "conditions", optional=True)

VIOLATION: Section = (
    Key("signature", str, "type, cause, phase and sight"),
    Key("type", get_args(ViolationType), "the type of the violation"),
    Key("property", get_args(PropertyName), "the violated property"),
    Key("margin", float, comment="what is not above 0 is violated", unit="unit"),
    Key("unit", str, "unit of the margin"),
    Key("story", str, "what happened", field="description"),
)
WORST: Section = (
    Key(
        "worst_margin",
        float,
        comment="of the search; a worse one is not excused",
        field="margin",
        optional=True,
    ),
    Key(
        "weakest_grade", GRADES, "the weakest adversary of the search", field="grade", optional=True
    ),
)
"""They stand among the keys of the violation, if the case has a bound."""
SEVERITY: Mapping[Literal["body", "conditions"], Section] = {
    "body": (
        Key("grade", GRADES, "of the adversary that it takes", optional=True),
        Key("type", str, "of the body"),
        Key("objects", int, "how many", guard=_MOST_OBJECTS),
        Key("interference_s", float, "for how long it interferes", low=0, guard=LONGEST_S),
        Key("speed_mps", float, "how fast it is", low=0, guard=_FASTEST_MPS),
        Key("when", str, "whether it comes while the marker is covered", optional=True),
        Key("window_s", float, comment="of its entry", optional=True, low=0, guard=LONGEST_S),
        _UNTRIED,
    ),
    "conditions": (
        Key("conditions", list, "conditions"),
        Key("values", list, "conditions", optional=True),
        Key("largest", str, "the condition nearest to its limit"),
        Key("largest_share", float, "how near", low=0, high=1),
        Key("idle", list, "conditions", optional=True),
        Key("placed", bool, f"whether {_BESIDE}", comment=_BESIDE, optional=True),
        _UNTRIED,
    ),
}
"""The section has one of two shapes, by what the severity is about."""
PREVENTABLE: Section = (
    Key("answer", get_args(Preventable)[1:], "could it have been prevented?"),
    Key("inevitable_s", float, comment="from then on no escape exists", low=0, guard=LONGEST_S),
    Key(
        "observed_s",
        float,
        comment="the camera first showed the body well enough",
        optional=True,
        low=0,
        guard=LONGEST_S,
    ),
    Key(
        "escape",
        get_args(Escape),
        "how",
        comment="of a UAV that stands on the ground",
        optional=True,
    ),
)
LIMITS: Section = (
    Key(
        "distance_m", float, "how far from the marker's centre it may land", low=0, high=FARTHEST_M
    ),
    Key("time_s", float, "how long it may take", low=0, high=LONGEST_S),
    Key("abort", get_args(AbortRule), "when giving up is a violation"),
)
POLICY: Section = (
    Key("name", str, "who moved the NPCs", field="policy"),
    Key("sha256", str, "hash of its weights", field="policy_sha256"),
)
"""Its dataclass is the case."""
EVIDENCE: Section = (
    Key("trajectory_sha256", str, _HASH),
    Key("cpu", str, comment="class of CPUs on which the hash holds"),
    # Files that were written when there was one engine only have no such line.
    Key("engine", get_args(Engine), "that flew the reference; without it Bullet", optional=True),
    Key("map_sha256", str, _HASH),
    Key("neighbours", int, comment="slightly different scenarios flown"),
    Key("neighbours_failed", int, "how many of them failed"),
    Key("removed", str, "what shrinking removed"),
    Key("system_sha256", str, _HASH),
    Key("simulator_sha256", str, _HASH),
    Key("versions", dict),
)


def values_in(table: Table, section: Section, *, beside: Section = ()) -> dict[str, Any]:
    """Return the values in a table by the fields that hold them.

    Keys of another section may stand ``beside`` them.  Raises ScenarioError for any other key, a
    missing one, and a wrong value.
    """
    table.refuse_unknown([key.name for key in (*section, *beside)])
    return {
        key.field or key.name: _read(table, key)
        for key in section
        if not key.optional or key.name in table.values
    }


def lines_of(holder: Any, section: Section) -> list[str]:
    """Return a line for each key, with its value in a dataclass."""
    defaults = {each.name: each.default for each in fields(holder)}
    lines = []
    for key in section:
        name = key.field or key.name
        value = getattr(holder, name)
        if key.optional and value == defaults[name]:
            continue
        # A comment ends at a line's end, so that no text may bring one.
        unit = f"{printable(getattr(holder, key.unit), keep='')}; " if key.unit else ""
        comment = f"  # {unit}{key.comment}" if key.comment else ""
        lines.append(f"{key.name} = {_written(value)}{comment}")
    return lines


def _read(table: Table, key: Key) -> Any:
    if isinstance(key.kind, tuple):
        return table.string(key.name, allowed=key.kind)
    if key.kind is float:
        return table.number(key.name, low=key.low, high=min(key.high, key.guard))
    if key.kind is int:
        return table.integer(key.name, high=int(min(key.guard, LARGEST_INTEGER)))
    if key.kind is bool:
        return table.boolean(key.name, default=False)
    if key.kind is list:
        return table.strings(key.name)
    if key.kind is dict:
        texts = table.table(key.name)
        return tuple((name, texts.string(name)) for name in texts.values)
    return table.string(key.name)


def _written(value: str | float | bool | tuple[str, ...]) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return f"[{', '.join(quoted(each) for each in value)}]"
    return quoted(value) if isinstance(value, str) else repr(value)
