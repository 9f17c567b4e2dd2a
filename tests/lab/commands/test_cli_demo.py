import html
import json
import math
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from builders import line
from cli.cli_inputs import run

from dloftbs.api import detect
from dloftbs.config import Config
from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.sinks import read_json_lines
from dloftbs_lab.commands.demo_run import STYLE
from dloftbs_lab.commands.demo_space import SpaceRun
from dloftbs_lab.commands.scoring import CableScore, FrameScore, Scores, score_frame
from dloftbs_lab.synthetic import rgbd_artificial
from dloftbs_lab.synthetic.studio import DYES
from dloftbs_lab.truth import Truth

FRAMES = 14


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "new"
    result = run("demo", "--quick", "--out", folder, "--frames", FRAMES, "--size", "480x270", "--seed", 1)
    (folder / "printed").write_text(result.stdout)
    return folder


def test_the_folder_holds_what_its_readme_says(folder):
    readme = (folder / "README.txt").read_text()
    for file in folder.iterdir():
        assert file.name in readme or file.name == "printed"
    assert (folder / "printed").read_text() in readme


def test_the_page_shows_the_files_and_the_figures_and_its_commands_are_there(folder):
    page = (folder / "index.html").read_text()
    assert {name for name in re.findall(r'(?:src|href)="([^"]+)"', page) if not (folder / name).is_file()} == set()
    for row in (folder / "printed").read_text().splitlines():
        assert html.escape(row[24:]) in page
    commands = re.findall(r"^dloftbs (\w+) (\S+)", html.unescape(page), re.MULTILINE)
    assert [verb for verb, _ in commands] == ["view", "track", "detect", "tune", "track"]
    assert all((folder / source).is_file() for _, source in commands[:3])


def test_the_overlay_is_far_from_the_colours_beneath():
    dyes = np.array(DYES)
    for curve, dye in zip(STYLE.palette, dyes, strict=True):
        assert np.abs(np.array(curve) - dye).max() > 120


def test_the_videos_play(folder):
    for name in ("input.mp4", "overlay.mp4"):
        video = cv2.VideoCapture(str(folder / name))
        assert video.get(cv2.CAP_PROP_FRAME_COUNT) == FRAMES
        read, picture = video.read()
        video.release()
        assert read
        assert picture.shape == (270, 480, 3)


def test_the_sheet_has_a_dozen_frames(folder):
    sheet = cv2.imread(str(folder / "contact_sheet.png"))
    assert sheet.shape[1] / sheet.shape[0] == pytest.approx(4 * 16 / (3 * 9), rel=0.1)


def test_the_figures_are_those_of_the_curves(folder):
    summary = json.loads((folder / "summary.json").read_text())
    rows = list(read_json_lines(folder / "curves.jsonl"))
    assert summary["frames"] == len(rows) == FRAMES
    seen = [sum(track["state"] != "hidden" for track in row["tracks"]) for row in rows]
    assert [frame["curves"] for frame in summary["per_frame"]] == seen
    right = sum(count == 2 for count in seen)
    assert summary["frames_with_the_right_number_of_curves"] == right
    missing = [sum(frame["cables"][i]["track_id"] is None for frame in summary["per_frame"]) for i in (0, 1)]
    assert summary["frames_without_a_curve_for_a_cable"] == missing
    assert 0.0 < summary["l1_px"]["mean"] < 20.0
    for cable, config in enumerate(summary["configs"], start=1):
        assert Config.from_dict(config) == Config.from_file(folder / f"cable_{cable}.config.yaml")


def test_the_command_in_the_readme_gives_the_same_curves(folder):
    found = []
    for cable in (1, 2):
        again = folder.parent / f"again_{cable}.jsonl"
        run("track", folder / "input.mp4", "--config", folder / f"cable_{cable}.config.yaml", "--out", again)
        found.append([row["detections"] for row in read_json_lines(again)])
    both = [row["detections"] for row in read_json_lines(folder / "curves.jsonl")]
    assert both == [first + second for first, second in zip(*found, strict=True)]


def test_the_curves_in_space_are_written_in_every_form(folder):
    rows = list(read_json_lines(folder / "space" / "curves.jsonl"))
    summary = json.loads((folder / "summary.json").read_text())["in_space"]
    assert summary["frames"] == len(rows) == FRAMES // 3
    assert summary["frames_without_a_curve"] == sum(row["detections"][0]["curve_3d"] is None for row in rows)
    assert len(list((folder / "space" / "curves").glob("*.ply"))) == len(rows)
    assert (folder / "space" / "curves.csv").read_text().count("\n") == 1 + 100 * sum(
        len(row["tracks"]) for row in rows
    )
    assert cv2.imread(str(folder / "space.png")).shape[1] > 2 * 640
    assert Config.from_file(folder / "space" / "curves.config.yaml").segmentation.hsv


def test_the_command_in_the_readme_gives_the_same_curve_in_space(folder, monkeypatch):
    (command,) = [x for x in (folder / "README.txt").read_text().splitlines() if "dloftbs detect" in x]
    monkeypatch.chdir(folder)
    run(*command.split()[1:], "--out", "cable.jsonl")
    (again,) = read_json_lines(folder / "cable.jsonl")
    meshes = [folder / "cable.ply", next((folder / "space" / "curves").glob(f"*{FRAMES // 3 // 2:06d}.ply"))]
    assert all(mesh.read_bytes().startswith(b"ply\n") for mesh in meshes)
    for name in ("cable.ply", "cable.jsonl", "cable.config.yaml"):
        (folder / name).unlink()
    rows = list(read_json_lines(folder / "space" / "curves.jsonl"))
    assert again["detections"] == rows[len(rows) // 2]["detections"]


def axis(shift_m=0.0, scale=1.0):
    return line((0.0, 0.0, 0.8), (0.4, 0.0, 0.8)).transformed(
        scale * np.eye(3), (0.0, 0.0, (1 - scale) * 0.8 + shift_m)
    )


def in_space(*curves, reason=None):
    flat = detections(30)[0]
    return found(*(replace(flat, curve_3d=curve, no_3d_reason=reason) for curve in curves))


def in_space_run(*results):
    truth = Truth((detections(30)[0].curve,), (), (0,), (axis(),))
    scores = SpaceRun(rgbd_artificial(0.01, 0, (180, 320))[1])
    for result in results:
        tracks = tuple(replace(track, curve_3d=track.detection.curve_3d) for track in result.tracks)
        scores.score(replace(result, tracks=tracks), truth)
    return scores


def test_in_space_the_truth_scores_nothing_and_a_shift_its_size():
    figures = in_space_run(in_space(axis())).to_dict()
    assert (figures["l3_mm"]["worst"], figures["length_error"]["worst"]) == (0.0, 0.0)
    figures = in_space_run(in_space(axis()), in_space(axis(shift_m=0.003))).to_dict()
    assert figures["l3_mm"] == pytest.approx({"mean": 1.5, "median": 1.5, "worst": 3.0})
    assert in_space_run(in_space(axis(scale=1.05))).to_dict()["length_error"]["mean"] == pytest.approx(0.05)


def test_a_frame_without_a_curve_in_space_is_counted_with_its_reason():
    scores = in_space_run(in_space(axis()), in_space(None, reason="no depth there"))
    figures = scores.to_dict()
    assert (figures["frames"], figures["frames_without_a_curve"]) == (2, 1)
    assert figures["l3_mm"]["mean"] == 0.0
    assert ("without a curve there", "1 frames: no depth there") in scores.rows()
    empty = in_space_run(in_space(None, reason="no depth there"))
    assert dict(empty.rows())["L3, curve to true axis"] == "no curve at all"


def test_a_size_too_small_is_bad_input(tmp_path):
    result = run("demo", "--out", tmp_path, "--size", "20x20", code=1)
    assert result.stderr.startswith("error: ")


def bars(*rows):
    masks = []
    for row in rows:
        mask = np.zeros((100, 200), bool)
        mask[row - 2 : row + 3, 20:180] = True
        masks.append(mask)
    return masks


def scene(*rows):
    masks = bars(*rows)
    curves = tuple(detect(mask)[0].curve for mask in masks)
    return Truth(curves, tuple(masks), tuple(range(len(rows))))


def found(*detections: Detection, ids=None):
    tracks = [
        Track(i, TrackState.CONFIRMED, d.curve, None, 1, 0, d)
        for i, d in zip(ids or range(1, len(detections) + 1), detections, strict=True)
    ]
    return FrameResult(detections, tuple(tracks), None, (100, 200), index=3)


def detections(*rows):
    return [detect(mask)[0] for mask in bars(*rows)]


def test_the_truth_itself_scores_best():
    score = score_frame(found(*detections(30, 60)), scene(30, 60))
    assert (score.index, score.curves) == (3, 2)
    assert score.l1_px == pytest.approx(5 / 4, abs=0.2)  # a quarter of the width
    assert score.l2_px < 0.5
    assert [cable.l3_px for cable in score.cables] == pytest.approx([0.0, 0.0])


def test_each_cable_gets_the_curve_that_fits_it():
    score = score_frame(found(*detections(62, 31), ids=(7, 9)), scene(30, 60))
    assert [cable.track_id for cable in score.cables] == [9, 7]
    assert [cable.l3_px for cable in score.cables] == pytest.approx([1.0, 2.0], abs=0.05)


def test_a_cable_without_a_curve_is_missing_and_not_in_the_mean():
    scores = Scores(2)
    scores.add(score_frame(found(*detections(60)), scene(30, 60)))
    scores.add(replace(score_frame(found(), scene(30, 60)), index=4))
    figures = scores.to_dict()
    assert figures["frames_without_a_curve_for_a_cable"] == [2, 1]
    assert figures["l3_px"]["worst"] == pytest.approx(0.0)
    assert figures["l1_px"]["mean"] > 5.0  # the pixels of the missing one count
    assert math.isnan(scores.frames[1].l1_px)


def test_tracks_that_coast_do_not_count():
    seen = found(*detections(30))
    hidden = tuple(replace(track, detection=None, state=TrackState.HIDDEN) for track in seen.tracks)
    score = score_frame(replace(seen, detections=(), tracks=hidden), scene(30))
    assert score.curves == 0
    (cable,) = score.cables
    assert (cable.track_id, math.isnan(cable.l3_px)) == (None, True)


def test_nothing_at_all_has_no_figures():
    scores = Scores(1)
    scores.add(score_frame(found(), scene(30)))
    assert scores.to_dict()["l3_px"] == {"mean": None, "median": None, "worst": None}


def test_ids_and_turns_are_counted():
    scores = Scores(1)
    seen = [(1, True), (1, False), (2, True), (None, True), (2, True), (2, False)]
    for i, (track_id, forward) in enumerate(seen):
        scores.add(FrameScore(i, 1, 1.0, 1.0, (CableScore(track_id, 1.0 + i, forward),)))
    figures = scores.to_dict()
    assert figures["ids_of_each_cable"] == [2]
    assert figures["turned_around"] == 2
    assert figures["worst_frame"] == 5


def test_a_curve_run_backwards_scores_the_same():
    forward, backward = (
        score_frame(found(d), scene(30)).cables[0] for d in (detections(30)[0], detections(30)[0].reversed())
    )
    assert forward.l3_px == pytest.approx(backward.l3_px)
    assert forward.runs_forward != backward.runs_forward


def test_a_harness_is_drawn_and_tracked_in_a_folder_of_its_own(tmp_path):
    out = tmp_path / "harness"
    result = run("demo", "--branched", "--out", out, "--frames", 4, "--size", "480x270", "--seed", 1)
    readme = (out / "README.txt").read_text()
    assert result.stdout in readme
    assert sorted(file.name for file in out.iterdir()) == ["README.txt", "curves.jsonl", "input.mp4", "overlay.mp4"]
    assert all(file.name in readme for file in out.iterdir())
    rows = list(read_json_lines(out / "curves.jsonl"))
    assert len(rows) == 4
    assert all(row["harnesses"] for row in rows)
    assert "whole harness right" in result.stdout


def test_a_harness_that_fits_no_video_is_an_error(tmp_path):
    result = run("demo", "--branched", "--out", tmp_path / "small", "--size", "64x64", code=1)
    assert "no demo of this size and length: " in result.stderr


def test_two_demos_at_once_are_refused_and_nothing_is_written(tmp_path):
    result = run("demo", "--branched", "--stereo", "--out", tmp_path / "both", code=2)
    assert "--branched and --stereo are two demos: name one of them" in result.stderr
    assert not (tmp_path / "both").exists()
