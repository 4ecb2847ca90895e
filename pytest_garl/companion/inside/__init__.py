"""What runs in the process of a companion program, beneath the program: Python's library alone.

The program's Python may be another one, of version 3.9 or later, in which pytest-garl is not
installed: nothing here imports it.  ``start.py`` loads this package under a name of its own.

Simulated time, in steps:

1. Each thread of the program is a task (``turns.py``).  A real thread carries it, and one of them
   runs at a time: a task that sleeps, waits for a lock or reads an empty socket parks, and gives
   the turn to the task that is due first; tasks due at one time run in the order of their parking.
   No task is interrupted: a computation takes no time of the flight.
2. The clock stands while a task computes.  Each reading of it adds 20 microseconds, so that loops
   that wait for a time end, and no program divides by 0.
3. If nobody is due before the time up to which the simulator has flown, the task that parked last
   asks for more (``Host.exchange`` in ``start.py``): the answer brings the next time, the bytes of
   the vehicle and the number of the camera's frame, which make other tasks due.
4. Sockets are queues in this process (``network.py``).  What is sent to a port on which the program
   does not listen itself goes to the vehicle.
5. ``cv2.VideoCapture`` asks the simulator for a frame when the program reads it (``sight.py``).
6. A Python program that it starts by ``subprocess`` runs under the same files, and gets its time
   from a task of this process (``offspring.py``).

As an example: a thread reads MAVLink by ``select`` with a time-out of 50 ms, the main thread waits
for a frame.  At 0.00 s both park.  The simulator flies 20 ms and sends a heartbeat: the reader is
due, parses it and parks again; the clock says 0.02 s.  At 0.10 s there is a frame, and the main
thread looks at it.  The order is the same in every flight, whatever else the machine does.  A
switch takes about 10 microseconds, an exchange 60.
"""
