"""The three judges of the search: what evolution and learning are worth, against rivals.

These definitions were written down, and their code was committed, before the first of the seeds
that they judge was opened.  ``python -m lab.judges power`` of commit 3b6029a said which differences
they can see.  The arms are those of ``lab/arms.py``.

**Judge 1, faults** (``faults.py``).  The fault suite of ``lab/faults``, searches of 100 flights.

- A scenario is a *candidate* if the faulty landing system violates a property in it, and the
  control, flown in the same scenario among the same NPCs, violates none.  The candidate *finds* the
  fault if its twins confirm it: both systems fly the scenario four times more, with an approach 2 %
  slower, 1 % slower, 1 % faster and 2 % faster; at least three of the four faulty twins violate a
  property, and at most one of the four twins of the control does.  A search ends at its first find.
  Flights of the control and of twins count for nobody.
- Arms: ``random``, ``exploring+``, ``garl``, ``shuffled`` on seeds 23 to 27; all others on
  development seeds only.  A search without a find counts as 100 flights.
- Measures: the share of faults found within 100 flights; the mean flights of ``garl`` as a multiple
  of those of each rival; the flights that it needs less than ``shuffled``.  Pairs are of one fault
  and one seed.  The searches of a seed share scenarios, and faults of a family are alike: intervals
  (95 %) come from a bootstrap that draws seeds and families.
- The first generation is the control of the search: chance, the same for all arms.  The measures
  stand twice: over all pairs, and over those that no arm found in the control, from its end on.
- The placebo, a system without a fault, is searched for as well; it counts in no measure.
- A fault and seed count if all arms have flown them.  While a seed is not whole, its faults are
  flown in the order of ``random.Random(seed).shuffle``, so that those flown are a random part.
- 400 flights for ``garl`` and ``exploring+`` on seeds 23 to 25: what the arm missed in 100 flights.

**Judge 2, causes** (``causes.py``).  Three landing systems, searches of 400 flights, one map for
each seed: the court for even ones, the lawn for odd ones.

- A violation is shrunk by the package's shrinker with at most ``SHRINK_FLIGHTS`` flights, in which
  NPCs follow their stories.  Its *cause* is what is left: the set of condition groups and types of
  NPCs, without values, moments, phases, maps, and without the type of violation.  It is *confirmed*
  if two of four twins of the shrunk scenario violate the same property by the same kind of body:
  the start of the UAV is moved by 2 cm to the east, west, north and south.
- Violations are taken in the order of the flights.  One in which a confirmed cause acts as a whole
  is explained and not shrunk if the two signatures begin with the same two words, such as
  ``IV:dog``.  Of each signature at most ``MOST_ASKED`` are shrunk.
- The first generation of each search, the control, counts for nobody, nor does a violation whose
  landing system raised.  No probe is flown.
- Arms: ``exploring+``, ``garl``, ``shuffled`` on seeds 23 to 27, ``exploring`` on 23 and 24.
- Measure: the number of distinct confirmed causes of a search.  Differences and ratios to ``garl``
  are paired by seed and system, with Student's t-interval over pairs, and p is of the exact test
  that flips the signs of differences.
- Beside it, added after the first search had been seen: the causes that contain no other cause of
  the same search; a violation that takes no condition is one of them, and contained by none.

**Judge 3, preventable violations** (``preventable.py``).  One NPC of grade `chasing` in clear
weather, everything else nominal, on each system and each map, 100 flights an arm, seed 20.

- All arms fly the same scenarios, in generations of ten; in the arm ``gene`` the NPC begins at a
  moment and a delay that were drawn as the domain draws them, in all others the arm's director
  decides.  That of ``garl`` learns from the flights, one generation behind; that of ``shipped``
  does not.  Types of NPCs take turns.
- A collision with the NPC *counts* if the case that the package makes of it gates: its neighbours
  fail as well, an escape exists, and the body was in view for 0.3 s before the escape begins.  A
  contact within a second after the touchdown counts for nobody, nor one less than a second before
  the UAV, sinking on as fast, would have touched down, nor an edge case.  All violations are
  reported beside it.
- Measure: counted violations per 100 flights, pooled; ratios and differences with a bootstrap over
  scenarios, which arms share.

**A second order.**  Up to commit f5764fe every second flight of ``garl`` after the control was a
child.  Seeds 20 to 22 of judge 1 and two pairs of judge 2 judged that search: by pairs it was later
than ``exploring+`` (16 to 48).  From then on its children are the last half of its flights, so that
up to there it is ``exploring+``.  This was chosen by these seeds and by the stand-in, and is judged
on seeds that nobody had opened, 23 to 27, of both judges; 28 and 29 stay closed.
"""
