"""Tests of saved cases.

Two modules need a pytest session: tests/plugin/terminal/test_save_cases.py tests ``follow_up``,
tests/cli/test_judged_cases.py tests ``case_test_run``.
"""
