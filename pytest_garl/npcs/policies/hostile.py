"""hostile: an NPC that knows everything at once and attacks during the whole flight, as dqn."""

from __future__ import annotations

from pytest_garl.npcs.learned import LearnedPolicy, learned_spec


class Hostile(LearnedPolicy):
    """Moves as the shipped policy ``dqn`` does."""

    grade = "hostile"

    def __init__(self) -> None:
        super().__init__(**{key: str(value) for key, value in learned_spec("dqn").arguments})


POLICY = Hostile
