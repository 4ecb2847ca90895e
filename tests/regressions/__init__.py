"""Tests of saved cases.

Three modules need a whole search or a pytest session: tests/plugin/test_cases.py tests
``follow_up`` and ``case_flights`` in a search, tests/cli/test_judged_cases.py tests
``case_test_run``.
"""
