"""A flight as an MCAP file, for viewers of robots' recordings such as Foxglove and Rerun.

``export.py`` is what is exported, ``shown_pictures.py`` draws the camera's pictures again, the
modules named after topics turn both into messages, and ``writer.py`` writes them in the order of
time.  Only this folder knows Foxglove's SDK; ``sdk.py`` says whether it is installed.
"""
