import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs.errors import SourceError
from dloftbs_lab.evaluation.report import docs_page
from dloftbs_lab.evaluation.report.docs_page import BEGIN, END, block_of
from dloftbs_lab.evaluation.report.first_page import first_page, readme_line
from dloftbs_lab.evaluation.report.write import write_report
from dloftbs_lab.evaluation.runner.run import evaluate

ROOT = Path(__file__).parents[4]
SUMMARY = ROOT / "docs" / "results" / "summary.json"
METHODS = [method(stubs.perfect, "default"), method(stubs.lone, "paper")]


def written(folder, *suites):
    parts = evaluate(suites, METHODS, folder / "parts")
    write_report(suites, parts, folder, "stubs", mark="a trial")
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    rgbd = suite(Bars("0 deep", deep=True), name="rgbd-artificial")
    return written(tmp_path_factory.mktemp("run"), suite(Bars("0 one"), Bars("1 two"), name="rgb"), rgbd)


@pytest.fixture
def docs(tmp_path):
    """Documents with a place for results, and old pages."""
    for name in ("docs/results.md", "README.md"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"By hand.\n{BEGIN}outdated\n{END}After.\n")
    (tmp_path / "docs" / "results").mkdir()
    (tmp_path / "docs" / "results" / "gone.md").write_text("old")
    (tmp_path / "docs" / docs_page.PICTURES).mkdir(parents=True)
    (tmp_path / "docs" / docs_page.PICTURES / "old.png").write_bytes(b"")
    return tmp_path / "docs"


def test_a_page_for_each_suite_and_what_was_written_by_hand_stays(run, docs):
    docs_page.assemble(run, docs)
    assert {path.name for path in (docs / "results").glob("*.md")} == {
        "rgb.md", "rgbd-artificial.md", "paper.md", "overall.md"
    }  # fmt: skip
    for page in (docs / "results.md", docs.parent / "README.md"):
        text = page.read_text()
        assert text.startswith(f"By hand.\n{BEGIN}")
        assert text.endswith(f"{END}After.\n")
        assert "outdated" not in text
    assert "Table I: " in (docs / "results" / "paper.md").read_text()
    assert "| suite |" in (docs / "results" / "overall.md").read_text()


def test_pictures_lie_beside_and_every_link_leads_somewhere(run, docs):
    docs_page.assemble(run, docs)
    linked = set()
    for page in [docs / "results.md", *(docs / "results").glob("*.md")]:
        for link in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
            if not link.startswith("http") and "performance" not in link and "weights" not in link:
                assert (page.parent / link).exists() or "results-explained" in link, (page, link)
                linked.add((page.parent / link).resolve())
    pictures = set((docs / docs_page.PICTURES).resolve().iterdir())
    assert pictures
    assert pictures <= linked


def test_the_first_page_is_made_of_the_figures_in_short_alone(run, docs):
    docs_page.assemble(run, docs)
    summary = json.loads((docs / "results" / "summary.json").read_text())
    assert block_of(docs / "results.md") == first_page(summary)
    assert block_of(docs.parent / "README.md") == readme_line(summary)
    assert "100.00" in first_page(summary)
    assert "**a trial.**" in first_page(summary)
    assert summary["suites"]["rgb"]["methods"]["paper"]["missing"] == 6


def test_readme_has_the_default_that_knows_of_one_cable_beside_the_published_method(run, docs, tmp_path):
    one_cable = written(tmp_path / "one", suite(Bars("0 one"), name="rgb"))
    docs_page.assemble(run, docs)
    assert readme_row(docs)[1] == "-"
    docs_page.assemble(run, docs, one_cable=one_cable)
    assert readme_row(docs)[1].startswith("100")
    assert "one_cable" not in (docs / "results.md").read_text()


def readme_row(docs):
    """Return the shares of right frames of README's first suite, as they are written: default, one cable, published."""
    (line,) = [line for line in block_of(docs.parent / "README.md").splitlines() if "two grippers" in line]
    return [cell.strip() for cell in line.strip("|").split("|")][1:]


def test_photographs_have_figures_and_no_pictures_and_stay_until_they_are_scored_again(run, docs, tmp_path):
    photographs = written(tmp_path / "photographs", suite(Bars("cables", fps=None), name="cables"))
    docs_page.assemble(run, docs, photographs=photographs)
    page = (docs / "results" / "photographs.md").read_text()
    assert "### cables" in page
    assert "![" not in page
    assert str(tmp_path) not in page
    assert "[cables†](results/photographs.md)" in (docs / "results.md").read_text()
    docs_page.assemble(run, docs)
    assert (docs / "results" / "photographs.md").read_text() == page
    assert "[cables†](results/photographs.md)" in (docs / "results.md").read_text()


def test_pages_without_a_place_or_without_a_run_are_errors(run, docs, tmp_path):
    with pytest.raises(SourceError, match="cannot make the pages"):
        docs_page.assemble(tmp_path / "nothing", docs)
    (docs / "results.md").write_text("no place")
    with pytest.raises(SourceError, match="has no place for results"):
        docs_page.assemble(run, docs)


def test_a_picture_becomes_small(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (1200, 1600, 3)).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "noise.png"), noise)
    name, data = docs_page.small(tmp_path / "noise.png")
    assert name.endswith("-noise.jpg")
    assert len(data) <= docs_page.MAX_BYTES


def test_what_readme_and_the_first_page_quote_are_the_last_results():
    summary = json.loads(SUMMARY.read_text())
    assert block_of(ROOT / "README.md") == readme_line(summary)
    assert block_of(ROOT / "docs" / "results.md") == first_page(summary)


def test_no_number_stands_on_the_first_page_but_those_of_the_last_results():
    page = (ROOT / "docs" / "results.md").read_text()
    by_hand = page.replace(block_of(ROOT / "docs" / "results.md"), "")
    assert set(re.findall(r"\d+", by_hand)) == {"2023"}
    assert len(page.splitlines()) <= 60


def test_no_document_has_a_goal_among_its_results():
    for page in [ROOT / "docs" / "results.md", *(ROOT / "docs" / "results").glob("*.md")]:
        assert not re.search(r"\| (goal|bar)\b", page.read_text()), page
