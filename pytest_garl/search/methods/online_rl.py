"""online-rl: random scenarios, whose weather, light and objects one network changes in flight.

The paper's fourth baseline (after Lu et al. 2022, DeepCollision).  "Each simulation starts with a
randomly initialized test scenario"; every 0.5 s the agent alters a weather by ±0.01 or the time of
day, or moves an object up, down, left or right; "if the action involves moving a dynamic
object, a random object will be selected".  What makes it another method than ``random`` is the
policy of objects, ``online-rl``, whose moves may change the environment as well.  It is trained in
the surrogate of ``dqn-paper``, with its reward and for as long (800 episodes), and frozen.  The
scenarios are those of ``random`` to the byte, so that the two compare pair by pair.

Where paper and code differ, or say nothing:

- The code decides every second, the paper every half.  Taken is the paper's.
- The code's 23 actions are to stay, four moves, eight weathers up and down, and two of the time of
  day, which the paper counts to the environment.  Taken are these, time by ±0.01 like the rest.
- The code trains on places relative to the marker and flies on absolute ones, a mistake that
  leaves the policy blind.  Taken are the relative ones in both.
- At each decision one object is drawn, whose place the network sees, and which moves if the
  action is to move; the others stand.  In the surrogate there is one.
- Weather that changes a rewarded picture would have to be rendered; the paper's surrogate does not,
  nor does this one, so that training finds no use in the weather.
- What the policy does to the weather stays in the range that a confined search draws from.
"""

from __future__ import annotations

from pytest_garl.search.method import MethodDeclaration
from pytest_garl.search.methods.random import RandomSearch

METHOD = MethodDeclaration(make=RandomSearch, policy="online-rl")
