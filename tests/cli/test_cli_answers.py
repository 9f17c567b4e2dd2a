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
    assert len(json.loads(said.stdout)["detections"]) == 1
    assert "expected a radius in metres" in run("detect", source, "--min-bend-radius", "x", code=2).stderr


@pytest.mark.parametrize("command", ["detect", "track"])
def test_a_limit_in_metres_names_frames_without_curves_in_space_and_goes_on(tmp_path, command):
    (tmp_path / "camera.json").write_text('{"fx": 400, "fy": 400, "cx": 199.5, "cy": 99.5}')
    masks, depth = tmp_path / "masks", tmp_path / "depth"
    for number, unit in enumerate((0, 0, 1)):
        save(masks / f"{number}.png", bent())
        save(depth / f"{number}.png", unit * np.where(bent() > 0, 800, 900).astype(np.uint16))
    options = "--kind", "mask", "--depth", depth, "--min-bend-radius", "10"
    said = run(command, masks, *options, "--camera", tmp_path / "camera.json")
    assert said.stderr.count("cannot be compared with 10000 mm") == 1
    assert "below 10000 mm" in said.stderr
    said = run(command, masks, *options, code=1)
    assert said.stderr.count("warning: frame 0: the bend of") == 1
    assert "no bend could be compared with the least radius 10000 mm, which is in metres" in said.stderr
    assert len(said.stdout.splitlines()) == 3


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
