"""chasing: an NPC that sees the UAV late and from near; `grades.py` has its limits."""

from __future__ import annotations

from pytest_garl.npcs.directed import Directed


class Chasing(Directed):
    """Interferes for a while, within the limits of its grade."""

    grade = "chasing"

    def __init__(self, director: str = "") -> None:
        super().__init__(self.grade, director)


POLICY = Chasing
