"""The demo with two cameras."""

from __future__ import annotations

import numpy as np
from cli.cli_inputs import run

from dloftbs.sinks import read_json_lines


def test_the_folder_has_two_videos_and_curves_in_metres_that_the_command_finds_again(tmp_path, monkeypatch):
    folder = tmp_path / "demo"
    result = run("demo", "--stereo", "--out", folder, "--frames", 4, "--size", "640x360")
    readme = (folder / "README.txt").read_text()
    assert result.stdout.strip() in readme
    assert {file.name for file in folder.iterdir()} <= {*readme.split(), "curves.config.yaml"}
    rows = list(read_json_lines(folder / "curves.jsonl"))
    assert len(rows) == 4
    assert all(row["tracks"][0]["curve_3d"] is not None for row in rows)
    assert float(readme.split("true axis")[1].split("mean")[1].split(",")[0]) < 30.0
    monkeypatch.chdir(folder)
    command = readme.split("dloftbs ")[-1].split()
    run(*command)
    again = list(read_json_lines(folder / "again.jsonl"))
    points = [np.array(one[2]["tracks"][0]["curve_3d"]["control_points"])[0] for one in (rows, again)]
    assert np.abs(points[0] - points[1]).max() < 0.05
