"""Tracking scores: small streams counted by hand, random ones against `motmetrics`."""

import itertools
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.errors import InputError
from dloftbs_lab.evaluation import TrackingScorer, TrackingScores

SAME_COUNTS = {
    "num_frames": "frames",
    "num_objects": "objects",
    "num_predictions": "outputs",
    "num_detections": "matches",
    "num_misses": "misses",
    "num_false_positives": "false_positives",
    "num_switches": "switches",
    "num_fragmentations": "fragmentations",
    "idtp": "id_matches",
    "mostly_tracked": "mostly_tracked",
    "partially_tracked": "partly_tracked",
    "mostly_lost": "mostly_lost",
}
SAME_RATES = ("mota", "motp", "idf1")


def random_stream(seed, frames=60, gate=30.0):
    """Yield ids and gated distances of objects that come and go, with tracks that miss, swap and invent."""
    rng = np.random.default_rng(seed)
    objects = int(rng.integers(1, 6))
    place = rng.uniform(0.0, 120.0, (objects, 2))
    name = {i: i + 1 for i in range(objects)}
    fresh = itertools.count(objects + 1)
    for _ in range(frames):
        place += rng.normal(0.0, 4.0, place.shape)
        if rng.random() < 0.15:
            a, b = rng.integers(objects, size=2)
            name[a], name[b] = name[b], name[a]
        if rng.random() < 0.1:
            name[int(rng.integers(objects))] = next(fresh)
        present = [i for i in range(objects) if rng.random() < 0.9]
        seen = [i for i in range(objects) if rng.random() < 0.85] if rng.random() < 0.9 else []
        rng.shuffle(seen)
        false = rng.uniform(0.0, 120.0, (rng.poisson(0.4), 2))
        found = np.concatenate((place[seen] + rng.normal(0.0, 5.0, (len(seen), 2)), false))
        distance = np.linalg.norm(place[present][:, None] - found[None], axis=2)
        distance[distance > gate] = np.nan
        yield present, [*(name[i] for i in seen), *(next(fresh) for _ in false)], distance


def ours(stream, gate=math.inf):
    scorer = TrackingScorer(gate)
    for frame in stream:
        scorer.add(*frame)
    return scorer.scores()


@pytest.fixture(scope="module")
def motmetrics():
    return pytest.importorskip("motmetrics")


def accumulated(motmetrics, stream):
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for ids, tracks, distance in stream:
        # Of objects that last had the same track it lets the first keep it: the one that had it most recently, here.
        latest = sorted(range(len(ids)), key=lambda i: -accumulator.last_match.get(ids[i], -1))
        accumulator.update([ids[i] for i in latest], tracks, distance[latest])
    return accumulator


def assert_same(scores, reference):
    for theirs, here in SAME_COUNTS.items():
        assert getattr(scores, here) == reference[theirs], here
    for rate in SAME_RATES:
        assert getattr(scores, rate) == pytest.approx(reference[rate], rel=1e-12, abs=1e-12, nan_ok=True), rate


@pytest.mark.parametrize("seed", range(25))
def test_random_streams_score_as_in_motmetrics(motmetrics, seed):
    stream = list(random_stream(seed))
    metrics = motmetrics.metrics.create()
    wanted = [*SAME_COUNTS, *SAME_RATES]
    reference = metrics.compute(accumulated(motmetrics, stream), metrics=wanted, return_dataframe=False)
    assert_same(ours(stream), reference)


def test_the_sum_over_sequences_is_the_overall_score_of_motmetrics(motmetrics):
    streams = [list(random_stream(seed)) for seed in (100, 101, 102)]
    metrics = motmetrics.metrics.create()
    wanted = [*SAME_COUNTS, *SAME_RATES]
    table = metrics.compute_many(
        [accumulated(motmetrics, stream) for stream in streams], metrics=wanted, generate_overall=True
    )
    assert_same(sum((ours(stream) for stream in streams), TrackingScores()), table.loc["OVERALL"])


def test_the_random_streams_have_everything_that_could_differ():
    total = sum((ours(random_stream(seed)) for seed in range(25)), TrackingScores())
    for field in ("misses", "false_positives", "switches", "fragmentations", "partly_tracked", "mostly_tracked"):
        assert getattr(total, field) > 10, field


def slow_id_matches(stream):
    """Return the best IDTP by trying every way to give objects one track each for the whole sequence."""
    near = [{(o, t) for i, o in enumerate(os) for j, t in enumerate(ts) if d[i][j] <= 1} for os, ts, d in stream]
    objects, tracks = ({key[k] for frame in near for key in frame} for k in (0, 1))
    few, many, flip = (objects, tracks, False) if len(objects) <= len(tracks) else (tracks, objects, True)
    best = 0
    for way in itertools.permutations(many, len(few)):
        pairs = {(b, a) if flip else (a, b) for a, b in zip(few, way, strict=True)}
        best = max(best, sum(len(pairs & frame) for frame in near))
    return best


@given(st.integers(0, 2**32 - 1))
def test_identities_are_the_best_of_all(seed):
    rng = np.random.default_rng(seed)
    stream = []
    for _ in range(6):
        objects, tracks = (sorted(rng.choice(4, rng.integers(0, 5), replace=False).tolist()) for _ in range(2))
        stream.append((objects, tracks, rng.choice([0.5, 2.0], (len(objects), len(tracks)))))
    assert ours(stream, gate=1.0).id_matches == slow_id_matches(stream)


def one_object(tracks, directions=None, distance=2.0):
    """Score a sequence of one object, which in each frame has the given track, None for none."""
    scorer = TrackingScorer(gate=10.0)
    for i, track in enumerate(tracks):
        if track is None:
            scorer.add(["a"], [], np.empty((1, 0)))
        else:
            forward = None if directions is None else [[directions[i]]]
            scorer.add(["a"], [track], [[distance]], forward)
    return scorer.scores()


def test_a_perfect_sequence():
    scores = TrackingScorer()
    for _ in range(10):
        scores.add([0, 1], [7, 3], [[90.0, 0.0], [0.0, 90.0]], [[False, True], [True, False]])
    result = scores.scores()
    assert (result.mota, result.idf1, result.motp) == (1.0, 1.0, 0.0)
    assert result == TrackingScores(10, 20, 20, 20, id_matches=20, mostly_tracked=2)


def test_frames_without_output_are_misses():
    scores = one_object([1, None, None, 1, 1])
    assert (scores.frames, scores.misses, scores.matches, scores.fragmentations, scores.switches) == (5, 2, 3, 1, 0)
    assert scores.mota == pytest.approx(1 - 2 / 5)
    assert scores.idf1 == pytest.approx(2 * 3 / (5 + 3))
    assert scores.motp == 2.0
    assert scores.partly_tracked == 1
    assert one_object([None] * 4).mota == 0.0
    assert one_object([None] * 4).mostly_lost == 1


def test_a_change_of_track_is_a_switch_however_long_ago():
    assert one_object([1, 1, 2, 2]).switches == 1
    assert one_object([1, None, None, 2, 1]).switches == 2
    assert one_object([1, 1, 2, 2]).idf1 == 0.5
    assert one_object([1, 1, 2, 2]).mota == pytest.approx(0.75)


def test_gaps_at_the_ends_are_no_fragmentation():
    assert one_object([None, 1, 1, None]).fragmentations == 0
    assert one_object([1, None, 1, None, None, 1]).fragmentations == 2


def test_a_track_that_is_near_enough_keeps_its_object_though_another_is_nearer():
    scorer = TrackingScorer(gate=10.0)
    scorer.add([0], [1], [[1.0]])
    scorer.add([0], [2, 1], [[0.5, 9.0]])
    assert scorer.scores().switches == 0
    scorer.add([0], [2, 1], [[0.5, 10.1]])
    assert scorer.scores().switches == 1


@pytest.mark.parametrize("ids", [("first", "second"), ("second", "first")])
def test_a_track_that_two_objects_had_stays_with_the_one_that_had_it_last(ids):
    scorer = TrackingScorer()
    for true_id in ("first", "second"):
        scorer.add([true_id], [7], [[0.1]])
    distance = {"first": 0.1, "second": 0.9}
    assert scorer.add(ids, [7], [[distance[true_id]] for true_id in ids]) == {"second": 7}
    assert scorer.add(["first"], [7], [[0.1]]) == {"first": 7}
    assert scorer.add(ids, [7], [[distance[true_id]] for true_id in ids]) == {"first": 7}
    assert scorer.scores().switches == 0


@pytest.mark.parametrize("seed", range(20))
def test_the_order_of_the_objects_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    forwards, backwards = TrackingScorer(gate=1.0), TrackingScorer(gate=1.0)
    for _ in range(20):
        ids, tracks = (np.flatnonzero(rng.random(3) < share).tolist() for share in (0.9, 0.6))
        distances = rng.uniform(0.0, 1.5, (len(ids), len(tracks)))
        assert forwards.add(ids, tracks, distances) == backwards.add(ids[::-1], tracks, distances[::-1])


def test_as_many_as_possible_are_matched_before_the_nearest():
    scorer = TrackingScorer(gate=10.0)
    scorer.add([0, 1], [1, 2], [[0.0, 9.0], [9.0, 11.0]])
    assert (scorer.scores().matches, scorer.scores().motp) == (2, 9.0)


@pytest.mark.parametrize(
    ("tracks", "directions", "flips"),
    [
        ([1] * 5, [True] * 5, 0),
        ([1] * 5, [False] * 5, 0),
        ([1] * 5, [True, False, False, True, True], 2),
        ([1, None, 1], [True, None, False], 1),
        ([1, 2, 2], [True, False, False], 0),
        ([1, 2, 1], [True, False, False], 1),
    ],
)
def test_direction_flips_are_turns_of_a_track_on_its_object(tracks, directions, flips):
    assert one_object(tracks, directions).flips == flips


@given(st.lists(st.booleans(), min_size=1, max_size=30))
def test_every_turn_is_counted_once(directions):
    expected = sum(a != b for a, b in itertools.pairwise(directions))
    assert one_object([1] * len(directions), directions).flips == expected


def test_nothing_at_all_has_no_rates_but_counts():
    for scores in (TrackingScorer().scores(), ours([([], [], [])])):
        assert scores.objects == scores.outputs == 0
        assert math.isnan(scores.mota)
        assert math.isnan(scores.motp)
        assert math.isnan(scores.idf1)
    invented = ours([([], [4, 5], [])])
    assert (invented.false_positives, invented.idf1) == (2, 0.0)
    assert math.isnan(invented.mota)


def test_the_gate_is_as_good_as_distances_that_are_not_there():
    stream = list(random_stream(3, gate=math.inf))
    gated = [(o, t, np.where(d > 12.0, np.nan, d)) for o, t, d in stream]
    infinite = [(o, t, np.where(d > 12.0, np.inf, d)) for o, t, d in stream]
    assert ours(stream, gate=12.0) == ours(gated) == ours(infinite)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (([1, 1], [2], [[0.0], [0.0]]), r"true_ids must differ within a frame, got \[1, 1\]"),
        (([1], [2, 2], [[0.0, 0.0]]), "track_ids must differ"),
        (([1], [2, 3], [[0.0], [0.0]]), r"distances must have shape \(1, 2\) \(objects, tracks\), got \(2, 1\)"),
        (([1], [2], []), r"distances must have shape \(1, 1\)"),
        (([1], [2], [[-1.0]]), "distances must not be negative, got -1.0"),
        (([1], [2], [[0.0]], [True]), r"forward must have shape \(1, 1\) \(objects, tracks\), got \(1,\)"),
    ],
)
def test_frames_that_make_no_sense_are_refused(frame, message):
    with pytest.raises(InputError, match=message):
        TrackingScorer().add(*frame)


def test_a_gate_that_makes_no_sense_is_refused():
    with pytest.raises(InputError, match=r"gate must be a finite number in 0\.\."):
        TrackingScorer(math.nan)


def test_the_criteria_load_neither_tables_nor_plots():
    code = "import sys, dloftbs_lab.evaluation; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"pandas", "motmetrics", "matplotlib", "cv2", "numba"}.isdisjoint(loaded)
