import csv
import json
import re

import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, Rung, method, suite

from dloftbs_lab.evaluation.report.all_tables import tables
from dloftbs_lab.evaluation.report.losses import losses
from dloftbs_lab.evaluation.report.plots import write_plots
from dloftbs_lab.evaluation.report.table import Table, mean, median, shown
from dloftbs_lab.evaluation.report.write import write_report
from dloftbs_lab.evaluation.runner.run import evaluate

METHODS = [method(stubs.perfect), method(stubs.lone), method(stubs.raising), method(stubs.nothing)]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    paper = ("rgb", "several-cables", "rgbd", "rgbd-artificial")
    suites = [suite(Bars("one"), Bars("two", deep=True), name=name) for name in paper]
    suites += [suite(Rung(0.0), Rung(1.5), name="noise"), suite(Bars("masks", only_masks=True), name="masks")]
    parts = evaluate(suites, METHODS, folder / "parts")
    report = write_report(suites, parts, folder, "stubs")
    return folder, report, parts


def cells(run, table, **which):
    """The row of a table, by column."""
    rows = json.loads((run[0] / "report.json").read_text())["tables"][table]
    return next(row for row in rows if all(row[column] == value for column, value in which.items()))


def test_the_summary_counts_every_frame(run):
    perfect = cells(run, "summary", suite="rgb", method="perfect")
    assert (perfect["frames"], perfect["clean frames, %"], perfect["L3 px"], perfect["missing, %"]) == (
        6,
        100.0,
        0.0,
        0.0,
    )
    raising = cells(run, "summary", suite="rgb", method="raising")
    assert (raising["frames"], raising["exceptions"], raising["frames without a curve"]) == (6, 2, 2)
    assert raising["missing, %"] == pytest.approx(100.0 / 3.0)
    nothing = cells(run, "summary", suite="rgb", method="nothing")
    assert (nothing["frames"], nothing["missing, %"], nothing["L3 px"]) == (6, 100.0, None)


@pytest.mark.parametrize("name", ["rgb", "rgbd", "rgbd-artificial"])
def test_every_scenario_and_method_has_a_row(run, name):
    for sequence in ("one", "two"):
        for one in METHODS:
            row = cells(run, name, scenario=sequence, method=one.name)
            assert row["frames"] == 3
            assert row["frames without a curve"] == {"raising": 1, "nothing": 3}.get(one.name, 0)


def test_the_images_of_several_cables_are_counted(run):
    assert cells(run, "several-cables", sequence="one", method="lone")["missing"] == 3
    assert cells(run, "several-cables", sequence="one", method="lone")["L3 px"] == 0.0
    assert cells(run, "several-cables", sequence="two", method="nothing")["missing"] == 6


def test_the_ladder_has_a_row_for_each_level(run):
    for level in (0.0, 1.5):
        assert cells(run, "noise", ladder="bars, specks, %", level=level, method="perfect")["clean frames, %"] == 100.0


def test_exceptions_are_listed(run):
    assert cells(run, "exceptions", suite="rgb", method="raising")["exception"] == "RuntimeError: no idea"


def test_the_files_say_the_same(run):
    folder, report, parts = run
    assert report.tables
    for table in report.tables:
        with (folder / "tables" / f"{table.name}.csv").open() as file:
            header, *rows = csv.reader(file)
        assert [name for name in header if not name.endswith((": low", ": high"))] == list(table.columns)
        assert len(rows) == len(table.rows)
        assert table.title in report.text()
        assert f"### {table.title}" in (folder / "report.md").read_text()
    with (folder / "frames.csv").open() as file:
        assert len(list(csv.DictReader(file))) == sum(len(part.rows) for part in parts)
    machine = json.loads((folder / "report.json").read_text())["environment"]
    assert {"dloftbs", "Python", "processor", "numpy"} <= machine.keys()


def test_the_pictures_of_the_page_are_there(run):
    folder, report, _ = run
    links = re.findall(r"!\[.*?\]\((.*?)\)", (folder / "report.md").read_text())
    assert len(links) == len(report.pictures) == 6 + 1 + 6 * len(METHODS)
    assert all((folder / link).is_file() for link in links)


def test_it_is_said_where_a_method_loses(run):
    lines = losses(run[2])
    assert "perfect: at least 90% of the frames of every sequence are clean." in lines
    assert "nothing, rgb, one: 0% of 3 frames clean, 6 objects missing" in lines
    assert any(
        "raising, rgb, one: 67% of 3 frames clean, mean L3 0.0 px, 2 objects missing, 1 frames" in x for x in lines
    )


def test_without_matplotlib_there_is_all_but_plots(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib", None)
    parts = evaluate([suite()], METHODS[:1], tmp_path / "parts")
    report = write_report([suite()], parts, tmp_path, "no plots")
    assert "dloftbs[evaluation]" in report.no_plots
    assert report.no_plots in (tmp_path / "report.md").read_text()
    assert [path.parent.name for path in report.pictures] == ["worst"]


def test_no_parts_make_no_plots(tmp_path):
    assert write_plots([], tmp_path) == []
    assert tables([])[0].rows == ()


def test_a_table_aligns_figures_to_the_right():
    table = Table("t", "Title", ("name", "figure"), (("long name", 1.0), ("b", None), ("c", 0.01234)), "Note.")
    assert table.text() == "Title\n  name       figure\n  long name    1.00\n  b               -\n  c           0.012"
    assert table.markdown().splitlines()[2:5] == ["| name | figure |", "| --- | ---: |", "| long name | 1.00 |"]
    assert table.csv() == "name,figure\nlong name,1.0\nb,\nc,0.01234\n"


def test_what_does_not_exist_is_not_in_a_mean():
    assert mean([1.0, None, 3.0]) == 2.0
    assert mean([None]) is median([]) is None
    assert median([3.0, None, 1.0, 2.0]) == 2.0
    assert [shown(value) for value in (None, 0.0, 0.12345, 12.345, 3, "")] == ["-", "0.00", "0.123", "12.35", "3", "-"]
