"""Faults that a cleaned mask still has, and settings that do remove them."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs.config import CleaningConfig
from dloftbs.pipeline.mask_faults import MaskSamples

SIZE = (160, 300)
CABLE = (draw_cable(wave(SIZE), 12, SIZE) != 0).astype(np.uint8)
ROWS = np.array([np.flatnonzero(CABLE[:, x])[[0, -1]] for x in range(40, 260)])


def with_specks(side: int) -> np.ndarray:
    mask = CABLE.copy()
    for x in range(20, 280, 20):
        mask[8 : 8 + side, x : x + side] = mask[140 : 140 + side, x : x + side] = 1
    return mask


def with_holes(side: int) -> np.ndarray:
    mask = CABLE.copy()
    for x in range(0, 220, 20):
        middle = int(ROWS[x].mean())
        cv2.rectangle(mask, (40 + x, middle), (40 + x + side - 1, middle + side - 1), 0, -1)
    return mask


def with_threads() -> np.ndarray:
    """Return a straight cable that has threads of 1 px beside it, a slit of 2 px away, held at one end."""
    mask = np.zeros(SIZE, np.uint8)
    mask[70:82, 20:280] = 1
    for first in range(40, 260, 50):
        mask[67, first : first + 36] = 1
        mask[67:70, first] = 1
    return mask


def yaml_of(value: str) -> object:
    return value == "true" if value.isalpha() else int(value)


def samples_of(mask: np.ndarray, config: CleaningConfig) -> MaskSamples:
    samples = MaskSamples(config)
    for count in (1, 2):
        samples.add(mask, dloftbs.detect(CABLE).detections, count)
    return samples


KEEPS_THREADS = CleaningConfig(open_px=1, close_px=1, thin_px=0)
FAULTS = {
    "specks of 4 px": (with_specks(4), CleaningConfig(), r"25 specks of about 4 px", ["open_px=5"]),
    "specks of 6 px": (with_specks(6), CleaningConfig(), r"25 specks of about 6 px", ["open_px=7", "thin_px=0"]),
    "holes": (with_holes(4), CleaningConfig(fill_holes=False), r"11 holes of about 4 px", ["fill_holes=true"]),
    "threads": (with_threads(), KEEPS_THREADS, "5 threads along edges of about 36 px", ["open_px=3"]),
}


@pytest.mark.parametrize(("mask", "config", "seen", "settings"), FAULTS.values(), ids=FAULTS)
def test_faults_are_counted_and_the_settings_remove_them(mask, config, seen, settings) -> None:
    told = samples_of(mask, config).describe()
    assert told is not None
    assert re.search(seen, told), told
    named = re.findall(r"--set (cleaning\.\w+)=(\w+)", told)
    assert [f"{name}={value}" for name, value in named] == [f"cleaning.{one}" for one in settings]
    changed = dloftbs.Config(cleaning=config).replace({name: yaml_of(value) for name, value in named})
    assert len(dloftbs.detect(mask, config=changed)) == 1
    assert samples_of(mask, changed.cleaning).describe() is None


@pytest.mark.parametrize("config", [CleaningConfig(), CleaningConfig(fill_holes=False, thin_px=0)])
def test_a_clean_mask_has_none(config: CleaningConfig) -> None:
    assert samples_of(CABLE, config).describe() is None


def test_a_setting_that_would_take_the_cable_is_not_named() -> None:
    thin = (draw_cable(wave(SIZE), 4, SIZE) != 0).astype(np.uint8)
    thin[140:143, 20:280:20] = thin[141, 21:280:20] = 0
    for x in range(20, 280, 20):
        thin[140:143, x : x + 3] = 1
    samples = MaskSamples(CleaningConfig(thin_px=0))
    for count in (1, 2):
        samples.add(thin, dloftbs.detect(thin).detections, count)
    told = samples.describe()
    assert told == "in a frame, 13 specks of about 3 px"


def test_only_frames_in_which_the_number_changes_are_kept() -> None:
    samples = MaskSamples(CleaningConfig())
    for _ in range(3):
        samples.add(with_specks(4), dloftbs.detect(CABLE).detections, 1)
    assert samples.describe() is None
