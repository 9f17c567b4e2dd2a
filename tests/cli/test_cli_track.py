import json
import signal
import time
from fractions import Fraction

import cv2
import numpy as np
import pytest
from cli.cli_inputs import RED, mask, photo, run, save, start

from dloftbs.sinks import read_json_lines, read_npz
from dloftbs.sinks._mp4 import H264Mp4
from dloftbs.support.safe_files import AppendFile


def masks(path, count, size=(60, 90)):
    """A stack of masks: a cable that moves, and every tenth frame nothing."""
    stack = np.stack([mask(20 + abs(i % 20 - 10), size) if i % 10 else np.zeros(size, np.uint8) for i in range(count)])
    np.save(path, stack)
    return path


def test_a_folder_becomes_tracks_with_ids(tmp_path):
    for i in range(12):
        save(tmp_path / "in" / f"{i}.png", photo(40 + i))
    out = tmp_path / "out"
    result = run(
        *("track", tmp_path / "in", "--hsv", RED, "--out", out / "curves.jsonl", "--out", out / "curves.npz"),
        *("--overlay", out / "overlay.mp4", "--fps", 12),
    )
    assert result.stdout == ""
    rows = list(read_json_lines(out / "curves.jsonl"))
    assert [[track["id"] for track in row["tracks"]] for row in rows] == [[1]] * 12
    assert [row["stamp"] for row in rows] == [i / 12 for i in range(12)]
    assert len(list(read_npz(out / "curves.npz"))) == 12
    video = cv2.VideoCapture(str(out / "overlay.mp4"))
    assert (video.get(cv2.CAP_PROP_FRAME_COUNT), video.get(cv2.CAP_PROP_FPS)) == (12, 12)
    video.release()
    assert (out / "curves.config.yaml").exists()


def test_tracks_become_labels(tmp_path):
    for i in range(3):
        save(tmp_path / "in" / f"{i}.png", photo(40 + i))
    out = tmp_path / "out"
    run("track", tmp_path / "in", "--hsv", RED, "--out", out / "labels.json", "--out", f"{out}/a.labelme/")
    content = json.loads((out / "labels.json").read_text())
    assert [image["file_name"] for image in content["images"]] == ["0.png", "1.png", "2.png"]
    assert [(one["image_id"], one["track_id"]) for one in content["annotations"]] == [(1, 1), (2, 1), (3, 1)]
    assert sorted(path.name for path in (out / "a.labelme").iterdir()) == [
        *("0.json", "0.png", "1.json", "1.png", "2.json", "2.png")
    ]
    assert (cv2.imread(str(out / "a.labelme" / "2.png")) == photo(42)).all()
    assert (out / "labels.config.yaml").exists()


@pytest.mark.parametrize(("under", "states"), [(True, ["confirmed"] * 9 + ["hidden"]), (False, ["confirmed"] * 9)])
def test_a_cable_under_occluders_is_hidden(tmp_path, under, states):
    stack = np.stack([mask(20 + i) for i in range(9)] + [np.zeros_like(mask(20))])
    hand = np.zeros_like(stack)
    hand[9] = under
    np.save(tmp_path / "masks.npy", stack)
    np.save(tmp_path / "hand.npy", hand)
    run(
        *("track", tmp_path / "masks.npy", "--occluders", tmp_path / "hand.npy", "--out", tmp_path / "curves.jsonl"),
        *("--fps", 1),  # so slow that the empty mask is believed
    )
    rows = read_json_lines(tmp_path / "curves.jsonl")
    assert [track["state"] for row in rows for track in row["tracks"]][1:] == states[1:]


def test_the_summary(tmp_path):
    result = run("track", masks(tmp_path / "masks.npy", 30), "--out", tmp_path / "curves.csv")
    lines = result.stderr.splitlines()
    assert lines[0].startswith("frames     30, 0 skipped, in ")
    assert lines[1] == "tracks     1 confirmed"
    assert any(line.startswith("skeleton ") for line in lines)
    assert any(line.startswith("pipeline ") for line in lines)
    assert lines[-3] == "nothing found in 3 frames:"
    assert lines[-2].startswith("       2  the mask is empty, after 4.63 %: the segmentation has failed, or the scene")
    assert lines[-1] == "       1  the mask is empty"


def test_without_files_results_are_lines_on_standard_output(tmp_path):
    result = run("track", masks(tmp_path / "masks.npy", 5), "--limit", 3)
    assert [json.loads(line)["index"] for line in result.stdout.splitlines()] == [0, 1, 2]


@pytest.mark.parametrize("out", [(), ("--out", "-")])
def test_a_cable_that_is_partly_hidden_does_not_end_the_lines(tmp_path, shared_data, out):
    whole = cv2.imread(str(shared_data / "masks" / "019.png"), cv2.IMREAD_GRAYSCALE)
    cut = np.where(np.arange(len(whole))[:, None] % 8 < 3, 0, whole)
    np.save(tmp_path / "masks.npy", np.stack([whole] * 2 + [cut] * 10))
    rows = [json.loads(line) for line in run("track", tmp_path / "masks.npy", *out).stdout.splitlines()]
    assert [row["index"] for row in rows] == list(range(12))
    assert all(row["tracks"][0]["inferred"] for row in rows[2:])


def test_overlay_pictures_into_a_folder(tmp_path):
    run("track", masks(tmp_path / "masks.npy", 3), "--overlay", tmp_path / "pictures")
    assert len(list((tmp_path / "pictures").iterdir())) == 3


def test_skipped_frames_are_counted_and_do_not_end_the_run(tmp_path):
    for i in range(4):
        save(tmp_path / "in" / f"{i}.png", mask())
    (tmp_path / "in" / "2.png").write_bytes(b"no picture")
    for command in ("track", "detect"):
        result = run(command, tmp_path / "in", "--out", tmp_path / f"{command}.jsonl", code=1)
        assert "warning: skipped frame 2" in result.stderr
        assert len(list(read_json_lines(tmp_path / f"{command}.jsonl"))) == 3
    assert "frames     3, 1 skipped" in result.stderr


def test_a_frame_without_the_depth_that_the_plane_needs_is_skipped_and_does_not_end_the_run(tmp_path):
    table = np.full((100, 200), 700, np.uint16)
    for index in range(4):
        save(tmp_path / "frames" / f"{index}.png", photo(50 + index))
        if index != 2:
            save(tmp_path / "frames" / f"{index}_d.png", np.where(mask(50 + index) > 0, 680, table).astype(np.uint16))
    (tmp_path / "plane.yaml").write_text("segmentation: {plane: {height_m: 0.01}}")
    place = ("--depth", "{stem}_d.png", "--camera", "300,300,99.5,49.5", "--config", tmp_path / "plane.yaml")
    result = run("track", tmp_path / "frames", *place, "--out", tmp_path / "c.jsonl", code=1)
    lines = [json.loads(line) for line in (tmp_path / "c.jsonl").read_text().splitlines()]
    assert [line["index"] for line in lines] == [0, 1, 3]
    assert all(len(line["detections"]) == 1 for line in lines)
    assert "skipped frame 2 (2.png): it has no depth, which the plane needs" in result.stderr


def test_stages_of_a_stream_are_pictures_in_a_folder(tmp_path):
    stack = masks(tmp_path / "masks.npy", 9)
    result = run(
        "track", stack, "--every", 4, "--limit", 2, "--stages", tmp_path / "stages", "--out", tmp_path / "a.csv"
    )
    assert len(list((tmp_path / "stages").iterdir())) == 2
    assert "frames     2, 0 skipped" in result.stderr
    run("track", stack, "--limit", 1, "--stages", tmp_path / "one.png")
    assert cv2.imread(str(tmp_path / "one.png")).size
    assert "--stages" in run("track", stack, "--stages", tmp_path / "stages.mp4", code=2).stderr


@pytest.mark.parametrize("command", ["track", "detect"])
def test_every_nth_frame_keeps_its_index(tmp_path, command):
    stack = masks(tmp_path / "masks.npy", 9)
    result = run(command, stack, "--every", 3)
    assert [json.loads(line)["index"] for line in result.stdout.splitlines()] == [0, 3, 6]
    result = run(command, stack, "--every", 2, "--limit", 2)
    assert [json.loads(line)["index"] for line in result.stdout.splitlines()] == [0, 2]


def test_the_video_of_every_nth_frame_runs_at_the_pace_of_the_input(tmp_path):
    stack = masks(tmp_path / "masks.npy", 9)
    run("track", stack, "--every", 3, "--fps", 30, "--overlay", tmp_path / "overlay.mp4")
    video = cv2.VideoCapture(str(tmp_path / "overlay.mp4"))
    assert (video.get(cv2.CAP_PROP_FRAME_COUNT), video.get(cv2.CAP_PROP_FPS)) == (3, 10)
    video.release()


def test_the_video_of_a_very_fast_recording_has_the_largest_rate(tmp_path):
    file = AppendFile(tmp_path / "fast.mp4")
    fast = H264Mp4(file, (60, 90), Fraction(2000), "mp4")
    for number in range(4):
        fast.add(photo(20 + number, (60, 90)))
    fast.finish()
    file.close()
    run("track", file.path, "--hsv", RED, "--overlay", tmp_path / "overlay.mp4")
    video = cv2.VideoCapture(str(tmp_path / "overlay.mp4"))
    assert (video.get(cv2.CAP_PROP_FRAME_COUNT), video.get(cv2.CAP_PROP_FPS)) == (4, 1000)
    video.release()


def test_files_of_a_glob_that_the_shell_expanded_are_one_stream(tmp_path):
    paths = [save(tmp_path / f"img{i}.png", mask(30 + i)) for i in range(11)]
    result = run("track", *sorted(paths), "--fps", 10)  # as shells sort: img10 before img2
    rows = [json.loads(line) for line in result.stdout.splitlines()]
    assert [row["name"] for row in rows] == [f"img{i}.png" for i in range(11)]
    assert [track["id"] for row in rows for track in row["tracks"]] == [1] * 11
    result = run("track", paths[0], tmp_path / "nowhere.png", code=1)
    assert "there is no file or folder" in result.stderr
    result = run("track", paths[0], tmp_path / "cable.mp4", code=2)
    assert "several inputs of one stream must be image files" in result.stderr


def test_partners_are_left_out_of_a_glob_that_the_shell_expanded(tmp_path):
    paths = []
    for i in range(3):
        paths.append(save(tmp_path / f"{i}.png", photo(40 + i)))
        paths.append(save(tmp_path / f"{i}_mask.png", mask(40 + i)))
    result = run("track", *paths, "--masks", "{stem}_mask.png")
    assert [json.loads(line)["name"] for line in result.stdout.splitlines()] == ["0.png", "1.png", "2.png"]


def test_a_mask_that_breaks_up_is_said_to(tmp_path):
    stack = np.zeros((120, 60, 200), np.uint8)
    for i in range(len(stack)):
        stack[i, 10:15, 20:180] = 1
        if i % 2:
            stack[i, 40:45, 20:180] = 1
    np.save(tmp_path / "masks.npy", stack)
    result = run("track", tmp_path / "masks.npy", "--out", tmp_path / "curves.csv")
    last = result.stderr.splitlines()[-1]
    assert last.startswith("warning: the number of objects changes in 119 of 120 frames: the mask is probably broken")
    assert "--stages" in last
    assert "warning" not in run("track", masks(tmp_path / "good.npy", 120), "--out", tmp_path / "a.csv").stderr


def test_what_breaks_a_mask_up_is_named_with_the_setting(tmp_path):
    stack = np.zeros((60, 80, 220), np.uint8)
    stack[:, 40:50, 10:210] = 1
    for i in range(1, len(stack), 2):
        for x in range(20, 200, 30):
            stack[i, 10:14, x : x + 4] = 1
        stack[i, 65:69, 20:190] = 1
    np.save(tmp_path / "masks.npy", stack)
    last = run("track", tmp_path / "masks.npy", "--out", tmp_path / "curves.csv").stderr.splitlines()[-1]
    assert "the mask is probably broken: in a frame, " in last
    assert "specks of about 4 px; --set cleaning.open_px=5 removes 100 % of them; track --stages" in last


def test_frames_of_another_size_are_said_to_end_all_tracks(tmp_path):
    for i, size in enumerate(((60, 90), (60, 90), (80, 90))):
        save(tmp_path / f"{i}.png", mask(30, size))
    result = run("track", tmp_path, "--out", "-")
    told = "warning: the frame has the size (80, 90), the ones before (60, 90): all tracks are forgotten"
    assert told in result.stderr


def test_a_stream_without_any_frame_is_bad_input(tmp_path):
    for i in range(2):
        (tmp_path / f"{i}.png").write_bytes(b"no picture")
    result = run("track", tmp_path, "--out", tmp_path / "curves.jsonl", code=1)
    assert "no frame could be read" in result.stderr


def test_a_missing_input_leaves_no_files(tmp_path):
    result = run("track", tmp_path / "missing.mp4", "--out", tmp_path / "curves.jsonl", code=1)
    assert result.stderr.startswith("error: ")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_leaves_readable_files_and_a_summary(tmp_path):
    stack = masks(tmp_path / "masks.npy", 20000, (40, 60))
    out = tmp_path / "curves.jsonl"
    arguments = ("track", stack, "--out", out, "--out", tmp_path / "curves.npz", "--overlay", tmp_path / "o.mp4")
    process = start(*arguments)
    try:
        deadline = time.monotonic() + 30
        while (not out.exists() or out.stat().st_size < 50_000) and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == 130, stderr
    assert stdout == ""
    rows = list(read_json_lines(out))
    seen = int(stderr.split()[1].rstrip(","))
    assert stderr.startswith("frames ")
    assert stderr.endswith("interrupted\n")
    assert "Traceback" not in stderr
    assert 0 < seen < 20000
    assert len(rows) == seen
    # In every tenth frame the mask fails, and the track is hidden.
    assert max(row.frame for row in read_npz(tmp_path / "curves.npz")) == seen - 1
    video = cv2.VideoCapture(str(tmp_path / "o.mp4"))
    assert abs(video.get(cv2.CAP_PROP_FRAME_COUNT) - len(rows)) <= 1
    video.release()
