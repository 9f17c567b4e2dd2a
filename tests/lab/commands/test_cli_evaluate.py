import csv
import json
import os
import re
import signal
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import mask, run, save, start

from dloftbs.config import Config
from dloftbs.data.frame import Frame
from dloftbs.errors import InputError
from dloftbs_lab.commands import evaluate as evaluate_command
from dloftbs_lab.commands.evaluation_progress import open_parts_progress
from dloftbs_lab.commands.method_options import MethodSettings
from dloftbs_lab.commands.methods import method_of
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Key, Part
from dloftbs_lab.evaluation.suites import SUITES, missing_for
from dloftbs_lab.recorded.through_points import curve_through
from dloftbs_lab.synthetic import rgb, several_cables

TINY = ("--scale", 0.01, "--size", "320x180", "--jobs", 1)
MINE = """
import numpy as np

calls = 0

def line(frame):
    return [np.array([[10.0, 20.0], [200.0, 20.0]])]

def broken(frame):
    raise ValueError("not today")

class Follower:
    def __init__(self):
        self.frames = 0
    def __call__(self, frame):
        self.frames += 1
        return {1: np.array([[10.0, 20.0], [200.0, 20.0 + self.frames]])}

class NotCallable:
    pass

number = 3
"""


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A stranger's module, on the path of this process and of those that it starts."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "mine.py").write_text(MINE)
    (folder / "falls_over.py").write_text("1 / 0")
    (folder / "leaves.py").write_text("import sys; sys.exit(0)")
    monkeypatch.syspath_prepend(str(folder))
    yield folder
    for name in [one for one in sys.modules if one.partition(".")[0] in ("mine", "own")]:
        del sys.modules[name]


def test_a_run_from_end_to_end(tmp_path):
    out = tmp_path / "out"
    result = run("evaluate", "rgbd-artificial", "kinds", "--out", out, *TINY)
    assert "All suites" in result.stdout
    assert "DLOFTBs   published, on other data  L3 mean" in re.sub(r"DLOFTBs +", "DLOFTBs   ", result.stdout)
    assert "frames  " in result.stderr
    data = json.loads((out / "report.json").read_text())
    assert {row["method"] for row in data["tables"]["summary"]} == {"default", "paper"}
    assert {row["suite"] for row in data["tables"]["summary"]} == {"rgbd-artificial", "kinds"}
    with (out / "frames.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * sum(row["frames"] for row in data["tables"]["summary"] if row["method"] == "paper")
    assert (out / "worst" / "kinds-paper.jpg").is_file()
    assert (out / "plots" / "times.png").is_file()
    parts = {path: path.stat().st_mtime_ns for path in (out / "parts").iterdir()}
    again = run("evaluate", "rgbd-artificial", "kinds", "--out", out, *TINY)
    assert again.stdout == result.stdout
    assert {path: path.stat().st_mtime_ns for path in (out / "parts").iterdir()} == parts


def test_anybodys_function_and_class_in_other_processes(tmp_path, mine):
    out = tmp_path / "out"
    process = start(
        *("evaluate", "rgbd-artificial", "--method", "mine:line,mine:Follower", "--method", "mine:broken"),
        *(*TINY[:-1], 2, "--out", out),
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(mine), os.environ.get("PYTHONPATH", "")])},
    )
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    tables = json.loads((out / "report.json").read_text())["tables"]
    summary = {row["method"]: row for row in tables["summary"]}
    assert summary["mine:line"]["L3 px"] > 0.0
    assert summary["mine:broken"]["exceptions"] == summary["mine:broken"]["frames"]
    assert summary["mine:broken"]["missing, %"] == 100.0
    tracking = {row["method"]: row for row in tables["tracking"]}
    assert list(tracking) == ["mine:Follower", "mine:broken"]
    assert tracking["mine:broken"]["MOTA"] == 0.0
    assert tables["exceptions"][0]["exception"] == "ValueError: not today"


def test_modules_of_the_current_folder_are_found_by_the_command_and_its_processes(tmp_path):
    (tmp_path / "here.py").write_text("def find(frame):\n    from beside import curves\n    return curves()\n")
    (tmp_path / "beside.py").write_text(
        "import numpy as np\ndef curves():\n    return [np.array([[10.0, 20.0], [200.0, 20.0]])]\n"
    )
    process = start("evaluate", "kinds", "--method", "here:find", *TINY[:-1], 2, "--out", "out", cwd=tmp_path)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    tables = json.loads((tmp_path / "out" / "report.json").read_text())["tables"]
    assert "exceptions" not in tables
    assert {row["exceptions"] for row in tables["summary"]} == {0}


DATA = (Path(__file__).parents[3] / "docs" / "files.md").read_text("utf-8").partition("### Labelled data")[2]


def documented(kind):
    """Return the examples of labelled data of a kind, as the page shows them."""
    return [body for name, body in re.findall(r"```(\w+)\n(.*?)```", DATA, re.DOTALL) if name == kind]


@pytest.fixture
def labelled(tmp_path):
    """A folder as the page lays it out, with colour pictures."""
    folder = tmp_path / "mydata"
    folder.mkdir()
    (folder / "00.json").write_text(documented("json")[0])
    (folder / "01.csv").write_text(next(body for body in documented("text") if body.startswith("object,x,y")))
    (folder / "02.json").write_text('{"curves": []}')
    for stem, drawn in (("00", True), ("01", True), ("02", False)):
        picture = np.full((200, 240, 3), (90, 120, 90), np.uint8)
        for curve in json.loads(documented("json")[0])["curves"] if drawn else ():
            points = np.rint(curve_through(np.array(curve)).sample(100)).astype(np.int32)
            cv2.polylines(picture, [points], False, (200, 60, 20), 5)
        save(folder / f"{stem}.png", picture)
    return folder


def test_a_folder_laid_out_as_the_page_says_is_scored(tmp_path, labelled):
    (tmp_path / "mine.yaml").write_text("linking:\n  min_length_px: 20\n")
    methods = ("--method", f"default,paper,{tmp_path / 'mine.yaml'}")
    run("evaluate", labelled, *methods, "--hsv", "100:130", "--out", tmp_path / "out", "--jobs", 1)
    rows = json.loads((tmp_path / "out" / "report.json").read_text())["tables"]["summary"]
    assert [row["method"] for row in rows] == ["default", "paper", str(tmp_path / "mine.yaml")]
    for row in rows:
        assert (row["frames"], row["exceptions"], row["missing, %"]) == (3, 0, 0.0)
        assert row["L3 px"] < 2.0


def test_pictures_without_masks_need_a_colour(tmp_path, labelled):
    result = run("evaluate", labelled, "--out", tmp_path / "out", code=1)
    assert "mydata: 00.png is a picture without a mask, and nothing says to default, paper" in result.stderr
    assert "--hsv" in result.stderr
    assert "00.mask.png" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_colour_for_masks_is_told_to_make_no_difference(tmp_path):
    save(tmp_path / "set" / "0.png", mask())
    (tmp_path / "set" / "0.json").write_text("[[[20, 50], [180, 50]]]")
    arguments = ("evaluate", tmp_path / "set", "--method", "default", "--out", tmp_path / "out", "--jobs", 1)
    assert "set: --hsv makes no difference" in run(*arguments, "--hsv", "100:130").stderr


def test_a_suite_of_every_kind_stands_in_the_help():
    text = " ".join(run("evaluate", "--help").stdout.split())
    assert [name for name in SUITES if not re.search(rf"(?<![\w-]){name}(?![\w-])", text)] == []
    for word in ("00.json", '{"curves": [[[x, y]', "object,x,y", "00.mask.png", "00.labels.png", "camera.json"):
        assert word in text


def test_quick_has_no_tables_of_tracking_and_says_so(tmp_path, mine, monkeypatch):
    monkeypatch.setattr("dloftbs_lab.evaluation.suites.QUICK_SCALE", 0.01)
    arguments = ("evaluate", "rgbd-artificial", "--method", "mine:Follower", "--size", "320x180", "--jobs", 1)
    quick = run(*arguments, "--quick", "--out", tmp_path / "quick")
    assert quick.stdout.startswith("QUICK RUN, a tenth of the scenes in small images: to try, not to quote. ")
    assert "All suites (quick run)" in quick.stdout
    assert (tmp_path / "quick" / "report.md").read_text().startswith("QUICK RUN")
    assert "quick run" in (tmp_path / "quick" / "tables" / "summary.csv").read_text().splitlines()[1]
    assert quick.stdout.count("no tracking tables: so few frames say nothing of tracking, run without --quick") == 1
    tables = json.loads((tmp_path / "quick" / "report.json").read_text())["tables"]
    assert "tracking" not in tables
    asked = run(*arguments, "--quick", "--scale", 0.01, "--out", tmp_path / "quick")
    assert asked.stdout == quick.stdout
    asked = run(*arguments, "--scale", 0.01, "--out", tmp_path / "quick")
    assert "no tracking tables" not in asked.stdout
    tables = json.loads((tmp_path / "quick" / "report.json").read_text())["tables"]
    assert "tracking" in tables


def test_the_baseline_is_scored_where_it_is_told_the_start(tmp_path):
    arguments = ("evaluate", "rgbd-artificial", "kinds", "--method", "cpd,paper", "--out", tmp_path / "out", *TINY)
    result = run(*arguments)
    rows = json.loads((tmp_path / "out" / "report.json").read_text())["tables"]["summary"]
    assert [(row["suite"], row["method"]) for row in rows] == [
        ("rgbd-artificial", "cpd"),
        ("rgbd-artificial", "paper"),
        ("kinds", "paper"),
    ]
    assert rows[0]["exceptions"] == rows[0]["frames without a curve"] == 0
    assert rows[0]["L3 px"] < 5.0
    assert "(scale 0.01)" in result.stdout


def test_the_baseline_is_for_some_suites_alone(tmp_path):
    result = run("evaluate", "kinds", "--method", "cpd", "--out", tmp_path / "out", *TINY, code=1)
    assert "method 'cpd' is for the suites rgb, rgbd, rgbd-artificial, got kinds" in result.stderr


def test_the_papers_tables_are_printed_with_ours_beneath(tmp_path, shared_data):
    done = run("evaluate", "rgb", shared_data / "cables", "--paper", *TINY, "--out", tmp_path / "out")
    titles = [line.partition(" (")[0] for line in done.stdout.splitlines() if line.startswith("Table ")]
    assert titles == ["Table I: 2D videos of one cable", "Table II: images of several cables"]
    assert "All suites" not in done.stdout
    rows = [line.split() for line in done.stdout.splitlines() if " here" in line]
    assert [row[0] for row in rows if "L1" in row] == ["default", "paper"]
    assert {row[0] for row in rows if "cables" in row} == {"default", "paper"}


def test_folders_alone_come_to_the_suites_of_the_paper():
    suites = ("rgb", "several-cables", "rgbd", "rgbd-artificial")
    assert evaluate_command._names_of_paper(()) == suites
    assert evaluate_command._names_of_paper(("photographs",)) == (*suites, "photographs")
    assert evaluate_command._names_of_paper(("rgb", "photographs")) == ("rgb", "photographs")


def test_paper_has_the_form_of_one_cable_where_there_is_one():
    one, several = rgb(0.01, size=(180, 320))[0], several_cables(0.01, size=(180, 320))[0]
    paper = method_of("paper")
    linking = {number: made.factory.args[0].linking for number, made in
               ((1, paper.made_for(one)), (2, paper.made_for(several)))}  # fmt: skip
    assert linking == {1: Config.paper(objects=1).linking, 2: Config.paper().linking}
    assert "objects: 1" in paper.settings
    set_by_hand = method_of("paper", MethodSettings(changes={"linking.max_cost": 8.0}))
    assert set_by_hand.made_for(one).factory.args[0].linking.max_cost == 8.0


def test_a_class_is_made_anew_and_a_function_is_not(mine):
    frame = Frame(mask=[[1]])
    for _ in range(2):
        (curve,) = method_of("mine:Follower").factory()(frame).values()
        assert curve[1, 1] == 21.0
    assert method_of("mine:line").factory() is sys.modules["mine"].line


def test_a_changed_module_has_other_settings(mine):
    before = method_of("mine:line").settings
    (mine / "mine.py").write_text(MINE + "# changed")
    assert method_of("mine:line").settings != before


def test_a_changed_module_that_it_imports_has_other_settings(mine, monkeypatch):
    (mine / "helper.py").write_text("x = 1\n")
    (mine / "mine.py").write_text("import helper\n" + MINE)
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    before = method_of("mine:line").settings
    monkeypatch.delitem(sys.modules, "helper")  # as at the end of a process
    monkeypatch.delitem(sys.modules, "mine")
    (mine / "helper.py").write_text("x = 2\n")
    assert method_of("mine:line").settings != before


@pytest.mark.parametrize("name", ["mine:line", "own.inner.method:line"])
@pytest.mark.parametrize("place", ["here/helper.py", "here/deep/er/helper.py", "modules/own/helper.py"])
def test_code_that_is_imported_when_a_method_is_called_has_other_settings(tmp_path, mine, monkeypatch, name, place):
    (mine / "own" / "inner").mkdir(parents=True)
    (mine / "own" / "__init__.py").write_text("")
    (mine / "own" / "inner" / "method.py").write_text(MINE)
    helper = tmp_path / place
    helper.parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "here").mkdir(exist_ok=True)
    monkeypatch.chdir(tmp_path / "here")
    before = method_of(name).settings
    helper.write_text("x = 1")
    written = method_of(name).settings
    helper.write_text("x = 2")
    assert len({before, written, method_of(name).settings}) == 3


@pytest.mark.parametrize("folder", [".hidden", "build", "dist", "node_modules", "environment", "lib/site-packages"])
def test_code_of_others_makes_no_difference(mine, monkeypatch, folder):
    monkeypatch.chdir(mine)
    place = mine / folder
    place.mkdir(parents=True)
    (mine / "environment").mkdir(exist_ok=True)
    (mine / "environment" / "pyvenv.cfg").write_text("")
    before = method_of("mine:line").settings
    (place / "helper.py").write_text("x = 1")
    assert method_of("mine:line").settings == before


def test_code_in_more_folders_than_are_searched_is_said(mine, monkeypatch, caplog):
    monkeypatch.chdir(mine)
    monkeypatch.setattr("dloftbs_lab.commands.methods._MAX_FOLDERS", 2)
    (mine / "a" / "b").mkdir(parents=True)
    method_of("mine:line")
    assert "holds more than 2 folders: a change of code in the farthest is not noticed" in caplog.text


def test_an_installed_module_is_known_by_its_file_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = method_of("statistics:mean").settings
    (tmp_path / "more.py").write_text("x = 1")
    assert method_of("statistics:mean").settings == before != ""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "best",
            "there is no method 'best'; methods are default, paper, cpd, stereo, a configuration (FILE.yaml) "
            "and module:callable",
        ),
        ("nowhere:f", "cannot import 'nowhere': ModuleNotFoundError"),
        ("falls_over:f", "cannot import 'falls_over': ZeroDivisionError: division by zero"),
        ("leaves:f", "cannot import 'leaves': SystemExit: 0"),
        ("mine:nothing", "has no attribute 'nothing'"),
        ("mine:number", "must be a function, or a class whose instances can be called"),
        ("mine:NotCallable", "must be a function, or a class whose instances can be called"),
    ],
)
def test_a_method_that_is_not_there_is_bad_input(tmp_path, mine, name, message):
    with pytest.raises(InputError, match=re.escape(message)):
        method_of(name)
    result = run("evaluate", "kinds", "--method", name, "--out", tmp_path / "out", *TINY, code=1)
    assert result.stderr.startswith("error: ")
    assert message in result.stderr


def test_a_folder_without_labels_says_what_is_right(tmp_path):
    result = run("evaluate", tmp_path, "--out", tmp_path / "out", code=1)
    assert "Right are" in result.stderr


def test_an_unknown_suite_is_bad_input(tmp_path):
    assert "no suite and no folder" in run("evaluate", "kins", "--out", tmp_path / "out", code=1).stderr


@pytest.mark.parametrize("option", [("--scale", "0"), ("--jobs", "0"), ("--seed", "-1"), ("--size", "big")])
def test_bad_usage(option):
    run("evaluate", *option, code=2)


def test_out_is_no_file(tmp_path):
    run("evaluate", "--out", save_text(tmp_path / "file"), code=2)


def save_text(path):
    path.write_text("here already")
    return path


def test_labelled_data_on_disk(tmp_path, shared_data):
    out = tmp_path / "out"
    folder = tmp_path / "S1"
    folder.mkdir()
    for name in ("00.jpg", "00.labels.png"):
        (folder / name).write_bytes((shared_data / "mbest" / "S1" / name).read_bytes())
    run("evaluate", folder, "--method", "paper", "--out", out, "--jobs", 1)
    (row,) = json.loads((out / "report.json").read_text())["tables"]["S1"]
    assert row["DICE"] > 0.5


def test_ctrl_c_ends_it_and_keeps_what_is_finished(tmp_path):
    out = tmp_path / "out"
    process = start("evaluate", "rgbd", "--method", "paper", "--scale", 0.1, "--jobs", 2, "--out", out)
    deadline = time.monotonic() + 40.0
    while not list(out.glob("parts/[!.]*.json")) and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert errors.endswith("interrupted\n")
    assert "Traceback" not in errors
    assert 1 <= len(list(out.glob("parts/[!.]*.json"))) < 10


def test_progress_counts_frames(capsys):
    rows = tuple(
        FrameRow("s", "q", i, "m", 1, 1, 0.0, 0.0, 0.0, 0.0, None, None, None, 0, 0, 1, True, 1.0, None)
        for i in range(5)
    )
    part = Part(Key("s", "q", "m", 0, 5, "", "", ""), rows)
    with open_parts_progress(10) as show:
        show(part)
        show(part)  # so soon that it is not worth a line
    assert capsys.readouterr().err == "5/10 frames  s, q: m\n"


def test_progress_on_a_terminal_is_a_bar(monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    part = Part(Key("s", "q", "m", 0, 0, "", "", ""), ())
    with open_parts_progress(10) as show:
        show(part)
    assert capsys.readouterr().out == ""


def test_without_mujoco_its_suite_is_left_out_with_a_word(monkeypatch, capsys):
    monkeypatch.setattr("dloftbs_lab.synthetic.simulation_available", lambda: False)
    suites = evaluate_command._suites((), True, 0.01, (180, 320), 0, 7.0)
    lacking = ["simulated", *(name for name in ["real-motion"] if missing_for(name) is not None)]
    assert [suite.name for suite in suites] == [name for name in SUITES if name not in lacking]
    told = sorted(capsys.readouterr().err.splitlines())
    assert told[-1].startswith("left out simulated: simulated cables need MuJoCo: pip install")
    assert len(told) == len(lacking)
    assert {sequence.tolerance_px for suite in suites for sequence in suite.sequences} == {7.0}
