from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

pytest.importorskip("torch")
import torch

from lab.train_detector.dataset import (
    CROP_PX,
    LABEL,
    MAX_MARKERS,
    Samples,
)
from lab.train_detector.identity import (
    OTHER,
    IdentityNet,
    IdentityPlan,
    PatchSampler,
    train_identity,
)
from lab.train_detector.losses import (
    LossWeights,
    complete_iou,
    loss_of,
    targets_of,
)
from lab.train_detector.model import (
    TphYolo,
    fused,
    parameter_count,
)
from lab.train_detector.training import (
    Trainer,
    TrainPlan,
    shifted,
    turned,
)
from landing_systems.modules.detection_tphyolo.decoding import CHANNELS, cells_of
from landing_systems.modules.detection_tphyolo.patches import PATCH_PX, REACH

WHOLE = np.array([[0, 0, 128, 128]], np.float32)


def label(
    x: float, y: float, side: float, number: int = 0, *, hidden: float = 0.0, contrast: float = 90.0
) -> np.ndarray:
    labels = np.zeros((1, MAX_MARKERS, LABEL), np.float32)
    labels[0, 0] = (x, y, side, side, number, hidden, contrast, side)
    return labels


def painted(count: int, size: tuple[int, int], seed: int, number: int = 0) -> Samples:
    """Return pictures with a plain printed marker in each."""
    rng = np.random.default_rng(seed)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    code = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, 28))
    width, height = size
    images = np.full((count, height, width, 3), 150, np.uint8)
    labels = np.concatenate([label(0, 0, 28, number) for _ in range(count)])
    for image, row in zip(images, labels[:, 0], strict=True):
        x, y = rng.integers(4, width - 32), rng.integers(4, height - 32)
        image[y - 4 : y + 32, x - 4 : x + 32] = 240
        image[y : y + 28, x : x + 28] = code[..., None]
        row[:2] = x + 14, y + 14
    regions = np.tile(np.array([0, 0, width, height], np.float32), (count, 1))
    return Samples(images=images, labels=labels, regions=regions)


def test_the_network_is_small_and_answers_for_every_cell() -> None:
    model = TphYolo().eval()
    assert parameter_count(model) + parameter_count(IdentityNet()) < 500_000
    for height, width in ((128, 128), (240, 320)):
        answer = model(torch.zeros(1, 3, height, width))
        assert answer.shape == (1, CHANNELS, cells_of(width, height).shape[1])


def test_fusing_changes_nothing_but_rounding() -> None:
    torch.manual_seed(0)
    model = TphYolo()
    model(torch.rand(4, 3, 64, 64))  # moves the running means away from 0
    picture = torch.rand(1, 3, 64, 64)
    with torch.no_grad():
        assert torch.allclose(model.eval()(picture), fused(model)(picture), atol=1e-4)


def test_complete_iou_of_known_boxes() -> None:
    boxes = torch.tensor([[5.0, 5, 4, 4], [5.0, 5, 4, 4], [5.0, 5, 4, 4], [5.0, 5, 4, 4]])
    others = torch.tensor([[5.0, 5, 4, 4], [7.0, 5, 4, 4], [15.0, 5, 4, 4], [5.0, 5, 8, 4]])
    # Shifted by 2: IoU 8/24, hull 6 x 4, distance 2.  Apart by 10: IoU 0, hull 14 x 4.
    # Twice as wide: IoU 1/2 and an aspect term from atan(2) - atan(1).
    aspect = 4 / np.pi**2 * (np.arctan(2) - np.arctan(1)) ** 2
    expected = [1, 8 / 24 - 4 / 52, -100 / 212, 0.5 - aspect**2 / (0.5 + aspect)]
    assert complete_iou(boxes, others).tolist() == pytest.approx(expected, abs=1e-5)


def test_the_cells_about_a_marker_answer_for_it() -> None:
    targets = targets_of(label(62, 66, 16), WHOLE, 128, 128)
    grid = cells_of(128, 128)[:, targets.cells[:, 1]]
    assert np.abs(grid[:2] - [[62], [66]]).max() < 8
    assert set(grid[2]) == {4, 8}
    assert not targets.ignored.any()


def test_a_marker_cut_by_the_frame_is_answered_for_where_it_is_seen() -> None:
    targets = targets_of(label(-4, 64, 32), WHOLE, 128, 128)
    assert len(targets.cells) == 0  # three eighths are seen: too little
    assert targets.ignored.any()
    targets = targets_of(label(4, 64, 32), WHOLE, 128, 128)
    assert (targets.boxes[:, 0] == 4).all()  # the whole marker's centre
    assert (cells_of(128, 128)[0, targets.cells[:, 1]] > 0).all()


@pytest.mark.parametrize(("hidden", "contrast"), [(0.7, 90.0), (0.0, 3.0)])
def test_an_unreadable_marker_is_neither_marker_nor_ground(hidden: float, contrast: float) -> None:
    doubtful = label(62, 66, 16, hidden=hidden, contrast=contrast)
    targets = targets_of(doubtful, WHOLE, 128, 128)
    assert len(targets.cells) == 0
    raw = torch.zeros(1, CHANNELS, targets.ignored.shape[1])
    grid = torch.from_numpy(cells_of(128, 128).copy())
    raw[0, 4] = -30.0
    raw[0, 4, torch.from_numpy(targets.ignored[0])] = 30.0
    assert float(loss_of(raw, targets, grid, LossWeights())) < 1e-6


def test_the_loss_of_a_perfect_answer_is_nothing() -> None:
    targets = targets_of(label(62, 66, 16, 3), WHOLE, 128, 128)
    grid = cells_of(128, 128)
    raw = np.full((1, CHANNELS, grid.shape[1]), -30.0, np.float32)
    for cell in targets.cells[:, 1]:
        x, y, stride = grid[:, cell]
        size = np.log(16 / (4 * stride))
        raw[0, :, cell] = ((62 - x) / stride, (66 - y) / stride, size, size, 30.0)
    answer, places = torch.from_numpy(raw), torch.from_numpy(grid.copy())
    assert float(loss_of(answer, targets, places, LossWeights())) == pytest.approx(0, abs=1e-4)


def test_turning_turns_the_labels_with_the_picture() -> None:
    images = np.zeros((8, 128, 128, 3), np.uint8)
    images[:, 20:30, 40:60] = 255
    labels, regions = label(50, 25, 20), np.array([[8, 0, 128, 100]], np.float32)
    labels[0, 0, 3] = 10
    images, labels, regions = turned(
        np.random.default_rng(1), images, np.repeat(labels, 8, 0), np.repeat(regions, 8, 0)
    )
    assert len({tuple(row[0, :2]) for row in labels}) == 4
    for image, row, region in zip(images, labels[:, 0], regions, strict=True):
        ys, xs = np.nonzero(image[..., 0])
        assert (xs.min() + xs.max() + 1) / 2 == row[0]
        assert (ys.min() + ys.max() + 1) / 2 == row[1]
        assert (np.ptp(xs) + 1, np.ptp(ys) + 1) == (row[2], row[3])
        assert (region[2] - region[0]) * (region[3] - region[1]) == 120 * 100


def test_shifting_keeps_labels_on_their_markers() -> None:
    samples = painted(6, (CROP_PX, CROP_PX), 2)
    images, labels, _ = shifted(
        np.random.default_rng(0), samples.images, samples.labels, samples.regions, 128
    )
    for image, row in zip(images, labels[:, 0], strict=True):
        x, y = (int(value) for value in row[:2])
        if 14 <= x < 114 and 14 <= y < 114:
            assert image[y - 14, x - 14, 0] == 0  # the black border's corner
            assert image[y - 15, x - 15, 0] == 240


@pytest.mark.long
def test_a_few_steps_of_training_lower_the_loss_and_go_on_where_they_stopped(
    tmp_path: Path,
) -> None:
    crops, frames = painted(12, (CROP_PX, CROP_PX), 0), painted(2, (320, 240), 1)
    plan = TrainPlan(steps=20, warm_up=5, crops=4, frames=1, frame_share=0.1)
    torch.set_num_threads(1)
    trainer = Trainer(plan, [crops], [frames])
    losses = [trainer.advance() for _ in range(16)]
    assert np.mean(losses[-4:]) < 0.85 * np.mean(losses[:4])
    trainer.save(tmp_path / "half.pt")
    rest = [trainer.advance() for _ in range(4)]
    again = Trainer(plan, [crops], [frames])
    assert again.load(tmp_path / "half.pt")
    assert [again.advance() for _ in range(4)] == pytest.approx(rest, rel=1e-3)


def test_cuttings_hold_the_marker_that_their_class_names() -> None:
    shards = [painted(3, (CROP_PX, CROP_PX), seed, number) for seed, number in enumerate(range(5))]
    plan = IdentityPlan(patches=40, shift=0.0, resize=0.0)
    patches, classes = PatchSampler(shards, plan).draw(np.random.default_rng(0))
    assert set(classes) == set(range(OTHER + 1))
    cell, middle = PATCH_PX / REACH / 7, PATCH_PX / 2
    for cut, number in zip(patches, classes, strict=True):
        if number < OTHER:
            # The border's middles are black and the margin is white, however it is turned.
            around = np.linspace(0, 2 * np.pi, 90)
            ring = [
                cut[int(middle + 3 * cell * np.sin(a)), int(middle + 3 * cell * np.cos(a)), 0]
                for a in around
            ]
            assert min(ring) < 60
            assert cut.max() > 200


def test_reading_ids_is_learned() -> None:
    shards = [painted(3, (CROP_PX, CROP_PX), seed, number) for seed, number in enumerate(range(5))]
    losses: list[float] = []
    torch.set_num_threads(1)
    train_identity(IdentityPlan(steps=20, patches=24), shards, lambda _, loss: losses.append(loss))
    assert np.mean(losses[-4:]) < 0.95 * np.mean(losses[:4])
