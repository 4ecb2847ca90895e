"""Studies: they write the tables of the docs.  All fly by the baseline of CPU instructions."""

from pytest_garl import cpu_dispatch

# Before a study loads NumPy or OpenCV, which read then what they may choose.
cpu_dispatch.pin()
