"""Answers on request: limits of bends, shapes and deviations beside the curves."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from cli.cli_inputs import RED, mask, run, save


def bent():
    pixels = np.zeros((200, 400), np.uint8)
    cv2.ellipse(pixels, (200, 150), (90, 90), 0, 180, 360, 255, 9)
    return pixels


@pytest.mark.parametrize("command", ["detect", "track"])
def test_a_bend_below_the_limit_is_a_warning_a_column_and_a_mark(tmp_path, command):
    source = save(tmp_path / "in" / "a.png", bent())
    outputs = "--out", tmp_path / "a.csv", "--overlay", tmp_path / f"{command}.png"
    said = run(command, source, "--kind", "mask", "--min-bend-radius", "100px", *outputs)
    assert "warning: frame 0: " in said.stderr
    assert ", below 100 px" in said.stderr
    header, *rows = (tmp_path / "a.csv").read_text().splitlines()
    assert header.endswith(",bend_radius_px,bend_radius_m")
    radii = [float(row.split(",")[-2]) for row in rows]
    assert 80.0 < np.median(radii) < 100.0
    marked = cv2.imread(str(tmp_path / f"{command}.png"))
    run(command, source, "--kind", "mask", "--overlay", tmp_path / "plain.png")
    assert (marked != cv2.imread(str(tmp_path / "plain.png"))).any()


def test_a_limit_in_metres_needs_depth(tmp_path):
    source = save(tmp_path / "a.png", bent())
    said = run("detect", source, "--kind", "mask", "--min-bend-radius", "0.03", code=1)
    assert "give depth and a camera, or a radius in pixels" in said.stderr
    assert "expected a radius in metres" in run("detect", source, "--min-bend-radius", "x", code=2).stderr


def test_answers_are_keys_of_the_lines(tmp_path):
    source = save(tmp_path / "a.png", mask())
    (one,) = json.loads(run("detect", source, "--kind", "mask", "--with", "shape,std").stdout)["detections"]
    assert one["shape"]["length_px"] == pytest.approx(160.0, rel=0.05)
    assert max(one["std"]["px"]) < 1.0
    said = run(
        "detect",
        source,
        "--kind",
        "mask",
        "--with",
        "std",
        "--overlay",
        tmp_path / "o.png",
        "--out",
        tmp_path / "a.npz",
        code=2,
    )
    assert "--with goes with JSON lines" in said.stderr
    assert "answers are topology, shape, std" in run("detect", source, "--hsv", RED, "--with", "knots", code=2).stderr
