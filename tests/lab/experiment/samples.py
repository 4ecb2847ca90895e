"""Rows made by hand."""

from __future__ import annotations

from typing import Any

from lab.experiment.results import ResultRow

PLAIN: dict[str, Any] = {
    "system": "Lander",
    "map": "court",
    "method": "garl",
    "seed": 0,
    "budget": 40,
    "violations": 10,
    "type_i": 1,
    "type_ii": 2,
    "type_iii": 0,
    "type_iv": 6,
    "type_v": 1,
    "late": 3,
    "off": 1,
    "hard": 0,
    "aborted": 4,
    "inconclusive": 0,
    "top10": 30,
    "signatures": ("II:lost:descent", "IV:dog:last-metre:seen"),
    "parameter_distance": 1.5,
    "weather_distance": 0.125,
    "violating_distance": 1.25,
    "covered": 150,
    "cells": 3000,
    "flying_s": 7000.0,
    "idle_s": 200.0,
    "workers": 2,
    "landing_system": "stack.lander:Lander",
    "landing_system_sha256": "aaaaaaaaaaaa",
    "map_sha256": "bbbbbbbbbbbb",
    "policy": "dqn",
    "policy_sha256": "cccccccccccc",
    "version": "0.1.0",
    "package_sha256": "dddddddddddd",
    "domain": "paper",
    "engine": "bullet",
    "machine": "x86_64-avx2",
    "result_hash": "eeeeeeeeeeee",
    "limits": "0.75 m, 120 s, abort needless",
    "landed": 26,
    "paper": 12,
    "slid": 1,
    "blocked": 1,
    "excused": 1,
    "needless": 2,
    "kind_counts": (4, 6),
    "its_code": 12,
    "its_top10": 30,
    "its_covered": 150,
}


def row(**values: Any) -> ResultRow:
    return ResultRow(**{**PLAIN, **values})
