"""Intervals: those of arithmetic, the same in every run, and over scenes rather than frames."""

import csv
import io
import math

import numpy as np
import pytest
from lab.evaluation import runner_stubs as stubs
from lab.evaluation.runner_stubs import Bars, method, suite

from dloftbs_lab.evaluation.report.all_tables import tables
from dloftbs_lab.evaluation.report.spread import RESAMPLES, Sample, draws, frames_of, sequences_of
from dloftbs_lab.evaluation.report.table import Estimate, Table, percent, shown
from dloftbs_lab.evaluation.report.write import write_report
from dloftbs_lab.evaluation.runner.run import evaluate


def sample(values, scenes):
    return Sample(tuple(values), tuple(scenes))


def itself(value):
    return value


def slow_interval(values, scenes, statistic):
    """Resample scenes by writing out each bootstrap sample."""
    names = list(dict.fromkeys(scenes))
    found = []
    for counts in draws(len(names)).astype(int):
        items = [v for v, s in zip(values, scenes, strict=True) for _ in range(counts[names.index(s)])]
        if items:
            found.append(statistic(items))
    return np.quantile(found, (0.025, 0.975), method="nearest").tolist()


def values_and_scenes(seed, count=60, scenes=8):
    rng = np.random.default_rng(seed)
    of = np.concatenate([np.arange(scenes), rng.integers(0, scenes, count - scenes)])
    return (rng.normal(3.0, 1.0, count) + of).tolist(), [f"scene {i}" for i in of]


def test_a_mean_has_the_interval_of_the_samples_written_out():
    values, scenes = values_and_scenes(1)
    found = sample(values, scenes).mean(itself, 100.0)
    assert found == pytest.approx(100.0 * np.mean(values))
    assert [found.low, found.high] == pytest.approx([100.0 * v for v in slow_interval(values, scenes, np.mean)])


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_a_quantile_has_the_interval_of_the_samples_written_out(share):
    values, scenes = values_and_scenes(2)

    def slow(items):
        return sorted(items)[min(int(share * len(items)), len(items) - 1)]

    found = sample(values, scenes).quantile(itself, share)
    assert found == slow(values)
    assert [found.low, found.high] == slow_interval(values, scenes, slow)


def test_a_ratio_is_of_sums():
    pairs, scenes = [(1, 2), (3, 3), (0, 5), (2, 2)], "aabc"
    found = sample(pairs, scenes).ratio(lambda p: p[0], lambda p: p[1], -1.0, offset=1.0)
    assert found == pytest.approx(1.0 - 6.0 / 12.0)
    assert (found.low, found.high) == (0.0, 1.0)


def test_it_is_the_same_in_every_run():
    values, scenes = values_and_scenes(3)
    draws.cache_clear()
    first = sample(values, scenes).mean(itself)
    draws.cache_clear()
    again = sample(values, scenes).mean(itself)
    assert (first, first.low, first.high) == (again, again.low, again.high)
    assert draws(8).shape == (RESAMPLES, 8)
    assert (draws(8).sum(axis=1) == 8).all()


def test_frames_of_one_scene_are_no_sample():
    """Ten times the same frames tell no more; as scenes of their own they seem to."""
    values, scenes = values_and_scenes(4, count=20)
    found = sample(values, scenes).mean(itself)
    repeated = sample(values * 10, scenes * 10).mean(itself)
    assert (repeated.low, repeated.high) == pytest.approx((found.low, found.high))
    alone = sample(values * 10, range(200)).mean(itself)
    assert alone.high - alone.low < 0.6 * (found.high - found.low)


def test_the_interval_holds_the_true_mean_as_often_as_it_says():
    rng, held = np.random.default_rng(0), 0
    for _ in range(300):
        scenes = np.repeat(np.arange(20), 6)
        values = rng.normal(0.0, 1.0, 20)[scenes] + rng.normal(0.0, 0.3, len(scenes))
        found = sample(values.tolist(), scenes.tolist()).mean(itself)
        held += found.low <= 0.0 <= found.high
    assert 0.88 < held / 300 < 0.99


def test_one_scene_has_no_interval_and_nothing_has_no_figure():
    alone = sample([1.0, 2.0], "aa").mean(itself)
    assert alone == 1.5
    assert not isinstance(alone, Estimate)
    assert not isinstance(sample([1.0, 2.0], "aa").quantile(itself), Estimate)
    assert sample([], "").mean(itself) is None
    assert sample([None, None], "ab").mean(itself) is None
    assert sample([None], "a").quantile(itself) is None


def test_endless_errors_have_an_endless_end():
    found = sample([1.0, 2.0, 3.0, math.inf], "abcd").quantile(itself, 0.5)
    assert (found, found.high) == (3.0, math.inf)


def test_a_figure_is_read_with_as_many_decimals_as_its_ends():
    assert shown(Estimate(97.5, 94.123, 99.2)) == "97.5 [94.1, 99.2]"
    assert shown(Estimate(1.5, 0.25, 2.0)) == "1.50 [0.25, 2.00]"
    assert shown(Estimate(0.1234, 0.1, 0.2)) == "0.123 [0.100, 0.200]"
    assert shown(Estimate(0.0, 0.0, 0.0)) == "0.00 [0.00, 0.00]"
    assert shown(percent(Estimate(0.5, 0.25, 1.0))) == "50.0 [25.0, 100.0]"


def test_files_have_the_ends_in_columns_of_their_own_and_the_mark_in_another():
    table = Table("t", "Title", ("name", "rate"), (("a", Estimate(0.5, 0.25, 1.0)), ("b", None)), mark="quick run")
    rows = list(csv.DictReader(io.StringIO(table.csv())))
    assert rows[0] == {"name": "a", "rate": "0.5", "rate: low": "0.25", "rate: high": "1.0", "run": "quick run"}
    assert rows[1] == {"name": "b", "rate": "", "rate: low": "", "rate: high": "", "run": "quick run"}
    assert table.markdown().startswith("### Title (quick run)\n")
    assert table.text().startswith("Title (quick run)\n")
    assert type(table.records()[0]["rate"]) is float


class Single(Bars):
    """Images that have nothing to do with each other."""

    def __init__(self, name):
        super().__init__(name, fps=None)


def test_scenes_are_sequences_and_of_single_images_each(tmp_path):
    noisy = Bars("bars, noisy")
    noisy.scene_name = "bars"
    made = evaluate([suite(Bars(), noisy, Single("images"))], [method(stubs.named)], tmp_path)
    frames = frames_of(made)
    assert (len(frames), frames.count) == (9, 4)
    assert [row.scene for row in made[2].rows] == ["images #0", "images #1", "images #2"]
    assert sequences_of(made[:2]).count == 1


def test_the_summary_has_intervals_over_scenes(tmp_path):
    bars = [Bars(f"bars {i}", length=2 + i % 2) for i in range(8)]
    parts = evaluate([suite(*bars)], [method(stubs.raising)], tmp_path)
    table = tables(parts)[0]
    (row,) = (dict(zip(table.columns, row, strict=True)) for row in table.rows)
    assert (row["scenes"], row["frames"]) == (8, 20)
    clean = row["clean frames, %"]
    assert clean == pytest.approx(60.0)
    assert 50.0 <= clean.low < 60.0 < clean.high <= 200.0 / 3.0


def test_a_marked_report_says_so_everywhere(tmp_path):
    parts = evaluate([suite(Bars("a"), Bars("b"))], [method(stubs.named)], tmp_path / "parts")
    report = write_report([suite(Bars("a"), Bars("b"))], parts, tmp_path, "QUICK RUN", mark="quick run")
    assert report.text().startswith("QUICK RUN")
    assert (tmp_path / "report.md").read_text().startswith("QUICK RUN")
    files = list((tmp_path / "tables").glob("*.csv"))
    assert files
    for file in files:
        with file.open() as opened:
            assert {row["run"] for row in csv.DictReader(opened)} == {"quick run"}, file
    headings = [line for line in (tmp_path / "report.md").read_text().splitlines() if line.startswith("### ")]
    assert [line for line in headings if not line.endswith("(quick run)")] == ["### Where it loses", "### Pictures"]
