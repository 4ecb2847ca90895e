from __future__ import annotations

import math

import numpy as np
import pytest

from landing_systems.modules.detection_tphyolo.decoding import (
    CHANNELS,
    cells_of,
    class_logit,
    decode,
    iou,
    joint_logit,
    suppress,
)


def logit(p: float) -> float:
    return math.log(p / (1 - p))


def silent() -> np.ndarray:
    raw = np.zeros((CHANNELS, cells_of(320, 240).shape[1]), np.float32)
    raw[4] = -20
    return raw


def cell_at(x: float, y: float, stride: int) -> int:
    grid = cells_of(320, 240)
    (found,) = np.flatnonzero((grid == np.array([[x], [y], [stride]])).all(axis=0))
    return int(found)


def test_cells_cover_the_frame_at_four_scales() -> None:
    counts = np.unique(cells_of(320, 240)[2], return_counts=True)
    assert dict(zip(*counts, strict=True)) == {4: 80 * 60, 8: 40 * 30, 16: 20 * 15, 32: 10 * 8}


def test_an_answer_becomes_a_box() -> None:
    raw = silent()
    raw[:, cell_at(20, 36, 8)] = (0.5, -1.0, math.log(2), 0.0, logit(0.9))
    boxes = decode(raw, 320, 240, logit(0.25))
    assert boxes.centres_px == pytest.approx(np.array([[24, 28]]))
    assert boxes.sizes_px == pytest.approx(np.array([[64, 32]]))
    assert boxes.logits == pytest.approx(np.array([logit(0.9)]))


def test_of_answers_for_one_marker_the_surest_is_kept() -> None:
    raw = silent()
    raw[:, cell_at(20, 36, 8)] = (0.5, 0.5, 0.0, 0.0, 1.0)
    raw[:, cell_at(28, 36, 8)] = (-0.5, 0.5, 0.0, 0.0, 3.0)
    boxes = decode(raw, 320, 240, logit(0.25))
    assert boxes.logits.tolist() == [3.0]
    assert len(decode(silent(), 320, 240, logit(0.25)).logits) == 0


def test_the_joint_logit_is_that_of_the_product() -> None:
    assert joint_logit(logit(0.5), logit(0.5)) == pytest.approx(logit(0.25))
    assert joint_logit(40.0, -3.0) == pytest.approx(-3.0)


def test_an_id_of_no_class_is_never_returned() -> None:
    chances = np.array([0.05, 0.05, 0.2, 0.0001, 0.6999])
    number, answer = class_logit(np.log(chances).astype(np.float32))
    assert number == 2
    assert answer == pytest.approx(logit(0.2), abs=1e-4)


def test_overlap_is_intersection_over_union() -> None:
    centres, sizes = np.array([[1, 1], [2, 1]], np.float32), np.full((2, 2), 2, np.float32)
    assert iou(centres, sizes)[0, 1] == pytest.approx(2 / 6)


def test_of_overlapping_boxes_the_first_is_kept_and_neighbours_stay() -> None:
    centres = np.array([[10, 10], [11, 10], [20, 10], [10, 11]], np.float32)
    assert suppress(centres, np.full((4, 2), 8, np.float32)) == [0, 2]
