"""No output takes the place of an input or of another output, whatever names and links lead there."""

import os
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import COMMAND, mask, photo, run, save

from dloftbs import sinks
from dloftbs.cli.commands.detect import detect
from dloftbs.cli.commands.track import track
from dloftbs.cli.limits import FilledPath
from dloftbs.cli.outputs import config_beside
from dloftbs.cli.places import READING
from dloftbs.config import Config
from dloftbs.errors import SinkError
from dloftbs_lab import write_sequence
from dloftbs_lab.commands import demo_files
from dloftbs_lab.synthetic import several_cables


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder with what commands read, and the current one."""
    here = tmp_path / "here"
    save(here / "photo.png", photo())
    save(here / "mask.png", mask())
    for i in range(2):
        save(here / "frames" / f"{i}.png", mask(40 + i))
    stack = np.stack([mask(40 + i) for i in range(3)])
    np.savez(here / "a.npz", masks=stack)
    np.save(here / "depth.npy", np.ones((3, 100, 200), np.float32))
    with sinks.OverlayVideoSink(here / "cable.mp4", draw=lambda frame, result: photo()) as video:
        for _ in range(3):
            video.write(None, None)
    os.symlink("a.npz", here / "symlink.npz")
    os.link(here / "a.npz", here / "hardlink.npz")
    os.symlink("frames", here / "linked")
    os.symlink(here, tmp_path / "there")
    os.link(here / "frames" / "0.png", here / "0.png")
    monkeypatch.chdir(here)
    return here


def contents(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def words(result):
    return " ".join(result.stderr.split())


REFUSED = [
    ("detect mask.png --overlay mask.png", "--overlay mask.png", "mask.png"),
    ("detect mask.png --stages ./mask.png", "--stages ./mask.png", "mask.png"),
    ("detect mask.png --out - --overlay ../there/mask.png", "--overlay ../there/mask.png", "mask.png"),
    ("detect frames/0.png --overlay 0.png", "--overlay 0.png", "frames/0.png"),
    ("detect photo.png --masks mask.png --overlay mask.png", "--overlay mask.png", "mask.png"),
    ("detect photo.png --masks {stem}_m.png --overlay photo_m.png", "--overlay photo_m.png", "photo_m.png"),
    ("track a.npz --out a.npz", "--out a.npz", "a.npz"),
    ("track a.npz --out symlink.npz", "--out symlink.npz", "a.npz"),
    ("track symlink.npz --out a.npz", "--out a.npz", "symlink.npz"),
    ("track a.npz --out hardlink.npz", "--out hardlink.npz", "a.npz"),
    ("track a.npz --out ../there/a.npz", "--out ../there/a.npz", "a.npz"),
    ("track cable.mp4 --overlay cable.mp4", "--overlay cable.mp4", "cable.mp4"),
    ("track cable.mp4 --overlay ./frames/../cable.mp4", "--overlay ./frames/../cable.mp4", "cable.mp4"),
    ("track cable.mp4 --masks a.npz --out a.npz", "--out a.npz", "a.npz"),
    ("track a.npz --depth symlink.npz --out hardlink.npz --out b.csv", "--out hardlink.npz", "a.npz"),
    ("track a.npz --out curves.csv --config curves.config.yaml --paper", "curves.config.yaml", "curves.config.yaml"),
]


@pytest.mark.parametrize(("arguments", "output", "replaced"), REFUSED)
def test_an_output_that_is_an_input_is_refused_before_anything_is_written(place, arguments, output, replaced):
    (place / "curves.config.yaml").write_text("# The configuration of dloftbs\nfitting: {knots: 9}\n")
    cv2.imwrite("photo_m.png", mask())
    before = contents(place.parent)
    result = run(*arguments.split(), code=2)
    assert f"{output} would replace the input {replaced}" in words(result)
    assert contents(place.parent) == before


@pytest.mark.parametrize("out", ["in.labelme", "in.labelme/", "bag/"])
def test_a_folder_that_holds_inputs_gets_no_results(place, out):
    save(Path(out) / "0.png", mask())
    before = contents(place.parent)
    result = run("detect", f"{out}/0.png", "--out", out, code=2)
    assert f"--out {out} holds inputs, which the results would replace; choose another name" in words(result)
    assert contents(place.parent) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("detect mask.png --overlay=~/mask.png", "would replace the input mask.png"),
        ("detect photo.png --masks=~/mask.png --overlay mask.png", "--overlay mask.png would replace the input"),
        ("detect photo.png --masks=~/{stem}_m.png --overlay photo_m.png", "--overlay photo_m.png would replace"),
        ("detect ~/in.labelme/0.png --out=~/in.labelme", "holds inputs, which the results would replace"),
        ("track a.npz --out=~/a.npz", "would replace the input a.npz"),
        ("track ~/a.npz --out a.npz", "--out a.npz would replace the input"),
        ("track a.npz --out b.csv --out=~/b.csv", "are the same place"),
        ("background cable.mp4 --out=~/mask.png --limit 1", None),
        ("background ~/mask.png --out=~/mask.png", "would replace the input"),
    ],
)
def test_a_tilde_names_the_same_files_as_the_home_folder(place, monkeypatch, arguments, message):
    monkeypatch.setenv("HOME", str(place))
    monkeypatch.setenv("USERPROFILE", str(place))
    cv2.imwrite("photo_m.png", mask())
    save(Path("in.labelme") / "0.png", mask())
    before = contents(place.parent)
    result = run(*arguments.split(), code=0 if message is None else 2)
    if message is None:
        after = contents(place.parent)
        assert after.keys() == before.keys()
        assert [path.name for path in after if after[path] != before[path]] == ["mask.png"]
    else:
        assert message in words(result)
        assert contents(place.parent) == before


def test_results_below_a_tilde_lie_in_the_home_folder_with_their_configuration(place, monkeypatch):
    monkeypatch.setenv("HOME", str(place))
    monkeypatch.setenv("USERPROFILE", str(place))
    before = contents(place)
    run("detect", "~/frames", "--overlay=~/frames", "--out=~/curves.csv", "--set", "fitting.knots=9")
    run("detect", "mask.png", "--config=~/curves.config.yaml", "--out=~/again/curves.csv")
    run("batch", "~/a.npz", "--out=~/results", "--jobs", "1")
    after = contents(place)
    assert {path: data for path, data in after.items() if path in before} == before
    assert not (place / "~").exists()
    assert {path.relative_to(place).as_posix() for path in after.keys() - before} == {
        *("frames/0.overlay.png", "frames/1.overlay.png", "curves.csv", "curves.config.yaml"),
        *("again/curves.csv", "again/curves.config.yaml"),
        *("results/a.npz.jsonl", "results/a.npz.status.json", "results/batch.config.yaml"),
    }
    assert Config.from_file(place / "again" / "curves.config.yaml").fitting.knots == 9


@pytest.mark.parametrize("scheme", ["file://", "FILE:"])
def test_the_address_of_a_file_is_an_input_too(place, scheme):
    before = contents(place)
    result = run("track", f"{scheme}{place}/cable.mp4", "--overlay", "cable.mp4", code=2)
    assert "would replace the input" in words(result)
    assert contents(place) == before


@pytest.mark.parametrize(
    "arguments",
    [
        "track a.npz --out b.csv --out ./b.csv",
        "track a.npz --out - --out -",
        "track a.npz --out b.csv --out ../there/b.csv",
        "track a.npz --out dangling.csv --out b.csv",
        "detect mask.png --overlay pictures --stages linked_pictures",
        "detect mask.png --overlay new.png --stages ./new.png",
    ],
)
def test_two_outputs_that_are_the_same_are_refused(place, arguments):
    (place / "pictures").mkdir()
    os.symlink("pictures", place / "linked_pictures")
    os.symlink("b.csv", place / "dangling.csv")
    before = contents(place.parent)
    result = run(*arguments.split(), code=2)
    assert "are the same place" in words(result)
    assert contents(place.parent) == before


def test_a_file_that_standard_output_goes_to_is_no_input_and_no_other_output(place):
    for name, arguments in (("mask.png", "detect mask.png"), ("b.csv", "detect mask.png --out - --out b.csv")):
        with open(name, "ab") as file:
            before = contents(place)
            command = subprocess.run([COMMAND, *arguments.split()], stdout=file, stderr=subprocess.PIPE, check=False)
        assert command.returncode == 2
        assert b"--out -" in command.stderr
        assert contents(place) == before


@pytest.mark.parametrize(
    ("arguments", "new"),
    [
        ("detect mask.png --overlay . --stages pictures", {"mask.overlay.png", "pictures/mask.png"}),
        ("detect mask.png --stages .", {"mask.stages.png"}),
        ("detect frames --overlay frames", {"frames/0.overlay.png", "frames/1.overlay.png"}),
        ("detect linked --overlay frames/", {"frames/0.overlay.png", "frames/1.overlay.png"}),
        ("track frames --overlay linked", {"frames/0.overlay.png", "frames/1.overlay.png"}),
        ("track fr*/*.png --overlay frames", {"frames/0.overlay.png", "frames/1.overlay.png"}),
        ("detect frames/0.png --overlay .", {"0.overlay.png"}),
        ("detect photo.png --masks mask.png --overlay .", {"photo.overlay.png"}),
        ("track a.npz --limit 1 --overlay .", {"a_000000.overlay.png"}),
        ("track a.npz --limit 1 --overlay first.png", {"first.png"}),
        ("detect frames --overlay pictures", {"pictures/0.png", "pictures/1.png"}),
        ("detect mask.png --overlay new/out.PNG", {"new/out.PNG"}),
        ("detect mask.png --overlay out.jpg --stages stages.png", {"out.jpg", "stages.png"}),
        ("track mask.png --overlay out.png", {"out.png"}),
        ("detect mask.png --overlay out.png/", {"out.png/mask.png"}),
    ],
)
def test_pictures_never_replace_inputs(place, arguments, new):
    before = contents(place)
    run(*arguments.split())
    after = contents(place)
    assert {path: data for path, data in after.items() if path in before} == before
    added = {path.relative_to(place).as_posix() for path in after.keys() - before}
    assert {name for name in added if not name.endswith(".config.yaml")} == new


def test_a_folder_whose_inputs_are_named_as_pictures_are_is_refused(place):
    run("track", "frames", "--overlay", "frames")
    before = contents(place)
    result = run("track", "frames", "--overlay", "frames", code=2)
    assert "--overlay frames could replace the input frames/" in words(result)
    assert ".overlay.png" in words(result)
    assert "remove it if an earlier run drew it, or choose another folder" in words(result)
    assert contents(place) == before
    for drawn in Path("frames").glob("*.overlay.png"):
        drawn.unlink()
    run("track", "frames", "--overlay", "frames")
    assert contents(place) == before


@pytest.mark.parametrize("overlay", ["frames_overlay", "frames/overlay", "overlay.mp4"])
def test_the_same_run_again_writes_the_same(place, overlay):
    run("track", "frames", "--overlay", overlay, "--out", "curves.csv")
    before = contents(place)
    run("track", "frames", "--overlay", overlay, "--out", "curves.csv")
    assert contents(place) == before


@pytest.mark.parametrize(
    "arguments",
    ["detect frames --overlay out.png", "track a.npz --overlay out.png", "detect mask.png 0.png --stages o.png"],
)
def test_one_picture_is_not_for_several_frames(place, arguments):
    before = contents(place)
    assert "is one picture" in words(run(*arguments.split(), code=2))
    assert contents(place) == before


def test_a_foreign_configuration_is_found_before_older_results_are_replaced(place):
    (place / "curves.csv").write_text("older")
    (place / "curves.config.yaml").write_text("mine")
    run("detect", "mask.png", "--out", "curves.csv", code=1)
    assert (place / "curves.csv").read_text() == "older"


@pytest.mark.parametrize(("command", "drawn"), [("detect", "drawn/"), ("track", "a.mp4")])
def test_a_run_that_fails_before_its_first_frame_leaves_older_results(place, command, drawn):
    (place / "broken").mkdir()
    (place / "broken" / "0.png").write_bytes(b"no picture")
    outputs = [part for name in ("a.jsonl", "a.npz", "a.csv", "a.json") for part in ("--out", name)]
    run(command, "frames", *outputs, "--overlay", drawn)
    before = contents(place)
    run(command, "broken", *outputs, "--overlay", drawn, "--set", "fitting.knots=9", code=1)
    assert contents(place) == before


def test_the_root_of_all_folders_is_no_place_for_a_configuration(tmp_path):
    with pytest.raises(SinkError, match="root of all folders"):
        config_beside((tmp_path.anchor,), Config())


def test_the_configuration_of_a_run_may_be_used_again(place):
    for _ in range(2):
        run("detect", "mask.png", "--out", "curves.csv", "--set", "fitting.knots=9")
    run("detect", "mask.png", "--out", "curves.csv", "--config", "curves.config.yaml")
    assert Config.from_file(place / "curves.config.yaml").fitting.knots == 9


def test_every_option_that_names_a_file_to_be_read_is_known():
    written = {"outs", "overlay", "stages"}
    read = [
        {p.name for p in command.params if isinstance(p.type, FilledPath)} - written - {"where"}
        for command in (detect, track)
    ]
    assert read[0] < read[1] == set(READING)  # a robot moves, so that it goes with streams


@pytest.mark.parametrize("name", ["README.txt", "input.mp4", "space"])
def test_the_demo_replaces_no_files_but_those_of_a_demo(place, name):
    (place / name).mkdir() if name == "space" else (place / name).write_text("mine")
    before = contents(place)
    result = run("demo", "--quick", "--frames", "2", "--out", ".", code=1)
    assert f"holds {name}" in result.stderr
    assert contents(place) == before


def test_a_demo_may_be_done_again_where_one_was_interrupted(tmp_path):
    for _ in range(2):
        demo_files.mark_as_demo(tmp_path / "demo")
        (tmp_path / "demo" / "input.mp4").write_bytes(b"")


@pytest.mark.parametrize("out", [".", "data", "data/evaluation", "link", "link/results"])
def test_an_evaluation_does_not_write_into_labelled_data(place, out):
    sequence = several_cables(0.01, 0, (120, 160))[0]
    write_sequence(sequence, place / "data")
    os.symlink("data", place / "link")
    os.symlink("data", place / "parts")  # so that what would be finished goes there
    before = contents(place)
    result = run("evaluate", "data", "--out", out, code=1)
    assert "would write into the labelled data of data" in result.stderr
    assert contents(place) == before


@pytest.mark.parametrize("name", ["report.md", "frames.csv", "plots"])
def test_an_evaluation_replaces_no_files_but_those_of_an_evaluation(place, name):
    (place / name).write_text("mine")
    before = contents(place)
    result = run("evaluate", "kinds", "--quick", "--out", ".", code=1)
    assert f"holds {name}" in result.stderr
    assert contents(place) == before


def test_files_of_any_name_have_their_pictures_in_the_folders(place):
    odd = ["..\\\\x", "a\nb", "con", "-rf", "$(touch x)", "a:b", "x" * 250, "...", "電" * 80]
    for name in odd:
        (place / "odd" / f"{name}.png").parent.mkdir(exist_ok=True)
        (place / "odd" / f"{name}.png").write_bytes((place / "mask.png").read_bytes())
    before = contents(place.parent)
    run(
        "detect",
        *(f"odd/{name}.png" for name in odd),
        "--overlay",
        "o",
        "--stages",
        "s",
        "--out",
        "curves.jsonl",
        "--out",
        "curves.csv",
    )
    added = [path.relative_to(place).as_posix() for path in contents(place.parent).keys() - before]
    assert sum(name.startswith("o/") for name in added) == len(odd)
    assert sum(name.startswith("s/") for name in added) == len(odd)
    assert len(added) == 2 * len(odd) + 3


@pytest.mark.parametrize(("option", "name"), [("--overlay", "overlay.config.yaml"), ("--stages", "stages.config.yaml")])
def test_in_a_folder_of_inputs_the_configuration_lies_there_and_not_beside_it(place, option, name):
    before = contents(place.parent)
    run("detect", "mask.png", option, ".", "--set", "fitting.knots=9")
    added = [path for path in contents(place.parent).keys() - before if path.suffix == ".yaml"]
    assert added == [place / name]
    assert Config.from_file(place / name).fitting.knots == 9


@pytest.mark.parametrize("missing", ["worm.jpg", "frames/*.jpg"])
def test_a_missing_input_is_named_before_the_place_of_a_picture(place, missing):
    result = run("detect", missing, "--overlay", "overlay.png", code=1)
    assert missing in result.stderr
    assert "is one picture" not in result.stderr
