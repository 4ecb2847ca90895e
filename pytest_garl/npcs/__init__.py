"""The policies that move the NPCs, and the directors that decide when NPCs and events begin.

A story has a body, a grade and a way.  The policy of its grade moves it (``policies/``), within
what the grade perceives and how fast its body is (``grades.py``, ``interference.py``).  *When* it
begins decides whether anything happens, so a director decides that in flight:

1. A story with the moment "decided" waits.  Every half second it becomes a few numbers, all of
   them what its grade perceives of the UAV (``director.py``); an event has other numbers, and a
   network of its own (``event_watch.py``).
2. A small network values "wait" and "go" (``learned.py``).  After go the NPC does what its grade
   does, so that the decision is one moment, and a saved case needs no network.
3. After a generation each recorded flight is a lesson (``lessons.py``).  Until a body is in the
   picture the UAV's way does not depend on it: geometry says for every moment of the flight what to
   go there would have been worth (``encounter.py``), without a flight.  What a system does once it
   sees the body is a share that is counted in the flights in which that happened.
4. The weights that ship are moved along the gradient of that worth, forty steps, and held near to
   where they began (``own_director.py``, ``gradient.py``).  A director of events starts from a rule
   and must beat it in flights that it did not learn from (``event_lessons.py``).

The order is that of trust: geometry is exact and costs milliseconds, the response is a frequency of
few flights, and weights that ship have seen many landing styles and none of the system under test.
All of it takes some per cent of a search's computing time, in NumPy, on one thread, in double
precision, so that the weights have the same bytes everywhere.

Say a dog waits 6 m beside the marker, and the UAV comes down from 8 m in 16 s.  In the
recorded flight the dog went at 9 s and came too early.  Geometry moves its begin through all
decisions: from 12.5 to 13.5 s it meets the UAV half a metre up.  The lesson is that going then is
worth a collision, and the network moves towards waiting at 9 s and going at 12.5 s.
"""
