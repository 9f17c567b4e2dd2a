"""The page on scoring a method of one's own: its examples are run as they stand."""

import json
import re
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run

from dloftbs_lab.commands.methods import BASELINE_SUITES
from dloftbs_lab.evaluation.baselines.coherent_point_drift import NODES, STRETCH
from dloftbs_lab.evaluation.report.spread import RESAMPLES

PAGE = (Path(__file__).parents[1] / "docs" / "own-method.md").read_text("utf-8")
COMMANDS = re.findall(r"```sh\ndloftbs (.*?)\n```", PAGE)
FUNCTION, TRACKER = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def mymethod(tmp_path, monkeypatch):
    (tmp_path / "mymethod.py").write_text(f"{FUNCTION}\n\n{TRACKER}")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield "mymethod"
    sys.modules.pop("mymethod", None)


def test_the_examples_are_scored(tmp_path, mymethod):
    methods = f"{mymethod}:find,{mymethod}:Still"
    options = ("--scale", 0.01, "--size", "320x180", "--jobs", 1, "--out", tmp_path / "mine")
    run("evaluate", "rgbd-artificial", "kinds", "--method", methods, *options)
    rows = json.loads((tmp_path / "mine" / "report.json").read_text())["tables"]["summary"]
    assert len(rows) == 4
    for row in rows:
        assert (row["exceptions"], row["frames without a curve"]) == (0, 0)
        assert row["L3 px"] > 0.0
    still = next(row for row in rows if row["method"].endswith("Still") and row["suite"] == "kinds")
    assert still["missing, %"] == 0.0


def test_the_first_command_is_of_generated_suites():
    name, *suites = COMMANDS[0].partition(" --")[0].split()
    assert name == "evaluate"
    assert set(suites) <= {"rgb", "kinds"}


def test_the_second_command_scores_labels_as_the_page_writes_them(tmp_path, monkeypatch, mymethod):
    (text,) = re.findall(r"00\.json +(.*)", PAGE)
    curves = json.loads(text)["curves"]
    image = np.full((420, 560, 3), 200, np.uint8)
    for curve in curves:
        cv2.polylines(image, [np.array(curve, np.int32)], False, (0, 0, 255), 9)
    (tmp_path / "mydata").mkdir()
    cv2.imwrite(str(tmp_path / "mydata" / "00.png"), image)
    (tmp_path / "mydata" / "00.json").write_text(text)
    monkeypatch.chdir(tmp_path)
    run(*COMMANDS[1].split(), "--jobs", 1)
    rows = json.loads((tmp_path / "mine" / "report.json").read_text())["tables"]["summary"]
    assert {row["method"] for row in rows} == {"default", f"{mymethod}:find"}
    assert [row["missing, %"] for row in rows if row["method"] == "default"] == [0.0]


def test_the_page_says_what_the_code_has():
    assert f"a chain of {NODES} nodes" in PAGE
    assert f"stretch by more than {100 * (STRETCH - 1):.0f} %" in PAGE
    assert f"{RESAMPLES} times" in PAGE
    for suite in BASELINE_SUITES:
        assert f"*{suite}*" in PAGE
