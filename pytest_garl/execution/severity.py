"""How severe a violation is: how strong an adversary, or how harsh a world, it takes.

What a violation *takes* is known of a shrunk case only.  Of a flight that a search found, it is
known what was *unusual* in it.

The weaker the adversary, the more severe: a landing system that hits people who know nothing of it
needs no enemy.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from pytest_garl.scenarios.story import GRADES

MOST_LISTED = 4
"""Of more conditions than these the rest is counted, and no values are named."""
COUNTED = " values"
"""Ends the values of a condition that has too many to name: ``5 values``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Severity:
    """What it took to cause one violation.

    ``about`` is "body" for a collision with a moving body, "conditions" for any other violation,
    and empty where nothing is to be said: for a crash of the landing system.

    Of a body: ``grade`` says how much it knew of the UAV, empty if nobody knows; ``type`` is
    person, child, dog or bird; ``objects`` are in the scenario; it interfered for
    ``interference_s`` up to the contact; ``speed_mps`` is its highest speed in the last 3 s;
    ``when`` says that it came while something covered the marker, and is empty if nothing did.  Its
    entry may be shifted within ``window_s`` and the UAV still hits such a body; None if that was
    not measured.

    Of conditions: ``conditions`` are active, objects that are there included; ``values`` say for
    each which of its values are not nominal, or how many; ``largest_share`` (0..1) is how far the
    strongest lies from nominal, as a share of all that can be flown; ``largest`` says it in words.
    ``idle`` are those of the conditions that cannot have acted: they change only data which the
    landing system never read, or are events that did not strike.  No text names them.  ``placed``
    says that the marker lies elsewhere than at the map's coordinate.

    ``untried`` names conditions and objects of a saved case, the marker's place, and conditions
    value by value, of which shrinking did not try whether the violation needs them.
    """

    about: Literal["", "body", "conditions"] = ""
    grade: str = ""
    type: str = ""
    objects: int = 0
    interference_s: float = 0.0
    speed_mps: float = 0.0
    when: str = ""
    window_s: float | None = None
    conditions: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    largest: str = ""
    largest_share: float = 0.0
    idle: tuple[str, ...] = ()
    placed: bool = False
    untried: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[float, ...]:
        """The order of severities: the lowest takes the weakest adversary or the mildest world.

        Of bodies the lowest grade, then the fewest objects, the shortest interference, the lowest
        speed; of conditions the fewest, then the smallest share.  A grade that nobody knows counts
        as the strongest, and an empty severity comes last.
        """
        if self.about == "body":
            rank = GRADES.index(self.grade) if self.grade in GRADES else len(GRADES)
            return (0, rank, self.objects, self.interference_s, self.speed_mps)
        if self.about == "conditions":
            return (0, len(self.conditions), self.largest_share)
        return (1,)

    def __lt__(self, other: Severity) -> bool:
        """Return whether it takes less."""
        return self.key < other.key

    @property
    def text(self) -> str:
        """What it took, for a violation that was shrunk: ``fog alone, visibility 11 m``.

        It may be empty.  What shrinking did not try is named.
        """
        if not self.about:
            return ""
        took = self._body_text() if self.about == "body" else self._conditions_text()
        return f"{took}{self._untried_text()}"

    @property
    def unusual(self) -> str:
        """What was unusual in a flight of which nobody knows what it took; empty for nothing.

        ``rain (45 mm/h, wetness 93 %), person-2``, or ``a chasing dog at 6.1 m/s for 3.5 s``.
        """
        if self.about == "body":
            return self._body_text()
        acting = self.acting
        if len(acting) == 1:
            acting = [(acting[0][0], self._value_of_one(acting[0][1]))]
        named = [_named(*each) for each in acting]
        if len(named) > MOST_LISTED:
            named = [*named[:MOST_LISTED], f"{len(named) - MOST_LISTED} more"]
        return ", ".join(named)

    @property
    def acting(self) -> list[tuple[str, str]]:
        """Return (name, value) of the conditions that may have acted."""
        pairs = zip(self.conditions, self.values, strict=True)
        return [(name, value) for name, value in pairs if name not in self.idle]

    @property
    def tried(self) -> list[tuple[str, str]]:
        """(name, value) of the conditions that may have acted, but for those in ``untried``."""
        return [each for each in self.acting if each[0] not in self.untried]

    @property
    def is_guess(self) -> bool:
        """Whether no condition was tried: nobody knows which of them the violation takes."""
        return self.about == "conditions" and bool(self.acting) and not self.tried

    def _value_of_one(self, value: str) -> str:
        """Return the value of a condition that is the only one, with the largest if it has many."""
        if value.endswith(COUNTED):
            return f"{value}, most of all {self.largest}"
        return value or self.largest

    def _untried_text(self) -> str:
        names = [each for each in self.untried if each not in self.idle]
        if not names:
            return ""
        if len(names) > MOST_LISTED:
            names = [*names[: MOST_LISTED - 1], f"{len(names) - MOST_LISTED + 1} more"]
        listed = ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
        return f"; {listed} {'were' if len(names) > 1 else 'was'} not tried"

    def _body_text(self) -> str:
        words = " ".join(word for word in (self.grade, self.type) if word)
        article = "an" if words.startswith(("a", "e", "i", "o", "u")) else "a"
        text = f"{article} {words} at {self.speed_mps:.1f} m/s"
        if self.interference_s > 0:
            text += f" for {self.interference_s:.1f} s"
        if self.when:
            text += f", which comes {self.when}"
        others = self.objects - 1
        if others < 1:
            return text
        return f"{text}, {others} other{'s' if others > 1 else ''} there"

    def _conditions_text(self) -> str:
        acting = self.acting
        names, count = [name for name, _ in acting], len(acting)
        place = " with the marker at this place" if self.placed else ""
        if not count:
            return f"nothing unusual{place and ' but the place of the marker'}"
        if count == 1:
            value = self._value_of_one(acting[0][1])
            return f"{names[0]}{place or ' alone'}{f', {value}' if value else ''}"
        if count > MOST_LISTED:
            more = f"{count - MOST_LISTED} more"
            return f"{count} conditions{place}: {', '.join([*names[:MOST_LISTED], more])}"
        return f"{count} conditions{place}: {', '.join(_named(*each) for each in acting)}"

    def to_json(self, *, took: bool) -> dict[str, Any]:
        """Return plain values for a report: its text, and the facts of a body or of conditions.

        ``took`` says that it is of a shrunk case, so that its text is what the violation takes.
        """
        body = {
            "grade": self.grade,
            "type": self.type,
            "objects": self.objects,
            "interference_s": self.interference_s,
            "speed_mps": self.speed_mps,
            "when": self.when,
            "window_s": self.window_s,
        }
        conditions = {
            "conditions": list(self.conditions),
            "values": list(self.values),
            "largest": self.largest,
            "largest_share": self.largest_share,
            "idle": list(self.idle),
            "placed": self.placed,
        }
        facts = {"": {}, "body": body, "conditions": conditions}[self.about]
        if self.about:
            facts["untried"] = list(self.untried)
        text = self.text if took else self.unusual
        return {"about": self.about, "took": took, "text": text, **facts}


def _named(name: str, value: str) -> str:
    return f"{name} ({value})" if value else name


NO_SEVERITY = Severity()
