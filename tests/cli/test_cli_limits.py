"""Numbers, sizes and paths that no run could end with are bad usage, and said so at once."""

import pytest
from cli.cli_inputs import mask, run, save

from dloftbs.cli import limits

HUGE = "9" * 20
ENDLESS = "9" * 5000  # more digits than Python takes for an integer


@pytest.mark.parametrize("number", [HUGE, ENDLESS, "-1", "nan", ""])
@pytest.mark.parametrize(
    "arguments",
    [
        "track a.npz --limit",
        "detect a.png --jobs",
        "demo --frames",
        "demo --seed",
        "demo --size",
        "evaluate --jobs",
        "evaluate --seed",
        "evaluate --size",
    ],
)
def test_counts_and_sizes_have_limits(tmp_path, monkeypatch, arguments, number):
    monkeypatch.chdir(tmp_path)
    run(*arguments.split(), number, code=2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", ["1e300", "inf", "-1", ENDLESS, ""])
@pytest.mark.parametrize("arguments", ["track a.npz --fps", "detect a.png --depth-unit", "evaluate --scale"])
def test_rates_units_and_shares_have_limits(tmp_path, monkeypatch, arguments, number):
    monkeypatch.chdir(tmp_path)
    run(*arguments.split(), number, code=2)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["demo", "evaluate"])
@pytest.mark.parametrize("size", ["99999999x99999999", f"{HUGE}x{HUGE}", f"{ENDLESS}x720", "1280x4097", "4097x720"])
def test_generated_images_have_a_largest_size(tmp_path, monkeypatch, command, size):
    monkeypatch.chdir(tmp_path)
    assert "Invalid value for '--size'" in run(command, "--size", size, code=2).stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("size", ["1280X720", f"{limits.MAX_SIDE_PX}x{limits.MAX_SIDE_PX}"])
def test_sizes_up_to_the_limit_are_read(size):
    width, height = map(int, size.lower().split("x"))
    assert limits.parse_size(None, None, size) == (height, width)


def test_the_largest_limit_is_taken(tmp_path):
    image = save(tmp_path / "mask.png", mask())
    run("track", image, "--limit", limits.MAX_FRAMES, "--out", tmp_path / "a.csv")


@pytest.mark.parametrize(
    "arguments",
    [
        ("track", ""),
        ("detect", ""),
        ("detect", "mask.png", ""),
        ("detect", "mask.png", "--overlay", ""),
        ("detect", "mask.png", "--stages", ""),
        ("detect", "mask.png", "--out", ""),
        ("detect", "mask.png", "--masks", ""),
        ("detect", "mask.png", "--depth", ""),
        ("detect", "mask.png", "--camera", ""),
        ("detect", "mask.png", "--registration", ""),
        ("detect", "mask.png", "--config", ""),
        ("config", "check", ""),
        ("demo", "--out", ""),
        ("evaluate", "", "--out", "out"),
        ("evaluate", "--out", ""),
    ],
)
def test_an_empty_path_is_not_the_current_folder(tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "mask.png", mask())
    result = run(*arguments, code=2)
    assert "Error: " in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mask.png"]


@pytest.mark.parametrize("camera", [HUGE, ENDLESS])
def test_a_camera_of_a_huge_number_is_bad_input(camera):
    assert "digits" in run("track", camera, code=1).stderr


@pytest.mark.parametrize("option", ["--out", "--overlay", "--masks", "--depth", "--config", "--camera"])
def test_a_name_that_is_too_long_is_an_error(tmp_path, monkeypatch, option):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / "mask.png", mask())
    long = "x" * 300 + {"--out": ".csv", "--camera": ".yaml"}.get(option, "")
    assert "rror: " in run("detect", "mask.png", option, long, code=1).stderr


@pytest.mark.parametrize("command", ["detect", "track"])
def test_an_input_whose_name_is_too_long_is_an_error(command):
    assert "there is no file or folder" in run(command, "x" * 300, code=1).stderr


@pytest.mark.parametrize("arguments", ["detect ~nobody-of-this-name/a.png", "track ~nobody-of-this-name/a.png"])
def test_the_home_of_nobody_is_an_error(arguments):
    assert "there is no file or folder" in run(*arguments.split(), code=1).stderr


def test_a_suite_whose_name_is_too_long_is_an_error(tmp_path):
    assert "no suite and no folder" in run("evaluate", "x" * 300, "--out", tmp_path / "out", code=1).stderr
