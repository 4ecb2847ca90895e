"""Puts names beside things so that they hide neither the things nor each other."""

from __future__ import annotations

from pytest_garl.reports.film import drawing

_SIZE = 13
_GAP_PX = 6
Box = tuple[float, float, float, float]
"""Left, top, right, bottom."""


class Labels:
    """The names in one picture; ``keep_clear`` of all things before the first ``write``.

    Places and radii are in pixels.
    """

    def __init__(self, image: drawing.Image) -> None:
        self._image = image
        height, width = image.shape[:2]
        self._frame: Box = (0.0, 0.0, float(width), float(height))
        self._taken: list[Box] = []

    def keep_clear(self, at: drawing.Point, radius: float) -> None:
        """Let no name cover what is drawn here."""
        x, y = at
        self._taken.append((x - radius, y - radius, x + radius, y + radius))

    def write(self, words: str, at: drawing.Point, radius: float, colour: drawing.Colour) -> None:
        """Write a name beside what is drawn within ``radius`` of ``at``: right, if it is free."""
        x, y = at
        wide = drawing.width_of(words, _SIZE)
        centred = x - wide / 2
        starts = (
            (x + radius + _GAP_PX, y + 5),
            (x - radius - _GAP_PX - wide, y + 5),
            (centred, y - radius - _GAP_PX),
            (centred, y + radius + _GAP_PX + _SIZE),
        )
        boxes = [(left - 3, low - _SIZE, left + wide + 3, low + 4) for left, low in starts]
        best = min(range(len(boxes)), key=lambda index: self._covers(boxes[index]))
        self._taken.append(boxes[best])
        drawing.label(self._image, words, starts[best], colour, _SIZE)

    def _covers(self, box: Box) -> float:
        """Return the area in which a box hides something or leaves the picture."""
        size = (box[2] - box[0]) * (box[3] - box[1])
        outside = size - _shared(box, self._frame)
        return outside + sum(_shared(box, other) for other in self._taken)


def _shared(one: Box, other: Box) -> float:
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    return max(0.0, across) * max(0.0, down)
