"""The option --roi of the commands."""

import json

import cv2
import numpy as np
import pytest
import yaml
from cli.cli_inputs import RED, mask, photo, run, save

from dloftbs import ColourModel, Config
from dloftbs.sinks import read_json_lines

ROI = "20,30,120,50"


def clutter(y=50):
    """A red cable, and red all over the lower half."""
    image = photo(y)
    image[70:] = (0, 0, 255)
    image[:20] = (0, 0, 255)
    return image


@pytest.mark.parametrize(
    ("roi", "kept"),
    [(ROI, [20, 30, 120, 40]), ("20,30:139,30:139,69:20,69", [[20, 30], [139, 30], [139, 69], [20, 69]])],
)
def test_detect_reads_it_alone(tmp_path, roi, kept):
    roi = roi.replace("120,50", "120,40")
    path, overlay = save(tmp_path / "photo.png", clutter()), tmp_path / "overlay.png"
    out, stages = tmp_path / "curves.jsonl", tmp_path / "stages.png"
    run("detect", path, "--hsv", RED, "--roi", roi, "--out", out, "--overlay", overlay, "--stages", stages)
    (row,) = read_json_lines(out)
    assert (row["size"], row["roi"]) == ([100, 200], kept)
    (found,) = row["detections"]
    x = [point[0] for point in found["curve"]["control_points"]]
    assert min(x) == pytest.approx(20, abs=2)
    assert max(x) == pytest.approx(139, abs=2)
    assert cv2.imread(str(overlay)).shape == (100, 200, 3)
    assert stages.exists()
    written = Config.from_file(tmp_path / "curves.config.yaml").region.roi
    assert json.loads(json.dumps(written)) == kept
    again = tmp_path / "again.jsonl"
    run("detect", path, "--config", tmp_path / "curves.config.yaml", "--out", again)
    assert [row["detections"] for row in read_json_lines(again)] == [row["detections"]]


def test_track_and_batch_read_it_alone(tmp_path):
    for number in range(4):
        save(tmp_path / "in" / f"{number}.png", clutter(45 + number))
    run("track", tmp_path / "in", "--hsv", RED, "--roi", "20,30,120,40", "--out", tmp_path / "curves.jsonl")
    rows = list(read_json_lines(tmp_path / "curves.jsonl"))
    assert [[track["id"] for track in row["tracks"]] for row in rows] == [[1]] * 4
    assert rows[-1]["tracks"][0]["ends"] == ["border", "border"]
    common = ("--hsv", RED, "--roi", "20,30,120,40", "--out", tmp_path / "results", "--jobs", 1)
    run("batch", tmp_path / "in", *common)
    (result,) = (tmp_path / "results").rglob("*.jsonl")
    assert [row["roi"] for row in read_json_lines(result)] == [[20, 30, 120, 40]] * 4
    changed = run("batch", tmp_path / "in", *common[:3], "20,30,100,40", *common[4:])
    assert "done again" in changed.stderr
    assert [row["roi"] for row in read_json_lines(result)] == [[20, 30, 100, 40]] * 4


@pytest.mark.parametrize(
    ("text", "said"),
    [("1,2,3", "X,Y,W,H"), ("1,2,0,9", "at least 1 px"), ("0,0:9,9:9,0:0,9", "cross or overlap"), ("all", "X,Y,W,H")],
)
def test_a_wrong_one_is_bad_usage(tmp_path, text, said):
    result = run("detect", save(tmp_path / "a.png", mask()), "--roi", text, code=2)
    assert "--roi" in result.stderr
    assert said in result.stderr


def test_frames_that_it_does_not_hold_for_are_skipped_with_a_word(tmp_path):
    save(tmp_path / "in" / "0.png", mask(20, (60, 90)))
    save(tmp_path / "in" / "1.png", mask(40, (100, 200)))
    save(tmp_path / "in" / "2.png", mask(22, (60, 90)))
    out = tmp_path / "curves.jsonl"
    result = run("track", tmp_path / "in", "--kind", "mask", "--roi", "10,5,70,40", "--out", out, code=1)
    assert [row["index"] for row in read_json_lines(out)] == [0, 2]
    assert "1.png" in result.stderr
    assert "holds for (60, 90)" in result.stderr
    result = run("detect", tmp_path / "in" / "0.png", "--roi", "10,5,90,40", code=1)
    assert "roi must lie within the image of 90 x 60 px" in result.stderr


def test_it_comes_after_a_file_and_a_setting(tmp_path):
    (tmp_path / "cable.yaml").write_text("region: {roi: '1,2,30,40'}\n")
    path = save(tmp_path / "a.png", mask())
    given = ("detect", path, "--config", tmp_path / "cable.yaml")
    rois = [json.loads(run(*given, *more).stdout)["roi"] for more in ((), ("--set", "region.roi=2,3,40,50"))]
    rois.append(json.loads(run(*given, "--set", "region.roi=null", "--roi", "5,6,70,80").stdout)["roi"])
    assert rois == [[1, 2, 30, 40], [2, 3, 40, 50], [5, 6, 70, 80]]
    assert json.loads(run(*given, "--set", "region.roi=null").stdout)["roi"] is None


def test_a_colour_is_learned_in_it(tmp_path):
    image = photo(50)
    image[80:] = (10, 10, 250)  # a red table, which would be ground
    path, out = save(tmp_path / "photo.png", image), tmp_path / "cable.yaml"
    overlay = tmp_path / "mask.png"
    result = run(*("colour", path, "--at", "60,50:120,50", "--roi", "10,20,180,50", "--out", out, "--overlay", overlay))
    settings = yaml.safe_load(out.read_text())
    assert settings["region"] == {"roi": [10, 20, 180, 50]}
    shown = cv2.imread(str(overlay))
    assert np.array_equal(shown[80:], image[80:])  # nothing is cable there
    found = ColourModel(Config.from_file(out).segmentation.colour)(image[20:70, 10:190])
    assert (found != (image[20:70, 10:190] == (0, 0, 255)).all(axis=2)).mean() < 0.002
    assert f"{100 * found.mean():.1f} % of the picture is cable" in result.stderr
    run("detect", path, "--config", out, "--out", tmp_path / "curves.jsonl")
    (row,) = read_json_lines(tmp_path / "curves.jsonl")
    assert len(row["detections"]) == 1
    more = run("colour", path, "--at", "70,50:110,50", "--config", out)  # the region is kept
    assert yaml.safe_load(more.stdout)["region"] == {"roi": [10, 20, 180, 50]}
