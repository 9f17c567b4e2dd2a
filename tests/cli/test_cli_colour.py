"""``dloftbs colour``: from strokes to settings that detect and track read."""

import json

import cv2
import numpy as np
import pytest
from cli.cli_inputs import mask, photo, run, save
from ros import bag_examples as bags

from dloftbs.config import Config

ALONG = "40,50:150,50"


@pytest.fixture
def picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "photo.png", photo())
    return "photo.png"


def test_the_settings_go_to_standard_output_and_find_the_cable(picture, tmp_path):
    result = run("colour", picture, "--at", ALONG, "--radius", 1)
    config = Config.from_yaml(result.stdout)
    (kept,) = config.segmentation.colour.pictures
    assert (kept.source, kept.cable, kept.size) == ("photo.png", ("40,50:150,50/1",), (100, 200))
    assert result.stderr.splitlines() == [
        "photo.png: 4.0 % of the picture is cable",
        "the colour of each pixel decides alone, at the speed of a table",
        "next: save the settings by --out cable.yaml, then "
        "dloftbs detect photo.png --config cable.yaml --overlay overlay.png",
    ]
    saved = run("colour", picture, "--at", ALONG, "--radius", 1, "--out", "cable.yaml")
    assert "next: dloftbs detect photo.png --config cable.yaml" in saved.stderr
    (tmp_path / "cable.yaml").write_text(result.stdout)
    assert '"detections":[{' in run("detect", picture, "--config", "cable.yaml").stdout


def test_the_mask_is_drawn_and_the_settings_are_written(picture, tmp_path):
    result = run("colour", picture, "--at", ALONG, "--not", "10,10", "--out", "c.yaml", "--overlay", "mask.png")
    assert result.stdout == ""
    assert "--config c.yaml" in result.stderr
    drawn = cv2.imread(str(tmp_path / "mask.png")).astype(int)
    changed = np.abs(drawn - photo()).sum(axis=2) > 60
    assert np.count_nonzero(changed & (mask() > 0)) > 600
    assert np.count_nonzero(changed & (mask() == 0)) < 60
    assert Config.from_file("c.yaml").segmentation.colour.pictures[0].ground == ("10,10",)
    run("colour", picture, "--at", ALONG, "--out", "c.yaml")  # what it wrote it may replace


@pytest.mark.parametrize("name", ["photo.png", "photo.jpg"])
def test_the_next_command_runs_on_a_grey_picture(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / name, np.where(mask() > 0, np.uint8(30), np.uint8(150)))
    next_command = run("colour", name, "--at", ALONG, "--out", "cable.yaml").stderr.splitlines()[-1]
    assert next_command == f"next: dloftbs detect {name} --config cable.yaml --overlay overlay.png"
    result = run("detect", name, "--config", "cable.yaml")
    (found,) = json.loads(result.stdout)["detections"]
    assert found["width_px"] == pytest.approx(4.0, abs=1.0)
    assert found["curve"]["control_points"][0][1] == pytest.approx(49.5, abs=1.0)


def test_a_second_picture_adds_to_what_was_learned(picture, tmp_path):
    save(tmp_path / "other.png", photo(colour=(200, 60, 20)))
    run("colour", picture, "--at", ALONG, "--out", "one.yaml")
    (tmp_path / "one.yaml").write_text((tmp_path / "one.yaml").read_text() + "linking: {objects: 1}\n")
    run("colour", "other.png", "--at", ALONG, "--config", "one.yaml", "--out", "two.yaml")
    config = Config.from_file("two.yaml")
    assert [kept.source for kept in config.segmentation.colour.pictures] == ["photo.png", "other.png"]
    assert config.linking.objects == 1
    both = run("colour", picture, "other.png", "--at", ALONG, "--at", f"2@{ALONG}", "--overlay", "both.png")
    assert Config.from_yaml(both.stdout).segmentation == config.segmentation
    assert "then dloftbs detect photo.png other.png --config cable.yaml --overlay overlays" in both.stderr


def test_settings_of_a_colour_that_was_learned_before_stay(picture, tmp_path):
    run("colour", picture, "--at", ALONG, "--out", "one.yaml", "--accept-strokes")
    text = (tmp_path / "one.yaml").read_text()
    (tmp_path / "two.yaml").write_text(text.replace("follow_light: true", "follow_light: false"))
    colour = Config.from_yaml(
        run("colour", picture, "--not", "10,10", "--config", "two.yaml").stdout
    ).segmentation.colour
    assert (len(colour.pictures), colour.accept_strokes, colour.follow_light) == (2, True, False)


def test_a_recording_with_several_topics_of_images_is_read_by_the_one_that_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    grey = [("/other/image_raw", bags.stamp_of(i), bags.raw_image(bags.photo_of(i) // 4, "bgr8")) for i in range(2)]
    bags.write_mcap(tmp_path / "run.mcap", [*bags.entries(2), *grey])
    along = "40,60:120,60"
    assert "2 topics of images" in run("colour", "run.mcap", "--at", along, code=1).stderr
    topics = ("--topic", bags.COLOUR_TOPIC, "--info-topic", bags.INFO_TOPIC)
    result = run("colour", "run.mcap", *topics, "--frame", 1, "--at", along, "--out", "cable.yaml")
    (kept,) = Config.from_file("cable.yaml").segmentation.colour.pictures
    assert (kept.source, kept.size) == ("run.mcap frame 1", bags.SIZE)
    command = result.stderr.splitlines()[-1].removeprefix("next: dloftbs ")
    assert command == f"track run.mcap {' '.join(topics)} --config cable.yaml --overlay overlay.mp4"
    run(*command.split(), "--out", "curves.jsonl")
    assert (tmp_path / "curves.jsonl").stat().st_size > 100


def test_a_frame_of_a_video_is_drawn_on(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    video = cv2.VideoWriter("cable.mp4", cv2.VideoWriter_fourcc(*"mp4v"), 30.0, (200, 100))
    for y in (30, 50, 70):
        video.write(photo(y))
    video.release()
    result = run("colour", "cable.mp4", "--frame", 2, "--at", "40,70:150,70")
    assert Config.from_yaml(result.stdout).segmentation.colour.pictures[0].source == "cable.mp4 frame 2"
    assert "then dloftbs track cable.mp4 --config cable.yaml" in result.stderr
    assert "there is no frame 3" in run("colour", "cable.mp4", "--frame", 3, "--at", "1,1", code=1).stderr


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 2, "say where a cable is"),
        (["--not", "5,5"], 2, "say where a cable is"),
        (["--at", "200,50"], 1, "must lie in the picture of 200 x 100 px, got the point 200,50"),
        (["--at", "5"], 2, "expected a stroke"),
        (["--at", "2@5,5"], 2, "there is no picture 2"),
        (["--at", "x@5,5"], 2, "number of a picture"),
        (["--at", ALONG, "--overlay", "photo.png"], 2, "would replace the input photo.png"),
        (["--at", ALONG, "--out", "mine.yaml"], 1, "is not replaced"),
        (["--at", ALONG, "--config", "mine.yaml", "--out", "mine.yaml"], 2, "would replace the input mine.yaml"),
        (["--at", ALONG, "--out", "x.png", "--overlay", "x.png"], 2, "the same place"),
        (["--at", ALONG, "--overlay", "x.jpg"], 2, "must end in .png"),
        (["--at", ALONG, "--overlay", "folder"], 2, "must end in .png"),
    ],
)
def test_bad_usage_is_answered(picture, tmp_path, arguments, code, message):
    (tmp_path / "mine.yaml").write_text("linking: {objects: 1}\n")
    assert message in run("colour", picture, *arguments, code=code).stderr
    assert (tmp_path / "mine.yaml").read_text() == "linking: {objects: 1}\n"


@pytest.mark.parametrize("where", ["frames", "frames/*.png"])
def test_no_frame_of_a_folder_is_replaced(tmp_path, monkeypatch, where):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "frames" / "a.png", photo())
    result = run("colour", where, "--at", ALONG, "--overlay", "frames/a.png", code=2)
    assert "would replace the input frames/a.png" in result.stderr
    assert (cv2.imread("frames/a.png") == photo()).all()


def test_a_colour_of_nothing_or_of_most_is_hinted_at(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "flat.png", np.full((60, 80, 3), (20, 30, 200), np.uint8))
    told = {radius: run("colour", "flat.png", "--at", "10,10:70,50", "--radius", radius).stderr for radius in (2, 100)}
    assert "0.0 % of the picture is cable: nothing\n" in told[2]
    clicked = run("colour", "flat.png", "--at", "10,10").stderr
    assert "0.0 % of the picture is cable: nothing; draw along the cable" in clicked
    assert "100.0 % of the picture is cable: the ground comes in; add strokes on it with --not" in told[100]


def test_strokes_beside_what_they_mean_are_named(picture):
    missed = run("colour", picture, "--at", ALONG, "--at", "60,49:70,90", "--not", "160,50:175,50").stderr
    assert "photo.png: only 10 % of the stroke 60,49:70,90 counts as cable; does it lie beside the cable?" in missed
    assert " % of the stroke 160,50:175,50 still counts as cable; does it lie on the cable?" in missed
    assert "does it lie" not in run("colour", picture, "--at", ALONG, "--not", "10,10:50,20").stderr


def white_on_white() -> np.ndarray:
    """Return a white cable on ground that is nearly as white, under light that changes along it."""
    image = np.full((100, 200), 214.0)
    image[mask() > 0] = 226.0
    image *= np.linspace(0.85, 1.1, 200)
    image += np.random.default_rng(0).normal(0.0, 2.0, image.shape)
    return np.repeat(np.clip(image, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def test_a_stroke_outside_the_region_is_named(picture):
    told = run("colour", picture, "--at", ALONG, "--at", "40,50:60,50", "--roi", "100,0,100,100").stderr
    assert "the stroke 40,50:60,50 lies outside the region of interest" in told
    assert "the stroke 40,50:150,50" not in told


def test_a_stroke_along_a_cable_of_the_grounds_colour_is_not_said_to_lie_beside_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "white.png", white_on_white())
    told = run("colour", "white.png", "--at", ALONG, "--radius", 1).stderr
    assert "of the stroke 40,50:150,50/1 counts as cable, since the rest of the picture has its colours, too" in told
    assert "beside the cable" not in told
    beside = run("colour", "white.png", "--at", "40,80:150,80", "--radius", 1).stderr
    assert "does it lie beside the cable? If it lies on it, add --accept-strokes" in beside


def test_strokes_are_accepted_where_that_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "white.png", white_on_white())
    strokes = ("--at", ALONG, "--not", "20,20:180,20", "--not", "20,80:180,80", "--radius", 1)
    assert "counts as cable, since" in run("colour", "white.png", *strokes).stderr
    accepted = run("colour", "white.png", *strokes, "--accept-strokes", "--out", "cable.yaml").stderr
    assert "counts as cable, since" not in accepted
    colour = Config.from_file("cable.yaml").segmentation.colour
    assert colour.accept_strokes
    on = run("colour", "white.png", "--at", "60,50:90,50", "--config", "cable.yaml", "--out", "more.yaml")
    assert Config.from_file("more.yaml").segmentation.colour.accept_strokes, on.stderr


def test_an_image_without_a_colour_points_at_the_command(picture):
    assert "dloftbs tune photo.png --out cable.yaml" in run("detect", picture, code=1).stderr
