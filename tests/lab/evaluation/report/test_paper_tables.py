import json
from pathlib import Path

import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation import paper_figures
from dloftbs_lab.evaluation.paper_figures import MARK
from dloftbs_lab.evaluation.report.paper_tables import SUITES_OF_PAPER, TABLES_OF_PAPER, paper_tables, scenario_of
from dloftbs_lab.evaluation.report.write import write_report
from dloftbs_lab.evaluation.runner.finished_parts import FrameRow, Key, Part
from dloftbs_lab.evaluation.runner.run import evaluate

PAPER = Path(__file__).parents[4].parent / "shared" / "PAPER.md"


def printed_tables():
    """Return the paper's tables, as the shared notes have them: the cells of each row by its first, by the table."""
    if not PAPER.is_file():
        pytest.skip("needs ../shared/PAPER.md")
    tables = {}
    for section in PAPER.read_text().split("\n## ")[1:]:
        rows = [
            [cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:1] == "|"
        ]
        if rows:
            tables[section.partition(":")[0]] = {first: cells for first, *cells in rows[2:]}
    return tables


@pytest.mark.parametrize(
    ("name", "published"),
    [
        ("Table I", paper_figures.TABLE_I),
        ("Table II", paper_figures.TABLE_II),
        ("Table III", paper_figures.TABLE_III),
        ("Table IV", paper_figures.TABLE_IV),
    ],
)
def test_every_cell_is_as_printed(name, published):
    short = {f"{row.method} {row.figure}".strip().replace("L3 m", "m"): list(row.cells) for row in published}
    assert short == printed_tables()[name]


def row(sequence, **figures):
    known = {"l1_px": None, "l2_px": None, "l3_px": None, "l3_whole_px": None, "l3_mm": None, "ms": 2.0, **figures}
    counts = {"n_true": 1, "n_found": 1, "missing": 0, "redundant": 0, "right": 1} | known
    others = {"length_error": None, "dice": None, "clean": True, "failure": None}
    return FrameRow(suite="", sequence=sequence, index=0, method="", **{**others, **counts})


def part(suite_name, sequence, rows, name="mine"):
    return Part(Key(suite_name, sequence, name, 0, len(rows), "", "", ""), tuple(rows))


def ours(tables, name):
    (table,) = [one for one in tables if one.name == name]
    key = table.columns.index("figure") + 1 if "figure" in table.columns else 2
    return {cells[key - 1]: cells[key:] for cells in table.rows if MARK not in cells}, table


def test_table_1_has_mean_and_deviation_by_the_papers_number_over_all_scenes_of_it():
    parts = [
        part("rgb", "0 plain", [row("0 plain", l1_px=1.0, l2_px=0.5, scene="a")]),
        part("rgb", "0 plain, seed 1", [row("0 plain, seed 1", l1_px=3.0, l2_px=0.5, scene="b")]),
        part("rgb", "6 self-intersection", [row("6", l1_px=2.5, n_found=0)]),
    ]
    mine, table = ours(paper_tables(parts), "table-1")
    assert table.columns == ("method", "from", "figure", *"0123456")
    assert mine["L1 px, interval"] == ("[1.00, 3.00]", *"------")
    assert mine["L1 px"] == ("2.00±1.00", "-", "-", "-", "-", "-", "2.50±0.00")
    assert mine["L2 px"][0] == "0.50±0.00"
    assert mine["frames without a curve"] == ("0", "0", "0", "0", "0", "0", "1")
    assert [cells[0] for cells in table.rows[:9]] == ["DLOFTBs"] * 3 + ["Ariadne+"] * 3 + ["FastDLO"] * 3
    assert all(cells[1] == MARK for cells in table.rows[:9])


def test_table_2_counts_in_as_many_images_as_the_paper_has_and_takes_photographs():
    parts = [
        part("several-cables", "2 cables", [row("2 cables", l3_whole_px=4.0, missing=1, n_true=2)] * 31),
        part("my photographs", "my photographs", [row("", l3_whole_px=2.0, redundant=1)] * 62),
        part("kinds", "one loop", [row("one loop", l3_whole_px=9.0)]),
    ]
    (table,) = paper_tables(parts)
    assert table.rows[3:] == (
        ("mine", "here, generated", "4.00", "62.00", "0.00", "2.00", "31", "62"),
        ("mine", "here, my photographs", "2.00", "0.00", "62.00", "2.00", "62", "62"),
    )
    assert table.rows[2] == ("DLOFTBs", MARK, "27.17", "3", "33", "39.2", "62", None)


def test_table_3_has_both_units():
    mine, table = ours(paper_tables([part("rgbd", "9 far", [row("9 far", l1_px=1.0, l1_mm=5.0)])]), "table-3")
    assert table.columns[-1] == "9"
    assert (mine["L1 mm"][9], mine["L1 px"][9], mine["L2 mm"][9]) == ("5.00", "1.00", "-")


def test_table_4_has_the_surface_line_for_methods_that_follow_it():
    deep = {"l3_mm": 4.8, "l3_whole_px": 0.5}
    on_surface, on_axis = row("1 bent", **deep, l3_surface_mm=0.9), row("1 bent", l3_mm=0.2, l3_surface_mm=4.9)
    mine, _ = ours(paper_tables([part("rgbd-artificial", "1 bent", [on_surface])]), "table-4")
    assert mine["L3 mm mean"][1] == mine["L3 mm max"][1] == "4.80"
    assert mine["L3 mm, surface mean"][1] == "0.900"
    assert mine["L3 px min"][1] == "0.500"
    mine, _ = ours(paper_tables([part("rgbd-artificial", "1 bent", [on_axis])]), "table-4")
    assert not any("surface" in name for name in mine)


def test_the_scenario_is_the_number_in_front():
    assert [scenario_of(name) for name in ("0 plain", "12 x, seed 3", "plain")] == ["0", "12", None]


def test_a_report_of_the_paper_has_its_tables_alone(tmp_path):
    suites = [suite(Bars("0 one"), name=name) for name in SUITES_OF_PAPER]
    parts = evaluate(suites, [method(stubs.perfect)], tmp_path / "parts")
    report = write_report(suites, parts, tmp_path, "stubs")
    made = json.loads((tmp_path / "report.json").read_text())["tables"]
    assert [name for name in made if name in TABLES_OF_PAPER] == list(TABLES_OF_PAPER)
    text = report.text(only_paper=True)
    assert all(f"Table {number}: " in text for number in ("I", "II", "III", "IV"))
    assert "All suites" in report.text()
    assert "All suites" not in text
