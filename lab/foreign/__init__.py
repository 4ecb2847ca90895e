"""Landing systems of other people, flown and searched: see ``docs/results/foreign-systems.md``.

None of their code is here.  It is taken from the clones in the folder that ``GARL_FOREIGN`` names,
and flies as a companion program, with the settings that ``catalogue.py`` changes.
"""
