from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation import paper_figures
from dloftbs_lab.evaluation.report.all_tables import tables
from dloftbs_lab.evaluation.report.kind_tables import kinds_table
from dloftbs_lab.evaluation.runner.run import evaluate
from dloftbs_lab.evaluation.suites import open_suite


def table(tmp_path, *names):
    bars = suite(*(Bars(name) for name in names), name="kinds")
    return evaluate([bars], [method(stubs.raising), method(stubs.shifted)], tmp_path)


def test_a_row_for_each_kind_and_a_group_of_columns_for_each_method(tmp_path):
    parts = table(tmp_path, "high curvature", "three cables")
    made = kinds_table(parts, "kinds")
    first, second = (dict(zip(made.columns, row, strict=True)) for row in made.rows)
    assert (first["kind"], second["kind"]) == ("high curvature", "three cables")
    assert round(first["raising: clean, %"], 1) == 66.7
    assert first["raising: L3 px"] == 0.0
    assert (first["shifted: clean, %"], round(first["shifted: L3 px"])) == (0.0, 7)
    assert (first["mBEST*: clean, %"], first["mBEST*: L3 px"]) == (97.0, 0.78)
    assert first["authors' code*: L3 px"] == 0.5
    assert second["authors' code*: clean, %"] is second["mBEST*: L3 px"] is None
    assert not any("goal" in column for column in made.columns)
    assert paper_figures.KINDS_ORIGIN in made.note
    assert [one.name for one in tables(parts)][1:3] == ["kinds-clean", "kinds"]


def test_a_kind_that_nobody_published_stands_alone(tmp_path):
    (row,) = kinds_table(table(tmp_path, "knots"), "kinds").rows
    assert len(row) == 5


def test_every_published_kind_is_in_the_suite():
    names = [sequence.name for sequence in open_suite("kinds", scale=0.01, size=(180, 320)).sequences]
    assert [kind for kind, method in paper_figures.KINDS if method == "mBEST"] == names
    assert {method for _, method in paper_figures.KINDS} == set(paper_figures.KINDS_METHODS)
