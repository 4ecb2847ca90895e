"""The public fault suite: landing systems with one planted fault each, from public bug reports.

The definition, written down before the first search:

    A scenario *finds* a fault if the faulty landing system violates a property in it, and the
    control, flown in the same scenario with the same seed and the same NPC policy, violates none.

``lab/judges/faults.py`` flies the searches, in which twins must confirm a find.

Violations are those of the default limits (``pytest_garl.verdicts``).  A landing that the control
gives up with an excuse is no violation of the control.  The control has no planted fault; compared
with itself it is never found, by construction.  Faults, control and scenarios may not be fitted to
a search method: ``docs/results/faults.md`` lists every later change.

A *mutation score* is the share of faults that a search finds within a number of flights of the
faulty system.  Flights of the control are not counted: they only decide what is found.
"""
