"""Landing systems that are programs of any language, on stdin and stdout, in lock-step.

The steps of a flight:

1. ``external_program.py`` is the declaration, which a test names: command, folder, name, sources,
   airframe.
2. A flight starts the program anew in a process of its own (``child.py``), so that no flight knows
   of another one.  It takes a millisecond for C++, 0.1 s for Python with OpenCV, seconds for ROS 2.
3. Each line on its stdin is one request, each line on its stdout one answer (``protocol.py``, and
   ``docs/protocol.md`` for authors of the other side).  The simulated time stands still until
   the answer is there.
4. Pictures do not pass the pipe: they are written into memory that both processes map
   (``frame_memory.py``), and only if the program has said that it reads them.
5. A program that asks for NED gets and gives values in NED and FRD (``axes.py``); the rest of the
   package knows ENU and FLU only.
6. What goes wrong with the program, or with a line of it, is raised as ProgramFailedError and ends
   the flight as a finding.  A program that does not answer is ended by the supervisor of the
   worker, which knows the limit of a call.

``clients/`` holds the other side for Python and C++; ``garl client`` copies it into a project.
"""
