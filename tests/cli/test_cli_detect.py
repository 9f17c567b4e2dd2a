import json

import cv2
import numpy as np
import pytest
from cli.cli_inputs import RED, mask, photo, run, save

from dloftbs import sources
from dloftbs.camera import PinholeCamera
from dloftbs.config import Config
from dloftbs.data.curve import BSplineCurve
from dloftbs.sinks import read_json_lines, read_npz


def lines(result):
    return [json.loads(line) for line in result.stdout.splitlines()]


def test_a_mask_becomes_one_line_of_json(tmp_path):
    (line,) = lines(run("detect", save(tmp_path / "mask.png", mask())))
    assert line["name"] == "mask.png"
    assert line["size"] == [100, 200]
    assert line["tracks"] == []
    (found,) = line["detections"]
    assert BSplineCurve.from_dict(found["curve"]).sample(50)[:, 1] == pytest.approx(50.0, abs=0.5)


def test_a_colour_makes_the_mask(tmp_path):
    image = save(tmp_path / "photo.png", photo())
    (line,) = lines(run("detect", image, "--hsv", RED))
    assert len(line["detections"]) == 1


def test_an_image_in_which_nothing_is_found_says_so_beside_its_pictures(tmp_path):
    speck = np.full((100, 200, 3), 120, np.uint8)
    speck[50, 50] = (0, 0, 255)
    image, overlay = save(tmp_path / "photo.png", speck), str(tmp_path / "overlay.png")
    said = run("detect", image, "--hsv", RED, "--overlay", overlay).stderr
    assert said.startswith("nothing found: nothing of the mask is left after the opening by 3 x 3 px")
    assert "widen the colour, or draw a stroke" in said
    assert (
        run("detect", save(tmp_path / "red.png", photo()), "--hsv", RED, "--overlay", overlay).stderr
        == "found 1 object\n"
    )


def test_several_colours_are_all_cable(tmp_path):
    two = photo(30)
    two[mask(70) > 0] = (255, 0, 0)
    image = save(tmp_path / "photo.png", two)
    (line,) = lines(run("detect", image, "--hsv", RED, "--hsv", "110:130,80:255", "--set", "linking.max_gap_widths=1"))
    assert len(line["detections"]) == 2


@pytest.mark.parametrize("command", ["detect", "track"])
def test_a_colour_image_without_a_colour_names_the_remedies(tmp_path, command):
    result = run(command, save(tmp_path / "photo.png", photo()), code=1)
    assert result.stdout == ""
    assert result.stderr.startswith("error: photo.png is a colour image")
    assert "--hsv 170:10,80:255,60:255" in result.stderr
    assert "--kind mask" in result.stderr
    assert "Traceback" not in result.output


@pytest.mark.parametrize("command", ["detect", "track"])
def test_a_colour_and_masks_contradict_each_other(tmp_path, command):
    path = save(tmp_path / "mask.png", mask())
    assert "--kind mask says that there are none" in run(command, path, "--kind", "mask", "--hsv", RED, code=2).stderr


def test_masks_go_with_images_by_a_rule(tmp_path):
    # As a shell expands *.png: the masks are among the inputs.
    paths = []
    for y, name in ((30, "a"), (70, "b")):
        paths.append(save(tmp_path / f"{name}.png", photo(y)))
        paths.append(save(tmp_path / f"{name}_mask.png", mask(y)))
    found = lines(run("detect", *paths, "--masks", "{stem}_mask.png"))
    assert [line["name"] for line in found] == ["a.png", "b.png"]
    assert [line["index"] for line in found] == [0, 1]


def test_an_image_whose_mask_is_missing_is_reported(tmp_path):
    paths = [save(tmp_path / "a.png", photo()), save(tmp_path / "b.png", photo())]
    save(tmp_path / "a_mask.png", mask())
    result = run("detect", *paths, "--masks", "{stem}_mask.png", code=1)
    assert [line["name"] for line in lines(result)] == ["a.png"]
    assert "(b.png): it has no mask" in result.stderr


def test_only_partners_is_an_error(tmp_path):
    save(tmp_path / "a.png", photo())
    partner = save(tmp_path / "a_mask.png", mask())
    assert "error:" in run("detect", partner, "--masks", "{stem}_mask.png", code=1).stderr


def test_what_cannot_be_read_does_not_stop_the_rest(tmp_path):
    good = save(tmp_path / "good.png", mask())
    bad = tmp_path / "bad.png"
    bad.write_bytes(b"no picture")
    result = run("detect", bad, tmp_path / "missing.png", good, code=1)
    assert [(line["name"], line["index"]) for line in lines(result)] == [("good.png", 2)]
    errors = result.stderr.splitlines()
    assert len(errors) == 2
    assert all(error.startswith("error: ") for error in errors)


def test_a_folder_is_read_in_its_natural_order_and_its_holes_count(tmp_path):
    for name in ("m10", "m2"):
        save(tmp_path / f"{name}.png", mask())
    (tmp_path / "m3.png").write_bytes(b"no picture")
    result = run("detect", tmp_path, code=1)
    assert [(line["name"], line["index"]) for line in lines(result)] == [("m2.png", 0), ("m10.png", 2)]
    assert "warning: skipped frame 1" in result.stderr


def test_the_index_of_a_last_frame_that_cannot_be_read_is_not_used_again(tmp_path):
    for folder in "ab":
        save(tmp_path / folder / f"{folder}0.png", mask())
    (tmp_path / "a" / "a1.png").write_bytes(b"no picture")
    result = run("detect", tmp_path / "a", tmp_path / "b", code=1)
    assert [(line["name"], line["index"]) for line in lines(result)] == [("a0.png", 0), ("b0.png", 2)]


def test_images_do_not_know_of_each_other(tmp_path):
    for i in range(3):
        save(tmp_path / f"{i}.png", mask())
    npz = tmp_path / "out" / "curves.npz"
    run("detect", tmp_path, "--out", npz)
    assert [row.track_id for row in read_npz(npz)] == [None] * 3


def test_nothing_found_is_a_result_with_a_reason(tmp_path):
    (line,) = lines(run("detect", save(tmp_path / "empty.png", np.zeros((50, 60), np.uint8))))
    assert line["detections"] == []
    assert line["reason"] == "the mask is empty"


def test_files_take_the_place_of_standard_output(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    out = tmp_path / "new" / "curves.jsonl"
    result = run("detect", image, "--out", out, "--out", tmp_path / "points.csv", "--set", "fitting.knots=9")
    assert (result.stdout, result.stderr) == ("", "found 1 object\n")
    (line,) = read_json_lines(out)
    assert len(line["detections"]) == 1
    assert (tmp_path / "points.csv").read_text().count("\n") == 101
    used = Config.from_file(tmp_path / "new" / "curves.config.yaml")
    assert used == Config().replace({"fitting.knots": 9})


def test_a_dash_is_standard_output(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    assert len(lines(run("detect", image, "--out", "-", "--out", tmp_path / "curves.csv"))) == 1


def test_pictures(tmp_path):
    image = save(tmp_path / "photo.png", photo())
    run("detect", image, "--hsv", RED, "--overlay", tmp_path / "overlay", "--stages", tmp_path / "stages")
    overlay = cv2.imread(str(tmp_path / "overlay" / "photo.png"))
    assert overlay.shape == (100, 200, 3)
    assert (overlay != photo()).any()
    assert cv2.imread(str(tmp_path / "stages" / "photo.png")).shape[1] > 600
    assert (tmp_path / "overlay.config.yaml").exists()


def test_depth_and_a_camera_give_metres(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    save(tmp_path / "depth.png", np.full((100, 200), 500, np.uint16))
    (line,) = lines(run("detect", image, "--depth", tmp_path / "depth.png", "--camera", "100,100,100,50"))
    curve = BSplineCurve.from_dict(line["detections"][0]["curve_3d"])
    radius_m = 2.5 * 0.5 / 100
    assert curve.sample(20)[:, 2] == pytest.approx(0.5 + radius_m, abs=0.001)


def test_depth_without_a_camera_gives_no_metres_and_says_so(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    save(tmp_path / "depth.png", np.full((100, 200), 500, np.uint16))
    said = run("detect", image, "--depth", tmp_path / "depth.png").stderr
    assert said == "no curve in space: the frame has depth, but no camera (camera=, --camera)\n"


def test_a_results_file_that_cannot_be_written_ends_the_run(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    (tmp_path / "folder.csv").mkdir()
    result = run("detect", image, image, "--out", tmp_path / "folder.csv", code=1)
    assert result.stderr.count("error: ") == 1


def test_a_foreign_file_is_not_replaced_by_the_configuration(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    mine = tmp_path / "curves.config.yaml"
    mine.write_text("fitting: {knots: 9}  # mine\n")
    result = run("detect", image, "--out", tmp_path / "curves.csv", code=1)
    assert "is not replaced" in result.stderr
    assert "mine" in mine.read_text()
    # It says the same: it stays as it is.
    run("detect", image, "--out", tmp_path / "curves.csv", "--config", mine)
    assert "mine" in mine.read_text()


def test_the_configuration_of_an_earlier_run_is_replaced(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    for knots in (9, 12):
        run("detect", image, "--out", tmp_path / "curves.csv", "--set", f"fitting.knots={knots}")
    assert Config.from_file(tmp_path / "curves.config.yaml").fitting.knots == 12


def test_a_camera_may_be_a_file(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    save(tmp_path / "depth.png", np.full((100, 200), 500, np.uint16))
    camera = tmp_path / "camera.yaml"
    camera.write_text("{fx: 100, fy: 100, cx: 100, cy: 50, distortion: [-0.1, 0, 0, 0], width: 200, height: 100}")
    (line,) = lines(run("detect", image, "--depth", tmp_path / "depth.png", "--camera", camera))
    points = BSplineCurve.from_dict(line["detections"][0]["curve_3d"]).sample(20)
    pinhole, lens = PinholeCamera(100, 100, 100, 50), PinholeCamera.from_file(camera)
    pixels = BSplineCurve.from_dict(line["detections"][0]["curve"]).sample(2)
    ends = points[[0, -1], 2]
    assert np.ptp(points[:, 0]) == pytest.approx(np.ptp(lens.deproject(pixels, ends)[:, 0]), rel=0.01)
    assert np.ptp(points[:, 0]) > 1.05 * np.ptp(pinhole.deproject(pixels, ends)[:, 0])


def test_a_camera_for_another_size_is_an_error_that_says_so(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    (tmp_path / "camera.json").write_text('{"fx": 1, "fy": 1, "cx": 1, "cy": 1, "size": [50, 100]}')
    result = run("detect", image, "--camera", tmp_path / "camera.json", code=1)
    assert "camera is for images of size (50, 100)" in result.stderr


@pytest.mark.parametrize("option", ["--camera", "--registration"])
def test_a_calibration_that_cannot_be_read_is_bad_input(tmp_path, option):
    image = save(tmp_path / "mask.png", mask())
    result = run("detect", image, option, tmp_path / "none.yaml", code=1)
    assert result.stderr.startswith("error: ")
    assert "none.yaml: cannot be read" in result.stderr


def test_what_is_neither_numbers_nor_a_file_is_bad_usage(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    for text in ("1,2,3", "a,b,c,d", "camera.txt", "-1,1,1,1"):
        assert "four numbers FX,FY,CX,CY in pixels, or a file" in " ".join(
            run("detect", image, "--camera", text, code=2).stderr.split()
        )


def test_the_unit_of_depth(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    save(tmp_path / "depth.png", np.full((100, 200), 5000, np.uint16))
    options = ("--depth", tmp_path / "depth.png", "--camera", "100,100,100,50", "--depth-unit", "0.0001")
    (line,) = lines(run("detect", image, *options))
    assert BSplineCurve.from_dict(line["detections"][0]["curve_3d"]).sample(9)[:, 2] == pytest.approx(0.5, rel=0.05)
    run("detect", image, "--depth-unit", "0", code=2)


@pytest.mark.parametrize("unit", [[], ["--depth-unit", "0.0001"]], ids=["millimetres", "tenths"])
def test_depth_of_a_camera_of_its_own_is_registered(tmp_path, unit):
    image = save(tmp_path / "mask.png", mask())
    depth = save(tmp_path / "depth.png", np.full((60, 120), 5000 if unit else 500, np.uint16))
    refused = run("detect", image, "--depth", depth, "--camera", "100,100,100,50", code=1)
    assert "or --registration" in refused.stderr
    registration = tmp_path / "registration.yaml"
    registration.write_text(
        "depth_camera: {fx: 50, fy: 50, cx: 59.5, cy: 29.5, width: 120, height: 60}\n"
        "colour_camera: {fx: 100, fy: 100, cx: 99.5, cy: 49.5, width: 200, height: 100}\n"
        "rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1]\ntranslation_m: [0.02, 0, 0.1]\n"
    )
    (line,) = lines(run("detect", image, "--depth", depth, "--registration", registration, *unit))
    assert BSplineCurve.from_dict(line["detections"][0]["curve_3d"]).sample(9)[:, 2] == pytest.approx(0.6, rel=0.05)


def test_the_summary_says_how_many_objects_and_where_there_are_none(tmp_path):
    for i in range(3):
        save(tmp_path / f"{i}.png", mask() * (i > 0))
    result = run("detect", tmp_path, "--out", tmp_path / "curves.jsonl")
    told = result.stderr.splitlines()
    assert told[0].startswith("frames     3, 0 skipped, in ")
    assert told[1] == "objects    2"
    assert told[-2:] == ["nothing found in 1 frames:", "       1  the mask is empty"]
    assert run("detect", tmp_path / "1.png").stderr == ""


def test_an_inverted_mask_is_found_strange(tmp_path):
    result = run("detect", save(tmp_path / "a.png", 255 - mask()))
    assert result.stderr.startswith("warning: 96 % of the mask of a.png is set: inverted, a photograph,")


@pytest.mark.parametrize("command", ["detect", "track"])
def test_labels_in_a_glob_that_the_shell_expanded_are_said_to_be_frames(tmp_path, command):
    paths = [save(tmp_path / "a.png", photo()), save(tmp_path / "a_mask.png", mask())]
    result = run(command, *paths, "--hsv", RED)
    assert "the inputs: a.png and a_mask.png look like an image and its mask" in result.stderr
    assert '--masks "{stem}_mask.png"' in result.stderr
    assert "look like" not in run(command, *paths, "--masks", "{stem}_mask.png").stderr


@pytest.mark.skipif(not hasattr(cv2, "imwriteanimation"), reason="needs OpenCV 4.11")
def test_an_animation_among_images_has_all_its_frames(tmp_path):
    animation = cv2.Animation()
    animation.frames = [photo(30 + 5 * i) for i in range(4)]
    animation.durations = np.full(4, 40, np.int32)
    assert cv2.imwriteanimation(str(tmp_path / "b.webp"), animation)
    paths = [save(tmp_path / "a.png", photo()), tmp_path / "b.webp", save(tmp_path / "c.png", photo())]
    rows = lines(run("detect", *paths, "--hsv", RED))
    assert [row["index"] for row in rows] == list(range(6))
    assert [len(row["detections"]) for row in rows] == [1] * 6


def names_in(result):
    return [json.loads(line)["name"] for line in result.stdout.splitlines()]


def test_inputs_of_one_name_are_told_apart_by_their_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("day1/p.png", "day2/p.png", "day2/q.png"):
        save(tmp_path / name, mask())
    np.save("day1/s.npy", np.stack([mask()] * 2))
    np.save("day2/s.npy", mask())
    assert names_in(run("detect", "day2/p.png", "day1/p.png")) == ["day2/p.png", "day1/p.png"]
    assert names_in(run("detect", "day1", "day2/*.png")) == ["day1/p.png", "day2/p.png", "day2/q.png"]
    assert names_in(run("detect", "day1/p.png", "day2/q.png")) == ["p.png", "q.png"]
    stacks = names_in(run("detect", "day1/s.npy", "day2/s.npy"))
    assert stacks == ["day1/s.npy#0", "day1/s.npy#1", "day2/s.npy#0"]


def test_labels_of_inputs_of_one_name_are_read_back(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    paths = [save(tmp_path / name, mask(y)) for name, y in (("p.png", 20), ("day1/p.png", 50), ("day2/p.png", 80))]
    run("detect", *paths, "--out", "labels.json", "--overlay", "drawn/")
    assert {path.name for path in (tmp_path / "drawn").iterdir()} == {"p.png", "p_1.png", "p_2.png"}
    found = json.loads((tmp_path / "labels.json").read_text())["images"]
    assert [image["file_name"] for image in found] == ["p.png", "day1/p.png", "day2/p.png"]
    with sources.open(paths, instances="labels.json") as source:
        rows = [float(np.nonzero(frame.instances)[0].mean()) for frame in source]
    assert rows == pytest.approx([20, 50, 80], abs=0.5)
    monkeypatch.chdir(tmp_path / "day1")
    with sources.open(["p.png", "../day2/p.png"], instances="../labels.json") as source:
        rows = [float(np.nonzero(frame.instances)[0].mean()) for frame in source]
    assert rows == pytest.approx([50, 80], abs=0.5)


def test_what_the_values_of_a_mask_are_is_said_before_it_is_read(tmp_path):
    soft = mask(size=(100, 640))
    soft[:, 215:425] = soft[:, 215:425] // 255 * 100
    paths = [save(tmp_path / name, soft) for name in ("a.jpg", "a.png")]
    np.save(tmp_path / "a.npy", np.float32(soft / 255.0)[None])

    def count(path, *arguments):
        (line,) = lines(run("detect", path, *arguments))
        return len(line["detections"])

    assert [count(path, "--mask-is", "probability") for path in paths] == [1, 1]
    assert count(paths[0], "--mask-is", "binary") == 2
    assert count(tmp_path / "a.npy", "--mask-is", "binary") == 1
    photo_path = save(tmp_path / "photo.png", np.dstack([soft, soft, 255 - soft]))
    assert count(photo_path, "--masks", paths[0], "--mask-is", "probability") == 1
    assert count(photo_path, "--masks", tmp_path / "a.npy", "--mask-is", "binary") == 1
    refused = run("detect", paths[0], "--mask-is", "labels", code=1).stderr
    assert "a.jpg: a lossy codec changes numbers: save labels as PNG" in refused
