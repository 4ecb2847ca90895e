"""JSON schemas of the files that people write or read: cases, scenarios, domains, maps.

An editor completes keys by them, shows what a value means, and marks what is unknown.  They are
made from the tables by which the files are read.  What takes more than one value to tell, such as
whether a place lies on its map, only the readers know: they are stricter.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, get_args

from pytest_garl.cases.case import NoGateReason, Status
from pytest_garl.cases.case_header import SCHEMA as CASE_SCHEMA
from pytest_garl.cases.case_sections import (
    EVIDENCE,
    LIMITS,
    POLICY,
    PREVENTABLE,
    SEVERITY,
    VIOLATION,
    WORST,
    Key,
    Section,
)
from pytest_garl.execution.reference import SYSTEM_NAME
from pytest_garl.fiducial import DICTIONARIES, FARTHEST_M, MOST_NESTED, SIDE_M
from pytest_garl.scenarios.domains.domain import ABSENT, CONDITIONS
from pytest_garl.scenarios.domains.names import BUILT_IN
from pytest_garl.scenarios.files import SCHEMA as SCENARIO_SCHEMA
from pytest_garl.scenarios.genes import ENVIRONMENT, WeatherRange
from pytest_garl.scenarios.groups import GROUPS, WEATHER
from pytest_garl.scenarios.light import NOON_DEG, TWILIGHT_DEG
from pytest_garl.scenarios.maps.map import LayerKind, Texture
from pytest_garl.scenarios.object_types import BIRD_HEIGHTS_M, OBJECT_TYPES
from pytest_garl.scenarios.quantities import Quantity
from pytest_garl.scenarios.static_bodies import STATIC_BODIES
from pytest_garl.scenarios.story import GRADES, STORY
from pytest_garl.scenarios.task import START_HEIGHT_M, START_OFFSET_M, StartMode
from pytest_garl.scenarios.units import LIGHT, MOST_VISIBILITY_M

Schema = dict[str, Any]
DRAFT = "http://json-schema.org/draft-07/schema#"
"""The version that the editors' extensions know best."""
OBJECT_NAME = f"^({'|'.join(OBJECT_TYPES)})-[1-9][0-9]*$"
"""What stands in the world by its name, such as ``person-1``."""


def case_schema() -> Schema:
    """Return the schema of a saved case."""
    scenario = _scenario_properties()
    return _document(
        "A saved case of pytest-garl",
        {
            "schema": {"const": CASE_SCHEMA},
            "system": _text("module:class of the landing system", pattern=SYSTEM_NAME.pattern),
            "status": _one_of(get_args(Status), "open: expected to fail; fixed: must pass"),
            "accepted": _flag("a person looked at it: it is known before it is committed"),
            "gates": _flag("false: it fails no run"),
            "reason": _one_of(get_args(NoGateReason)[1:], "why it gates nothing"),
            "live": _flag("a repair must hold against a live policy too"),
            "test": _text("node id of the test that failed"),
            "assertion": _text("node id of the test whose assertion failed, if it is another one"),
            **scenario,
            "violation": _section([*VIOLATION, *WORST]),
            "severity": {
                "description": "what it takes",
                "anyOf": [_section(each) for each in SEVERITY.values()],
            },
            "preventable": _section(PREVENTABLE),
            "limits": _section(LIMITS),
            "policy": _section(POLICY),
            "moves": _objects(
                _list_of(
                    _row({"type": "integer", "minimum": 1}, _share(), _share()),
                    "[times, x, y], each for half a second",
                )
            ),
            "changes": _objects(
                _list_of(
                    _row(_whole(""), _one_of(ENVIRONMENT, ""), _number("")),
                    "[decision, gene, added to it]",
                )
            ),
            # The hashes first, and what may be absent last.
            "evidence": _section(
                sorted(EVIDENCE, key=lambda key: (key.optional, "sha256" not in key.name))
            ),
        },
        required=(
            *("schema", "system", "status", "map", "seed"),
            *("violation", "limits", "policy", "moves", "evidence"),
        ),
    ) | _either("scenario", "genes")


def scenario_schema() -> Schema:
    """Return the schema of a scenario file."""
    return _document(
        "A scenario of pytest-garl",
        {"schema": {"const": SCENARIO_SCHEMA}, **_scenario_properties()},
        required=("schema", "map", "seed"),
    ) | _either("scenario", "genes")


def domain_schema() -> Schema:
    """Return the schema of an operational domain."""
    sections: dict[str, dict[str, Schema]] = {}
    for key, quantity in CONDITIONS.items():
        head, _, name = key.partition(".")
        sections.setdefault(head, {})[name] = _range(quantity)
    grades = [ABSENT, *GRADES]
    return _document(
        "An operational domain of pytest-garl: the conditions in which a system is to land",
        {
            "extends": {
                "type": "string",
                "description": "the domain that this one changes: a built-in one, or a TOML file",
                "examples": [*BUILT_IN],
            },
            "npc_behaviour": {
                "description": "the strongest behaviour of people, dogs and birds, or a policy",
                "anyOf": [{"enum": grades}, {"type": "string"}],
            },
            "paper": _one_of(get_args(WeatherRange), "the weather of the paper's world"),
            **{
                head: {
                    "description": GROUPS[head].meaning if head in GROUPS else head,
                    "anyOf": [{"const": False}, _table(ranges)],
                }
                for head, ranges in sections.items()
            },
        },
    )


def map_schema() -> Schema:
    """Return the schema of a map."""
    return _document(
        "A map of pytest-garl: a place to land, in metres, x east and y north",
        {
            "title": _text("its name for people"),
            "bounds_m": _numbers(4, "x_min, x_max, y_min, y_max"),
            "gps_position_m": _numbers(2, "the middle of the disc in which the marker lies"),
            "uav_start_m": _numbers(3, "where the flight starts, z = 0"),
            "ground": _table(
                {
                    "texture": _one_of(get_args(Texture), "what the ground is"),
                    "seed": _whole("of the texture"),
                    "colour": _colour(),
                },
                required=("texture", "seed", "colour"),
            ),
            "objects": _table({name: _whole(f"how many: {name}") for name in OBJECT_TYPES}),
            "marker": _marker(),
            "layers": _list_of(_layer(), "what is painted on the ground, one over the other"),
            "bodies": _list_of(
                {"anyOf": [_body(kind, build) for kind, build in STATIC_BODIES.items()]},
                "what stands there",
            ),
        },
        required=("bounds_m", "uav_start_m", "ground"),
    )


SCHEMAS: Mapping[str, Callable[[], Schema]] = {
    "case": case_schema,
    "domain": domain_schema,
    "map": map_schema,
    "scenario": scenario_schema,
}
"""What makes the schema of each kind of file."""


def _scenario_properties() -> dict[str, Schema]:
    """Return the properties of a document that hold a scenario."""
    sections = {
        **{
            name: _table(
                {each.name: _of(each) for each in group.quantities}, description=group.meaning
            )
            for name, group in GROUPS.items()
        },
        # A file states where the sun stands, not how far its way is turned.
        "weather": _table({each.name: _of(each, MOST_VISIBILITY_M) for each in WEATHER.values()}),
        "light": _table(
            {
                LIGHT[0]: _number("elevation of the sun, degrees", TWILIGHT_DEG, NOON_DEG),
                LIGHT[1]: _number("azimuth of the sun, degrees", 0, 360),
            }
        ),
        "marker": _table(_place(""), required=("x_m", "y_m")),
    }
    npc = {
        **_place("start_"),
        **_place("destination_"),
        "speed_mps": _number("its speed, m/s", low=0),
        "height_m": _number("height at which it flies, m", *BIRD_HEIGHTS_M),
        **{each.name: _of(each.quantity) for each in STORY.values()},
    }
    return {
        "map": _text("name of the map"),
        "seed": _whole("of what is random in the flight"),
        "absent": _list_of({"type": "string"}, "objects of the map that are not there"),
        "scenario": {
            **_table(sections, required=("marker",)),
            "patternProperties": {
                OBJECT_NAME: _table(npc, required=("start_x_m", "start_y_m", "speed_mps"))
            },
        },
        "genes": {
            "type": "object",
            "description": "the values without unit, of a scenario that units cannot write",
            "additionalProperties": {"type": "object"},
        },
        "task": _table(
            {
                "marker": _marker(),
                "start": _table(
                    {
                        "mode": _one_of(get_args(StartMode), "where the flight begins"),
                        "height_m": _number("of a start in the air", *START_HEIGHT_M),
                        "offset_m": _numbers(2, "from the told coordinate", START_OFFSET_M),
                    }
                ),
            },
            description="which marker lies there, and where the flight begins",
        ),
    }


def _section(keys: Section) -> Schema:
    """Return the schema of a section of a case."""
    required = [key.name for key in keys if not key.optional]
    return _table({key.name: _value(key) for key in keys}, required)


def _value(key: Key) -> Schema:
    words = key.meaning or key.comment
    if isinstance(key.kind, tuple):
        return _one_of(key.kind, words)
    if key.kind is float:
        return _number(words, key.low, key.high)
    if key.kind is list:
        return _list_of({"type": "string"}, words)
    if key.kind is dict:
        return {"type": "object", "additionalProperties": {"type": "string"}}
    return {str: _text, int: _whole, bool: _flag}[key.kind](words)


def _marker() -> Schema:
    number, side = _whole("of the marker in its dictionary"), _number("its side, m", *SIDE_M)
    nested = _table(
        {"id": number, "side_m": side, "offset_m": _numbers(2, "from the centre", FARTHEST_M)},
        required=("id", "side_m"),
    )
    return _table(
        {
            "dictionary": _one_of(DICTIONARIES, "the family of markers"),
            "id": number,
            "side_m": side,
            "nested": _list_of(nested, "smaller markers on the board", most=MOST_NESTED),
        },
        description="the marker that lies there",
    )


def _layer() -> Schema:
    return _table(
        {
            "kind": _one_of(get_args(LayerKind), "what is painted"),
            "points_m": _list_of(_numbers(2, "x, y"), "corners, ends, or the middle"),
            "colour": _colour(),
            "size_m": _number("width of a line, radius of a circle, side of a marker", low=0),
            "width_m": _number("stroke of circles and arcs; 0: filled", low=0),
            "angles_deg": _numbers(2, "start and end of an arc"),
            "yaw_deg": _number("how far it is turned", -360, 360),
            "marker_id": _whole("of a decoy marker"),
            "name": _text("what reports call it"),
        },
        required=("kind", "points_m"),
    )


def _body(kind: str, build: Callable[..., Any]) -> Schema:
    sizes = {
        name: _whole("") if isinstance(each.default, int) else _number("", 0.01, 100)
        for name, each in inspect.signature(build).parameters.items()
    }
    place = {
        "kind": {"const": kind},
        "position_m": _numbers(2, "x, y"),
        "yaw_deg": _number("how far it is turned", -360, 360),
    }
    return _table({**place, **sizes}, required=("kind", "position_m"))


def _of(quantity: Quantity, most: float = math.inf) -> Schema:
    """Return the schema of one value of a quantity."""
    words = _words(quantity)
    if quantity.choices:
        last = len(quantity.choices) - 1
        return {
            "description": words,
            "anyOf": [{"enum": [*quantity.choices]}, _number("", 0, last)],
        }
    return _number(words, quantity.low, min(quantity.high, most))


def _range(quantity: Quantity) -> Schema:
    """Return the schema of a range of a quantity: lowest and highest value, or false."""
    end = _number("", quantity.low, quantity.high)
    pair = {"type": "array", "items": end, "minItems": 2, "maxItems": 2}
    return {
        "description": f"[lowest, highest] or false: {_words(quantity)}",
        "anyOf": [{"const": False}, pair],
    }


def _words(quantity: Quantity) -> str:
    unit = f", {quantity.unit}" if quantity.unit else ""
    source = f" ({quantity.source})" if quantity.source else ""
    return f"{quantity.meaning}{unit}; nominal {quantity.text_of(quantity.nominal)}{source}"


def _document(title: str, properties: dict[str, Schema], required: Sequence[str] = ()) -> Schema:
    return {"$schema": DRAFT, "title": title, **_table(properties, required)}


def _table(
    properties: dict[str, Schema], required: Iterable[str] = (), description: str = ""
) -> Schema:
    return {
        "type": "object",
        **_described(description),
        "properties": properties,
        "additionalProperties": False,
        "required": [*required],
    }


def _either(first: str, second: str) -> Schema:
    return {"oneOf": [{"required": [first]}, {"required": [second]}]}


def _objects(each: Schema) -> Schema:
    return {
        "type": "object",
        "patternProperties": {OBJECT_NAME: each},
        "additionalProperties": False,
    }


def _place(prefix: str) -> dict[str, Schema]:
    sides = {"x": "east", "y": "north"}
    return {f"{prefix}{axis}_m": _number(f"m to the {to}") for axis, to in sides.items()}


def _list_of(item: Schema, description: str, most: float = math.inf) -> Schema:
    bound = {"maxItems": int(most)} if math.isfinite(most) else {}
    return {"type": "array", **_described(description), "items": item, **bound}


def _row(*items: Schema) -> Schema:
    return {"type": "array", "items": [*items], "minItems": len(items), "additionalItems": False}


def _numbers(count: int, description: str, most: float = math.inf) -> Schema:
    item = _number("", -most, most)
    return {**_list_of(item, description, count), "minItems": count}


def _colour() -> Schema:
    channel = {"type": "integer", "minimum": 0, "maximum": 255}
    return {**_list_of(channel, "red, green, blue, 0 to 255", 3), "minItems": 3}


def _share() -> Schema:
    return _number("", -1, 1)


def _number(description: str, low: float = -math.inf, high: float = math.inf) -> Schema:
    found: Schema = {"type": "number", **_described(description)}
    for name, bound in (("minimum", low), ("maximum", high)):
        if math.isfinite(bound):
            found[name] = bound
    return found


def _whole(description: str) -> Schema:
    return {"type": "integer", "minimum": 0, **_described(description)}


def _text(description: str, pattern: str = "") -> Schema:
    bound = {"pattern": f"^(?:{pattern})$"} if pattern else {}
    return {"type": "string", "description": description, **bound}


def _flag(description: str) -> Schema:
    return {"type": "boolean", "description": description}


def _one_of(names: Iterable[str], description: str) -> Schema:
    return {"enum": [*names], **_described(description)}


def _described(text: str) -> Schema:
    return {"description": text} if text else {}
