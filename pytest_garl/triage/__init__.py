"""Which violations of a run become cases, and in which order.

A search ends with many violations and few mistakes behind them.  This room chooses what is worth
flights:

1. While a search runs, each generation is read once (``new_signatures.py``).  A violation is new
   if no saved case explains it: none of the same ending whose causes act in it
   (``known_kinds.py``).  If that is unclear, its twin is flown, without the causes that are known.
2. Each new kind is investigated beside the search, in the order in which it was found
   (``investigation_queue.py``), by the steps of ``shrinking/plan.py``.  Each gets flights of one
   allowance (``allowance.py``): all kinds together no more than the search has.
3. After the search what had gone wrong before a collision is flown again without NPCs
   (``second_reading.py``), and violations of one ending with another cause are looked for
   (``further_causes.py``).
4. What was found is saved, the most frequent kind first (``follow_up.py``).

The order depends on the flights alone, never on when one has ended, so that any number of workers
makes the same cases.  What is left to fly is forecast for the progress line (``forecast.py``).
 For example a search of 16 flights has seven violations of five kinds.  Their investigations have
16 flights together by default.  The first gets 12 and gives back what it does not use.  A kind that
the rest cannot confirm is named in the summary as "not shrunk".
"""
