"""Commands in messages run as they are printed."""

from __future__ import annotations

import shlex

import pytest
from cli.cli_inputs import mask, photo, run, save

from dloftbs.cli import main


def commands_in(text):
    return [line.strip() for line in text.splitlines() if line.startswith("    ") and "dloftbs " in line]


@pytest.mark.parametrize("verb", ["detect", "track", "view"])
@pytest.mark.parametrize("name", ["rope.png", "my rope.png"])
def test_an_image_without_a_colour_names_a_command_that_can_be_run(tmp_path, monkeypatch, verb, name):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / name, photo())
    (command,) = commands_in(run(verb, name, code=1).stderr)
    words = shlex.split(command)
    assert words == ["dloftbs", "tune", name, "--out", "cable.yaml"]
    main.commands["tune"].make_context("tune", words[2:])


def test_without_the_extra_the_command_installs_it(tmp_path, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    (command,) = commands_in(run("detect", save(tmp_path / "rope.png", photo()), code=1).stderr)
    assert command.startswith("pip install 'dloftbs[ui]' && dloftbs tune ")


@pytest.mark.parametrize("option", ["--overlay", "--stages"])
@pytest.mark.parametrize("verb", ["detect", "track"])
def test_standard_output_is_empty_where_another_output_is_asked_for(tmp_path, verb, option):
    picture = save(tmp_path / "mask.png", mask())
    assert run(verb, picture, option, tmp_path / "drawn.png").stdout == ""
    assert run(verb, picture, option, tmp_path / "drawn.png", "--out", "-").stdout.startswith("{")


@pytest.mark.parametrize("name", ["rope.png", "my rope.png"])
def test_a_file_in_the_place_of_a_command_names_those_that_read_it(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    save(tmp_path / name, mask())
    said = run(name, code=2).stderr
    assert f"{name!r} is no command" in said
    for command in said.split("`")[1::2]:
        words = shlex.split(command)
        run(*words[1:])
    assert "is no command" not in run("detct", code=2).stderr


def test_too_few_numbers_of_a_camera_are_said_to_be_too_few(tmp_path):
    said = run("detect", save(tmp_path / "mask.png", mask()), "--camera", "600", code=2).stderr
    assert "expected four numbers FX,FY,CX,CY in pixels" in said
    assert "unpack" not in said
