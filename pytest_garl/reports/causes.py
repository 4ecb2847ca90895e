"""The cause of a kind of violation, from its shrunk case: the title of a kind, and its group.

A flight that a search found has many unusual conditions, and nobody knows which of them the
violation takes.  Shrinking finds out, so only a kind with a shrunk case has a cause.
"""

from __future__ import annotations

import re

from pytest_garl.cases.case import Case
from pytest_garl.execution.severity import Severity
from pytest_garl.messages import shortened
from pytest_garl.verdicts.evidence import LOW_M

MOST_NAMED = 3
"""Of more conditions than these a title counts the rest."""
MOST_CHARACTERS = 140
NOTHING = "nothing unusual"
"""The cause of a violation that needs no condition at all."""
_DECOY = "decoy-"
_NUMBERED = re.compile(r"-\d+$")
_OF = {"fog": "visibility ", "wind": "mean ", "jump": "distance "}
"""Conditions of one quantity, and how its value begins: "fog of 10 m" for "visibility 10 m"."""
_SPEAKS_FOR_ITSELF = ("light", "camera", "leaves")
"""Conditions whose single value says what it is: "sun 23 degrees high", "dirt 20 %"."""
_ENDINGS = {
    "II:never-seen": "the marker is never readable",
    "II:lost": "the marker is no longer readable",
    "II:gave-up-in-sight": "gives up with the marker in view",
    "late:not-landed": "the time runs out",
    "late:never-gave-up": "neither lands nor gives up",
    "late:no-time": "gives up for want of time",
    "late:landed": "lands late",
    "off:seen": "comes down beside the marker",
    "off:unseen": "comes down beside the marker",
    "hard:fast": "touches down too fast",
    "hard:tilted": "touches down tilted",
}
_ENDINGS_OF_TYPE = {
    "slid": "slides after the touchdown",
    "abort": "gives up",
}
_ENDINGS_WHILE_HELD = {
    "I": "takes something else for the marker",
    "off": "aims beside the marker",
    "II": "does not report the marker",
    "IV": "plans through it",
    "V:no-plan": "has no plan any more",
    "V:gave-up": "gives up",
    "late": "plans late",
}
"""What happens while the UAV holds its place, by type, or by type and cause."""
_HELD = {"hold", "plan"}
"""The phases in signatures of such flights."""
_PHASES = {
    "take-off": "during the take-off",
    "transit": "on the way to the marker",
    "search": "in the search",
    "approach": "on the approach",
    # The phase is one of heights: the UAV may be climbing again.
    "descent": f"below {LOW_M:g} m",
    "last-metre": "in the last metre",
}


def tells_cause(case: Case) -> bool:
    """Return whether a case says what its kind takes."""
    return case.status == "open" and case.is_shrunk and bool(cause_of(case.severity))


def cause_of(severity: Severity) -> tuple[str, ...]:
    """Return the cause of a shrunk violation: names of conditions, or the type of a body.

    Two kinds with the same cause stand together; how strong it is does not matter, and what was not
    tried is no cause.
    """
    if severity.about == "body":
        return (severity.type,)
    if severity.about != "conditions":
        return ()
    names = {_NUMBERED.sub("", name) for name, _ in severity.tried}
    return tuple(sorted(names)) or (NOTHING,)


def title_of(case: Case) -> str:
    """Return the cause and the ending: ``fog of 10 m: the marker is never readable``.

    Empty if the ending has no words of its own, as that of a test's own assertion.
    """
    ending = _ending(case.ending)
    if not ending:
        return ""
    return shortened(f"{cause_in_words(case.severity)}: {ending}", MOST_CHARACTERS)


def cause_in_words(severity: Severity) -> str:
    """Return the cause with its strength: ``fog of 10 m``, ``a careless dog at 4.0 m/s``."""
    if severity.about == "body":
        return severity.unusual
    named = [_condition(*each) for each in severity.tried] or [NOTHING]
    if len(named) > MOST_NAMED:
        named = [*named[: MOST_NAMED - 1], f"{len(named) - MOST_NAMED + 1} more conditions"]
    cause = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
    perhaps = [name for name, _ in severity.acting if name in severity.untried]
    return f"{cause}, perhaps {' and '.join(perhaps)}" if perhaps else cause


def _condition(name: str, value: str) -> str:
    beginning = _OF.get(name)
    if beginning and value.startswith(beginning) and "," not in value:
        return f"{name} of {value.removeprefix(beginning)}"
    if name in _SPEAKS_FOR_ITSELF and value and not value.endswith(" values"):
        return value
    return f"{name} ({value})" if value else name


def _ending(signature: str) -> str:
    """Return what happens, in words; empty for signatures without words of their own."""
    kind, _, rest = signature.partition(":")
    parts = rest.split(":")
    if _HELD & {*parts[1:]} or (kind == "off" and parts[0] in _HELD):
        by_type = _ENDINGS_WHILE_HELD.get(kind, "")
        return _ENDINGS_WHILE_HELD.get(f"{kind}:{parts[0]}", by_type)
    if kind == "I":
        if parts[0] == "nothing":
            return "comes down on open ground, off the marker"
        is_decoy = parts[0].startswith(_DECOY)
        return "comes down on the decoy" if is_decoy else f"comes down on a {parts[0]}"
    if kind == "IV":
        ending = "collision"
    elif kind == "III":
        ending = f"hits a {parts[0]}"
    else:
        ending = _ENDINGS.get(f"{kind}:{parts[0]}", _ENDINGS_OF_TYPE.get(kind, ""))
    phase = next((_PHASES[part] for part in parts[1:] if part in _PHASES), "")
    return f"{ending} {phase}".strip() if ending else ""
