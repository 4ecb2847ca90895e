"""Landing systems of other people, adapted and searched: see ``docs/foreign-systems.md``.

None of their code is here.  Each adapter loads it from the folder that ``GARL_FOREIGN`` names.
"""
