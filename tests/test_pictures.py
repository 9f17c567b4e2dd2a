"""Pictures in the repository: from a JPEG to its curve, by a colour and by the commands, on every machine.

They are rendered by `dloftbs_lab.synthetic.RgbSequence`, 360 x 480: frame 3 of *plain* with seed 5, frame 40 of *thick*
with seed 5, frame 70 of *self-intersection, occluded* with seed 6. Beside each lie the points of its true curve.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cli.cli_inputs import run

import dloftbs
from dloftbs_lab import open_labelled
from dloftbs_lab.evaluation import curve_l3

PICTURES = Path(__file__).parent / "data" / "pictures"
BLUE, RED = "99:113,120:255,45:255", "163:175,120:255,45:255"
COLOURS = {"plain": BLUE, "loop": BLUE, "thick": RED}


def off_px(found: dloftbs.BSplineCurve, true: dloftbs.BSplineCurve) -> float:
    return min(curve_l3(one, true) for one in (found, found.reversed()))


@pytest.mark.parametrize("name", COLOURS)
def test_the_curve_of_a_picture_is_found_by_its_colour(name: str) -> None:
    sequence = open_labelled(PICTURES)
    (index,) = [index for index, frame in enumerate(sequence) if Path(frame.name).stem == name]
    (found,) = dloftbs.detect(sequence.frame(index).image, hsv=COLOURS[name])
    assert off_px(found.curve, sequence.truth(index).curves[0]) < 2.0


def test_the_loop_crosses_itself_once_and_goes_on_below_the_arm() -> None:
    (source,) = dloftbs.sources.open(PICTURES / "loop.jpg")
    result = dloftbs.detect(source.image, hsv=BLUE)
    (found,) = result
    assert len(result.crossings) == 1
    assert len(found.inferred) == 1


def test_the_command_writes_the_curve_of_a_picture(tmp_path: Path) -> None:
    run("detect", PICTURES / "thick.jpg", "--hsv", RED, "--out", tmp_path / "curves.jsonl")
    (row,) = dloftbs.sinks.read_json_lines(tmp_path / "curves.jsonl")
    (found,) = dloftbs.FrameResult.from_dict(row).detections
    truth = json.loads((PICTURES / "thick.json").read_text())["curves"][0]
    ends = found.curve.sample(2)
    assert min(abs(ends[k] - truth[j]).max() for k in (0, 1) for j in (0, -1)) < 6.0
