"""The benchmarks' own arithmetic: tables, pages, sums, differences. What they measure is for people to read."""

from __future__ import annotations

import hashlib
import json
import re
import sys
from dataclasses import make_dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from benchmarks import (
    coloured_cables,
    compare,
    compare_run,
    constants,
    digests_run,
    english,
    growth,
    linking_pictures,
    object_masks,
    original_curves,
    pictured_gaps,
    process,
    profile,
    real_footage,
    segmentation,
    summary,
)
from benchmarks.docs import published
from benchmarks.fit_strokes import ariadne_pictures, labelled_pictures
from benchmarks.gap_relief import FOCAL_PX, Relief
from benchmarks.readings import look_at
from benchmarks.timing import UNSTEADY, Table, interleaved

from dloftbs import Frame, Pipeline
from dloftbs_lab.synthetic import RealMotionSequence, missing_recordings

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "maintainers" / "performance-details.md"
BLOCKS = ("machine", "speed", "growth", "profile", "throughput", "recordings", "batch", "process")


@pytest.mark.parametrize("kind", pictured_gaps.KINDS)
def test_a_gap_over_a_photograph_shows_its_cables_and_is_the_same_again(kind: str, tmp_path: Path) -> None:
    ground = np.full((60, 90, 3), 180, np.uint8)
    cv2.imwrite(str(tmp_path / "ground.png"), ground)
    once, again = (next(pictured_gaps.list_gaps([tmp_path / "ground.png"], kind, 3, 1)) for _ in range(2))
    assert len(once.cables) == (2 if kind in pictured_gaps.ENDS else 1)
    assert once.frame.mask is not None
    assert once.frame.image is not None
    count, _ = cv2.connectedComponents(once.frame.mask.astype(np.uint8))
    assert count - 1 == 2  # all kinds have one gap
    assert (once.frame.image == again.frame.image).all()
    assert once.frame.depth is not None
    assert again.frame.depth is not None
    np.testing.assert_array_equal(once.frame.depth, again.frame.depth)


def test_a_relief_has_cables_above_its_table_and_covers_above_both() -> None:
    relief, band = Relief((60, 90), np.random.default_rng(5)), np.zeros((60, 90), bool)
    band[26:34, :50] = True
    relief.add_cable(band, 8.0)
    strip = np.zeros_like(band)
    strip[20:40, 20:30] = True
    relief.add_cover(strip)
    depth, camera = relief.measure(band)
    assert camera.fx == FOCAL_PX
    known = np.where(depth > 0.0, depth, np.nan)
    cable, table, cover = (np.nanmedian(known[rows, columns]) for rows, columns in ROOMS)
    assert cover < cable < table


ROOMS = ((slice(29, 31), slice(5, 15)), (slice(5, 15), slice(5, 15)), (slice(25, 35), slice(22, 28)))
"""Rows and columns of a cable, of the table beside it, and of a cover."""


@pytest.mark.parametrize(
    "read",
    [
        lambda folder: labelled_pictures(folder, "c1"),
        ariadne_pictures,
        lambda folder: list(segmentation.sets("mbest", folder, [0])),
    ],
    ids=["EWD", "Ariadne", "mBEST"],
)
def test_photographs_that_are_missing_end_a_benchmark_and_are_named(read, tmp_path):
    with pytest.raises(SystemExit, match=re.escape(str(tmp_path.resolve()))):
        read(tmp_path)


def test_tools_label_cables_with_their_mistakes():
    upright, across = (np.zeros((40, 60), bool) for _ in range(2))
    upright[:, 20:25] = True
    across[18:23] = True
    across &= ~upright
    for name, most in (("without a mistake", 2), ("all cut", 3), ("one cable missed", 1)):
        tool = object_masks.TOOLS[name]
        assert tool is not None
        labels = tool([upright, across], np.random.default_rng(1))
        assert labels.max() == most
        assert ((labels > 0) == (across if name == "one cable missed" else upright | across)).all()


def test_functions_take_turns_and_the_first_two_do_not_count():
    calls = []
    times = interleaved({"a": lambda: calls.append("a"), "b": lambda: calls.append("b")}, 3)
    assert "".join(calls) == "ababababab"
    assert {name: len(ms) for name, ms in times.items()} == {"a": 3, "b": 3}


def test_a_table_has_ratios_and_shares_that_add_up_and_marks_what_is_unsteady(capsys):
    whole = np.full(100, 4.0)
    table = Table("title", {"Lee": np.full(10, 2.0)}, whole)
    table.row("all", whole)
    table.row("one", np.full(100, 1.0), part=True)
    table.row("other", np.array([2.9] * 97 + [6.2333333333] * 3), part=True)
    table.end()
    heading, of_all, one, other, note, *_ = capsys.readouterr().out.splitlines()
    assert heading.split() == ["title", "p50", "ms", "p99", "ms", "share", "/", "Lee"]
    assert of_all.split() == ["all", "4.000", "4.000", "2.000"]
    assert one.split() == ["one", "1.000", "1.000", "25.0", "%", "0.500"]
    assert other.split() == ["other", "2.900", "6.233", "75.0", "%", "1.450", "!"]
    assert note == UNSTEADY


def test_a_steady_table_has_no_note(capsys):
    table = Table("title", {})
    table.row("all", np.array([1.0, 1.9]))
    table.end()
    assert "!" not in capsys.readouterr().out


def test_figures_go_into_their_place_of_a_page_and_nowhere_else(tmp_path, capsys):
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- made: x -->\nold\n<!-- end -->\nb\n<!-- made: y -->\nother\n<!-- end -->\nc\n")
    for _ in range(2):
        with published("x", page):
            sys.stdout.write("1 \\1 of 2\n\n")
    made = "a\n<!-- made: x -->\n```text\n1 \\1 of 2\n```\n<!-- end -->\nb\n<!-- made: y -->\nother\n<!-- end -->\nc\n"
    assert page.read_text() == made
    assert capsys.readouterr().out == "1 \\1 of 2\n\n" * 2


def test_a_page_without_the_place_is_refused_before_anything_is_measured(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("nothing here\n")
    with pytest.raises(ValueError, match="no place for the figures of 'x'"), published("x", page):
        pytest.fail("measured in vain")


def test_the_users_screen_has_the_figures_of_the_details():
    made = summary.summarise(PAGE.read_text("utf-8"))
    screen = (DOCS / "performance.md").read_text("utf-8")
    assert f"<!-- made: summary -->\n```text\n{made}\n```\n<!-- end -->" in screen
    assert len(screen.splitlines()) < 40


def test_a_screen_without_its_figures_is_refused():
    page = PAGE.read_text("utf-8")
    with pytest.raises(ValueError, match="no figures of 'process': run its benchmark first"):
        summary.summarise(page.replace("<!-- made: process -->", ""))
    with pytest.raises(ValueError, match="no figure"):
        summary.summarise(page.replace("mask to tracked curves", "mask to something"))


def test_figures_of_a_run_that_failed_do_not_reach_the_page(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(before := "<!-- made: x -->\nold\n<!-- end -->\n")

    def fail():
        with published("x", page):
            sys.stdout.write("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert page.read_text() == before


@pytest.mark.parametrize("name", BLOCKS)
def test_the_page_has_a_place_for_each_benchmark(name):
    assert PAGE.read_text("utf-8").count(f"<!-- made: {name} -->\n") == 1


def test_import_times_are_summed_by_package():
    text = """import time: self [us] | cumulative | imported package
import time:       100 |        100 | _io
import time:       200 |        300 |     json
import time:      1000 |       2000 |   numpy.core
import time:      3000 |       5000 | numpy
import time:    500000 |     500000 |   dloftbs.skeleton.kernels.thinning
import time:      1500 |     501500 | dloftbs.pipeline
warning: something else
"""
    assert process.seconds_by_package(text) == pytest.approx(
        {"Python itself": 3e-4, "numpy": 4e-3, "dloftbs, kernels from the cache": 0.5, "dloftbs": 1.5e-3}
    )


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0, 2.0])
def test_a_power_law_has_its_exponent(power):
    x = np.array([3.0, 10.0, 40.0, 500.0])
    assert growth.exponent(x, 7.0 * x**power) == pytest.approx(power, abs=1e-9)


def frames_with(*curves, tracks=()):
    return {"digest": json.dumps([curves, tracks]), "frames": [{"curves": list(curves), "tracks": list(tracks)}]}


def test_two_runs_that_are_the_same():
    one = frames_with([[0.0, 1.0], [2.0, 3.0]])
    assert compare.difference(one, one) == "the same, bit for bit: 1 frames"


@pytest.mark.parametrize(
    ("new", "said"),
    [
        (frames_with([[0.0, 1.0], [2.0, 3.25]]), "of 1 frames: curves differ by 0.25 px at most"),
        (frames_with([[0.0, 1.0], [2.0, 3.0]], [[9.0, 9.0]]), "of 1 frames: 1 frames have another number of curves"),
        (frames_with([[0.0, 1.0], [2.0, 3.0]], tracks=[[1, "confirmed"]]), "of 1 frames: 1 frames have other tracks"),
    ],
)
def test_two_runs_that_differ(new, said):
    assert compare.difference(frames_with([[0.0, 1.0], [2.0, 3.0]]), new) == said


def test_a_digest_tells_what_a_bit_changes():
    mask = np.zeros((60, 120), np.uint8)
    mask[28:33, 10:110] = 1
    moved = np.roll(mask, 1, axis=0)
    runs = [compare_run.curves([Frame(mask=each)]) for each in (mask, mask.copy(), moved)]
    assert runs[0] == runs[1]
    assert runs[0]["digest"] != runs[2]["digest"]
    assert compare.difference(runs[0], runs[2]).startswith("of 2 frames: curves differ by 1 px")  # of both methods


def test_a_profile_tells_kernels_from_the_rest():
    stats, milliseconds = profile.profiled(1, 8)
    assert milliseconds > 0.0
    kinds = {profile.kind_of(function) for function in profile.entries(stats)}
    assert kinds == {profile.KERNEL, profile.PYTHON, profile.LIBRARY}
    names = {profile.name_of(function) for function in profile.entries(stats)}
    assert {"pipeline.pipeline.process", "skeleton.kernels.thinning.thin", "cleaning.morphology.clean"} <= names
    drawn = list(profile.boxes(stats))
    assert [box.function[2] for box in drawn if box.depth == 0] == ["process"]
    assert max(box.left + box.width for box in drawn) <= 1.0 + 1e-9
    level = sorted((box for box in drawn if box.depth == 2), key=lambda box: box.left)
    assert all(a.left + a.width <= b.left + 1e-9 for a, b in pairwise(level))


@pytest.mark.parametrize("other", [-0.0, 1e-323, 0, (0.0,), np.zeros(()), None, "0.0"])
def test_a_digest_of_results_tells_values_apart_to_the_last_bit(other):
    one, second = hashlib.sha256(), hashlib.sha256()
    digests_run.add(one, 0.0)
    digests_run.add(second, other)
    assert one.digest() != second.digest()


def test_a_digest_of_results_leaves_out_what_holds_nothing_by_default():
    def digest(value):
        found = hashlib.sha256()
        digests_run.add(found, value)
        return found.digest()

    old = make_dataclass("Old", [("a", float), ("b", int | None, None)])
    new = make_dataclass("New", [("a", float), ("c", tuple, (None, None)), ("b", int | None, None)])
    assert digest(old(1.0)) == digest(new(1.0)) == digest(new(1.0, ()))
    assert digest(old(1.0, 2)) == digest(new(1.0, (), 2))
    assert len({digest(one) for one in (old(1.0), old(1.0, 0), new(1.0, (None, 3)), new(2.0))}) == 4


def test_a_digest_of_results_is_of_values_and_not_of_times():
    def digest(mask):
        found = hashlib.sha256()
        digests_run.add(found, Pipeline().process(Frame(mask=mask)))
        return found.digest()

    mask = np.zeros((60, 120), np.uint8)
    mask[28:33, 10:110] = 1
    assert digest(mask) == digest(mask.copy()) != digest(np.roll(mask, 1, axis=0))


def test_openings_entries_phrases_and_words_are_counted_in_docstrings_alone(tmp_path, capsys, monkeypatch):
    page = tmp_path / "page.py"
    lines = [
        '"""Where things are."""',
        "# What is a comment?",
        "LIMIT = 3",
        '"""Number of things; what is',
        "more is dearer.",
        "",
        "    name : str",
        "        How it is called.",
        '"""',
        "def place():",
        '    """Return so many things."""',
        '    return "How many?"',
    ]
    page.write_text("\n".join(lines))
    assert english.findings(page) == [
        (page, 1, "openings", "Where"),
        (page, 4, "phrases", "what is"),
        (page, 5, "words", "dearer"),
        (page, 8, "entries", "How"),
        (page, 11, "phrases", "so many"),
    ]
    monkeypatch.setattr(sys, "argv", ["english", str(tmp_path)])
    english.main()
    assert capsys.readouterr().out.splitlines()[-1] == (
        "        1        1        2        1        0        0        0 "
        "openings, entries, phrases, words, long, relative, mean in 1 files"
    )


def test_constants_are_read_and_changed_where_they_are_defined(tmp_path, monkeypatch):
    monkeypatch.setattr(constants, "SOURCES", tmp_path)
    page = tmp_path / "page.py"
    page.write_text(
        '"""A module."""\n'
        "_REACH_WIDTHS, _MAX = 2.0, 8  # é\n"
        "_SLIP = (0.6, -0.5)\n"
        '"""Cost of a step;\nin turn.\n\nSource: by hand;\nno | reason.\n"""\n'
        'NAMES = ("a", 1)\n'
        "_FLAG = True\n"
        "_LIMIT: float = 3.0\n"
        '"""Limit."""\n',
        "utf-8",
    )
    found = {one.name: one for one in constants.constants(tmp_path)}
    assert {name: one.text for name, one in found.items()} == {
        "_REACH_WIDTHS": "2.0",
        "_MAX": "8",
        "_SLIP": "(0.6, -0.5)",
        "_LIMIT": "3.0",
    }
    assert {name: one.lacks for name, one in found.items()} == {
        "_REACH_WIDTHS": "docstring",
        "_MAX": "docstring",
        "_SLIP": "",
        "_LIMIT": "unit, source",
    }
    assert found["_SLIP"].meaning == "Cost of a step; in turn."
    assert "| `_SLIP` | `(0.6, -0.5)` | Cost of a step; in turn. | by hand; no \\| reason. |" in constants.tables(
        found.values()
    )
    assert not found["_MAX"].scalable
    assert "_REACH_WIDTHS, _MAX = 4.0, 8  # é\n" in found["_REACH_WIDTHS"].scaled(2.0)
    assert "_SLIP = (0.3, -0.25)\n" in found["_SLIP"].scaled(0.5)
    assert "_LIMIT: float = 1.5\n" in found["_LIMIT"].scaled(0.5)


@pytest.mark.parametrize("room", constants.ROOMS)
def test_every_constant_of_the_stages_has_a_unit_and_a_source(room):
    found = list(constants.constants(constants.SOURCES / room))
    assert found
    assert {one.key: one.lacks for one in found if one.lacks} == {}


def test_the_table_of_what_constants_change_is_about_those_that_there_are():
    page = constants.PAGE.read_text("utf-8")
    rows = re.findall(r"^\| `(\S+\.py:\w+)` \| `(.*?)` \|", page, re.MULTILINE)
    known = {one.key: one.text for room in constants.ROOMS for one in constants.constants(constants.SOURCES / room)}
    assert len(rows) > 0.4 * len(known)
    assert {key: text for key, text in rows if known.get(key) != text} == {}


def test_the_page_lists_the_constants_as_they_are():
    found = [one for room in constants.ROOMS for one in constants.constants(constants.SOURCES / room)]
    assert constants.tables(found) in constants.PAGE.read_text("utf-8"), "run `python -m benchmarks.constants`"


def test_the_page_of_linking_shows_what_linking_does():
    page = (DOCS / "linking-rules.md").read_text("utf-8")
    looks = {scene.name: look_at(scene.draw()) for scene in linking_pictures.SCENES}
    assert linking_pictures.with_tables(page, looks) == page, "run `python -m benchmarks.linking_pictures`"
    pictures = {path.stem for path in (DOCS / "images" / "linking").glob("*.png")}
    assert pictures == set(looks) == set(re.findall(r"\(images/linking/([a-z-]+)\.png\)", page))


def test_the_costs_that_the_page_on_linking_quotes_are_in_the_tables():
    quoted, tables = (
        set(re.findall(r"\b\d+\.\d\d\b", (DOCS / name).read_text("utf-8")))
        for name in ("linking.md", "linking-rules.md")
    )
    assert len(quoted) >= 5
    assert quoted <= tables


def test_the_page_of_the_authors_masks_has_the_figures_of_this_code(shared_data):
    page = (DOCS / "maintainers" / "authors-masks.md").read_text("utf-8")
    masks = shared_data / "masks"
    curves = original_curves.original_curves(masks)
    rows = {
        Path(name).stem: original_curves.row_of(original_curves.read_mask(masks / name), curves[name])
        for name in curves
    }
    assert original_curves.with_figures(page, rows) == page, "run `python -m benchmarks.original_curves`"
    nothing = dict.fromkeys(rows, ("0.00",) * 7)
    assert original_curves.with_figures(page, nothing).count("| 0.00 " * 7) == len(rows) == 22


def test_the_functions_that_the_page_profiles_are_those_of_the_code():
    block = re.search(r"<!-- made: profile -->\n(.*?)<!-- end -->", PAGE.read_text("utf-8"), re.DOTALL)
    assert block is not None
    names = re.findall(r"^  [ *] ([a-z_.]+)\.([a-z_]+) +\d", block[1], re.MULTILINE)
    assert len(names) > 20
    missing = set()
    for module, function in names:
        source = constants.SOURCES.joinpath(*module.split(".")).with_suffix(".py")
        if not source.is_file() or not re.search(rf"^ *def {function}\(", source.read_text("utf-8"), re.MULTILINE):
            missing.add(f"{module}.{function}")
    assert missing == set()


def test_a_curve_within_half_a_width_of_the_truth_is_right_and_one_beside_it_is_not():
    line = np.array([[20.0, 60.0], [180.0, 60.0]])
    mask = np.zeros((120, 200), np.bool_)
    mask[55:66, 15:186] = True
    words, right = real_footage.beside_truth(Pipeline().detect(Frame(mask=mask)), [line])
    assert right
    assert words.startswith("off by 0.")
    assert not real_footage.beside_truth(Pipeline().detect(Frame(mask=mask)), [line + 9.0])[1]
    mask[20:31, 15:186] = True
    assert not real_footage.beside_truth(Pipeline().detect(Frame(mask=mask)), [line])[1]
    assert real_footage.beside_truth(Pipeline().detect(Frame(mask=np.zeros_like(mask))), [line]) == (
        "nothing found",
        False,
    )


def test_cables_of_several_colours_are_counted_by_the_mask_and_with_the_image(shared_data):
    if missing_recordings(shared_data / "motion") is not None:
        pytest.skip("needs ../shared/data/motion")
    sequence = RealMotionSequence(shared_data / "motion", 3, "coloured image", size=(360, 640))
    objects, by_mask, with_image = coloured_cables.count(sequence, step=50).tolist()
    assert objects == 9
    assert 0 < by_mask <= 9
    assert 0 < with_image <= 9


def test_the_table_of_coloured_cables_has_a_row_for_each_number() -> None:
    table = coloured_cables.make_table({2: np.array([9, 5, 7]), 4: np.array([8, 1, 2])})
    assert table.splitlines()[2:] == ["| 2 | 9 | 5 | 7 |", "| 4 | 8 | 1 | 2 |"]
