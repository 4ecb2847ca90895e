"""online-rl: random scenarios; one network changes weather, light and NPCs during the flight.

The paper's fourth baseline (after Lu et al. 2022, DeepCollision).  "Each simulation starts with a
randomly initialized test scenario"; every 0.5 s the agent alters a weather value by ±0.01 or the
time of day, or moves an object up, down, left or right; "if the action involves moving a dynamic
object, a random object will be selected".  It differs from ``random`` by its NPC policy,
``online-rl``, whose moves may change the environment as well.  The policy is trained in the
surrogate of ``dqn-paper``, with the same reward and the same number of episodes (800), and frozen.
The scenarios are those of ``random`` to the byte, so that the two can be compared pair by pair.

Choices, if paper and code differ or say nothing:

- The code decides every second, the paper every half second.  This method follows the paper.
- The code has 23 actions: to stay, four moves, eight weather values up and down, and two for the
  time of day, which the paper counts as part of the environment.  This method has the same, and
  changes the time by ±0.01 like the weather.
- The code trains on positions relative to the marker and flies with absolute ones, a mistake that
  makes the policy's input meaningless.  This method uses relative positions in both.
- At each decision one NPC is drawn.  The network sees its position, and it moves if the action is
  a move; the others stand.  The surrogate has one NPC.
- The reward would depend on the weather only if the weather were rendered.  The paper's surrogate
  does not render it, and neither does this one, so training finds no use for the weather.
- The policy keeps the weather in the range that a confined search draws from.
"""

from __future__ import annotations

from pytest_garl.search.method import MethodDeclaration
from pytest_garl.search.methods.random import RandomSearch

METHOD = MethodDeclaration(make=RandomSearch, policy="online-rl")
