"""surrogate-random: random scenarios whose NPCs the trained policy moves.

The paper's ablation "Surrogate trained RL with random": GARL without its genetic algorithm.  It
differs from ``random`` by its NPC policy, ``dqn-paper``, the policy of ``garl-paper``.  Paper and
code agree on that.  In the code every object walks at 3 m/s; here each has the speed of its gene,
as in ``garl-paper``.  The scenarios are those of ``random`` to the byte, so that the two can be
compared pair by pair.
"""

from __future__ import annotations

from pytest_garl.search.method import MethodDeclaration
from pytest_garl.search.methods.random import RandomSearch

METHOD = MethodDeclaration(make=RandomSearch, policy="dqn-paper")
