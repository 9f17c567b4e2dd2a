"""Standard input as the input of commands."""

import io
import json

import cv2
import numpy as np
from cli.cli_inputs import RED, RUNNER, mask, photo, save

from dloftbs.cli import main


def piped(data, *arguments, code=0):
    result = RUNNER.invoke(main, [str(argument) for argument in arguments], input=data)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == code, result.output
    return result


def encoded(pixels):
    return bytes(cv2.imencode(".png", pixels)[1])


def test_a_mask_gives_lines_and_a_picture(tmp_path):
    result = piped(encoded(mask()), "detect", "-", "--out", "-", "--overlay", tmp_path / "overlay.png")
    record = json.loads(result.stdout)
    assert (record["name"], len(record["detections"])) == ("stdin", 1)
    assert cv2.imread(str(tmp_path / "overlay.png")).shape == (100, 200, 3)
    piped(encoded(photo()), "detect", "-", "--hsv", RED, "--out", tmp_path / "a.jsonl", "--overlay", tmp_path / "new")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["stdin.png"]


def test_a_stack_is_a_stream(tmp_path):
    stream = io.BytesIO()
    np.savez(stream, masks=np.stack([mask(40), mask(42)]))
    result = piped(stream.getvalue(), "track", "-")
    assert [json.loads(line)["index"] for line in result.stdout.splitlines()] == [0, 1]
    result = piped(stream.getvalue(), "track", "-", "--overlay", tmp_path / "a.png", code=1)
    assert "is one picture, and this is a second frame; give a folder instead" in result.stderr


def test_it_is_read_beside_other_inputs(tmp_path):
    other = save(tmp_path / "other.png", mask(60))
    result = piped(encoded(mask()), "detect", other, "-")
    assert [json.loads(line)["name"] for line in result.stdout.splitlines()] == ["other.png", "stdin"]


def test_what_is_no_input_is_an_error_with_the_remedy():
    assert "error: standard input is empty" in piped(b"", "detect", "-", code=1).stderr
    assert "error: standard input must hold an image file (PNG," in piped(b"hello", "track", "-", code=1).stderr
