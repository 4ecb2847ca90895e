"""Faults of identity: which of the markers in sight is the pad."""

from __future__ import annotations

from lab.faults.control import ControlSystem
from lab.faults.eyes import Eyes
from lab.faults.track import Place
from pytest_garl import Detection, Observation


class AnyIdEyes(Eyes):
    """Eyes that do not compare ids."""

    def accepts(self, found: Detection, observation: Observation) -> bool:
        """Accept every marker of the dictionary that has a margin."""
        return self.has_margin(found, observation.image)


class AnyId(ControlSystem):
    """Takes every marker of the dictionary for the pad.

    The report: a UAV that lands on the marker of another pad, or on a false reading.
    """

    eyes_of = AnyIdEyes


class NoMarginEyes(Eyes):
    """Eyes that do not look at the margin."""

    def has_margin(self, found: Detection, image: object) -> bool:
        """Accept a marker whatever surrounds it."""
        return True


class NoMargin(ControlSystem):
    """Takes a marker without its white margin, such as a printed picture of it, for the pad.

    The report: a relaxed check of the border lets false markers through.
    """

    eyes_of = NoMarginEyes


class TwoMarkersEyes(Eyes):
    """Eyes that unpack the one marker that their author had in view."""

    def look(self, observation: Observation) -> tuple[Detection, ...]:
        """Read the number of the marker as if there were one."""
        if self.is_repeated(observation):
            return ()
        found = self.detect(observation)
        if not found:
            return ()
        (only,) = found
        return (only,) if self.accepts(only, observation) else ()


class TwoMarkers(ControlSystem):
    """Raises as soon as two markers are in one frame.

    The report: code that turns the array of ids into one number.
    """

    eyes_of = TwoMarkersEyes


class LastSeen(ControlSystem):
    """Follows the detection that comes last in the list, whichever was followed before.

    The report: of several detections of one id, the node publishes the last one.
    """

    eyes_of = NoMarginEyes

    def chosen(self, seen: tuple[Detection, ...]) -> Place | None:
        """Return the place of the last detection."""
        return (seen[-1].position_m[0], seen[-1].position_m[1]) if seen else None
