"""``dloftbs diagnose``: a page of text on what is wrong with a stream."""

from __future__ import annotations

import numpy as np
import pytest
from cli.cli_inputs import RED, mask, photo, run, save

from dloftbs import Config, Frame, Pipeline
from dloftbs.cli.diagnosis import Diagnosis
from dloftbs.cli.stream_report import RunReport

SIZE = (100, 200)


def findings(page: str) -> list[str]:
    """Return the findings of a page."""
    _, _, listed = page.partition("\nfindings\n")
    return [line.split(". ", 1)[1] for line in listed.splitlines()]


def noisy(frames: int) -> np.ndarray:
    """Return depth as counts of 0.1 mm, as a camera measures 0.9 m."""
    return np.random.default_rng(0).normal(9000.0, 3.0, (frames, *SIZE)).astype(np.uint16)


def test_a_stream_in_order_has_no_findings(tmp_path):
    for i in range(12):
        save(tmp_path / "in" / f"{i}.png", photo(40 + i))
    page = run("diagnose", tmp_path / "in", "--hsv", RED, "--fps", 10).stdout
    lines = page.splitlines()
    assert lines[0] == f"source     {tmp_path / 'in'}"
    assert lines[1] == "           200 x 100 px; image; 10 frames/s, 12 in all; stamps 100 ms apart"
    assert lines[2:4] == ["mask       4 % set", "objects    1 in 12 frames; 5 px wide"]
    assert lines[4].startswith("frames     12, 0 skipped")
    assert lines[5] == "tracks     1 confirmed"
    assert any(line.startswith("pipeline  ") for line in lines)
    assert lines[-1] == "findings   none: if curves are wrong, --stages FOLDER draws the least sure frames"


def test_what_is_wrong_in_most_frames_comes_first_and_the_worst_frames_are_drawn(tmp_path):
    stack = np.stack([mask(30 + i) for i in range(20)])
    stack[10] = 0
    np.save(tmp_path / "masks.npy", stack)
    np.save(tmp_path / "depth.npy", noisy(20))
    given = "--depth", tmp_path / "depth.npy", "--camera", "200,200,100,50", "--fps", 30
    result = run("diagnose", tmp_path / "masks.npy", *given, "--stages", tmp_path / "stages")
    first, second = findings(result.stdout)
    assert first.startswith("a cable of 5 px would be ")
    assert first.endswith("(--depth-unit 0.0001), or check the camera's focal length (19 of 20 frames)")
    assert second.startswith(
        "nothing found in 1 of 20 frames: the mask is empty, after 4 %: the segmentation has failed"
    )
    assert "mask and depth (uint16, counts of 0.001 m)" in result.stdout
    assert "m, median 9 m; known in 100 % of the pixels, 100 % along the cables" in result.stdout
    assert "mm thick at 9" in result.stdout
    assert len(list((tmp_path / "stages").glob("*.png"))) == 3
    assert result.stderr.splitlines()[-1].startswith(f"{tmp_path / 'stages'}: the stages of frame ")
    assert "frame 10" in result.stderr.splitlines()[-1]


def test_counts_of_a_tenth_of_a_millimetre_are_nothing_to_report(tmp_path):
    np.save(tmp_path / "masks.npy", np.stack([mask(30 + i) for i in range(3)]))
    np.save(tmp_path / "depth.npy", noisy(3))
    given = "--depth", tmp_path / "depth.npy", "--camera", "200,200,100,50", "--fps", 30
    assert findings(run("diagnose", tmp_path / "masks.npy", *given, "--depth-unit", 0.0001).stdout) == []


def test_an_inverted_mask_is_named(tmp_path):
    np.save(tmp_path / "masks.npy", np.stack([255 - mask(30 + i) for i in range(4)]))
    told = findings(run("diagnose", tmp_path / "masks.npy", "--fps", 30).stdout)
    assert told == [
        "nothing found in all frames: 96 % of the mask is set, and cables cover at most 60 %: "
        "if it is inverted, turn it round (mask == 0); if it is a photograph or scores, threshold it"
    ]


def test_no_depth_on_the_cables_is_named(tmp_path):
    stack = np.stack([mask(30 + i) for i in range(4)])
    np.save(tmp_path / "masks.npy", stack)
    np.save(tmp_path / "depth.npy", np.where(stack > 0, 0, 900).astype(np.uint16))
    given = "--depth", tmp_path / "depth.npy", "--camera", "200,200,100,50", "--fps", 30
    page = run("diagnose", tmp_path / "masks.npy", *given).stdout
    assert "known in 93.8 % of the pixels, 1.23 % along the cables" in page
    assert findings(page)[0].startswith("no curve in space, 4 times: ")


def test_a_soft_mask_and_one_that_is_half_full_are_named(tmp_path):
    soft = np.clip(np.repeat(np.arange(200.0)[None], 100, axis=0) * 1.3, 0, 255).astype(np.uint8)
    soft[:, 20:180] = np.where(soft[:, 20:180] > 128, 255, 0)
    half = mask(30)
    half[52:] = 255
    half[:6] = 255
    np.save(tmp_path / "half.npy", half[None])
    told = findings(run("diagnose", tmp_path / "half.npy").stdout)
    assert any(one.startswith("58 % of the mask is set: inverted") for one in told)
    np.save(tmp_path / "soft.npy", soft[None])
    told = findings(run("diagnose", tmp_path / "soft.npy").stdout)
    assert any(one.startswith("the mask has many grey values (all frames)") for one in told)


def test_a_frozen_camera_is_named_and_masks_that_stay_are_not(tmp_path):
    for i in range(6):
        save(tmp_path / "in" / f"{i}.png", photo(50))
    told = findings(run("diagnose", tmp_path / "in", "--hsv", RED).stdout)
    assert told == [
        "5 of 6 frames have the image of the frame before, to the last bit: is the camera frozen, or does a "
        "recording repeat frames?",
        "the frames have no stamps, and are taken for 30 per second: state it by --fps RATE",
    ]
    np.save(tmp_path / "masks.npy", np.stack([mask(50)] * 6))
    assert findings(run("diagnose", tmp_path / "masks.npy", "--fps", 30).stdout) == []


def test_frames_that_differ_and_share_a_stamp_are_named():
    report = RunReport()
    diagnosis = Diagnosis(report, Config().lifting)
    pipeline = Pipeline()
    for i, row in enumerate((30, 40, 40)):
        frame = Frame(mask=mask(row), index=i, stamp=1.0)
        result = pipeline.process(frame)
        report.add(result)
        diagnosis.add(frame, pipeline.mask, result)
    assert diagnosis.findings(None) == [
        "frame 1 to 2 differs from the one before it and has the same stamp, 1 s; such frames are taken for "
        "repetitions and get the result before them: give stamps in float64 that are not rounded, or the rate (fps, "
        "--fps) (2 of 3 frames)"
    ]


def test_the_first_frames_are_looked_at(tmp_path):
    path = tmp_path / "masks.npy"
    np.save(path, np.stack([mask(20 + i) for i in range(60)]))
    assert "\nframes     50, " in run("diagnose", path).stdout
    assert "\nframes     3, " in run("diagnose", path, "--limit", 3).stdout


@pytest.mark.parametrize("name", ["missing.npy", "in"])
def test_an_input_that_cannot_be_read_is_bad_input(tmp_path, name):
    (tmp_path / "in").mkdir()
    save(tmp_path / "in" / "0.png", photo())
    (tmp_path / "in" / "0.png").write_bytes(b"\x89PNG no picture")
    result = run("diagnose", tmp_path / name, "--hsv", RED, code=1)
    assert result.stdout == ""
    assert "error: " in result.stderr


def test_figures_replace_no_input(tmp_path):
    path = save(tmp_path / "mask.png", mask())
    refused = run("diagnose", path, "--stages", path, code=2)
    assert "would replace the input" in refused.stderr
