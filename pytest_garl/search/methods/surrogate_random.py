"""surrogate-random: random scenarios, whose objects the trained policy steers.

The paper's ablation "Surrogate trained RL with random": GARL without its genetic algorithm.  What
makes it another method than ``random`` is who moves the objects: ``dqn-paper``, the policy that
``garl-paper`` flies with, unless another is named.  Paper
and code agree on that; the code lets the policy walk every object at 3 m/s, here each has the
speed of its gene, as in ``garl-paper``.  The scenarios are those of ``random`` to the byte, so that
the two compare pair by pair.
"""

from __future__ import annotations

from pytest_garl.search.method import MethodDeclaration
from pytest_garl.search.methods.random import RandomSearch

METHOD = MethodDeclaration(make=RandomSearch, policy="dqn-paper")
