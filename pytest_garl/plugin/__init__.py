"""The pytest plugin; no other part of the package imports pytest.

Three rooms lie below: ``items``, what there is to test; ``session``, what happens while it runs;
and ``terminal``, what is shown.  A room imports those before it, and ``hooks`` imports them all.
The modules, in the order in which a session needs them:

1. ``hooks`` has the hooks of pytest and delegates.  Every pytest run imports it, with ``arguments``
   (options and ini keys as pytest declares them), ``keys`` (of stashes), ``abort`` and
   ``fixtures``.  The other modules are imported once there is something to fly.
2. ``options`` reads all options once into one frozen object; ``option_checks`` compares them.
   ``startup`` begins the ``run``: options, ledger, pool and results of this process.
3. ``collection`` makes the items of each marked test: ``marker`` reads the marker, and a ``target``
   says what one item tests.  ``baseline_gate`` adds items that compare rates with a baseline.
4. ``search_setup`` puts the searches of the selected items into the ledger when the first of them
   asks for its ``landing``.  ``progress`` shows how far they are; ``kind_news`` tells each new
   kind of violation, and ``time_left`` forecasts the rest from what was flown.
5. ``landing`` skips a test that reads what its flight did not decide.  ``outcomes`` decides whether
   an item passes, fails, xfails or skips after that.  ``item_facts`` gathers the
   facts (with ``failed_statement`` and ``user_assertions``), and ``item_report`` writes the
   decision into the report (``report_text``).  What an item says travels as ``item_record``.
6. ``tally`` counts what reports say, ``save_cases`` saves new violations, ``session_status`` sets
   the exit status, and ``summary`` and ``github_summary`` show all of it.  ``termination`` lets
   SIGTERM end a session as Ctrl-C does.

``hookspecs`` has the hook that users may implement, ``case_tests`` finds the tests of a saved case
for ``garl cases``, and ``suggested_commands`` and ``terminal_text`` serve all texts.
"""
