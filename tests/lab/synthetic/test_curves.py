import numpy as np
import pytest
from scipy.spatial import cKDTree

from dloftbs import BSplineCurve
from dloftbs.errors import InputError
from dloftbs_lab.synthetic import draw_tube_mask, random_curve
from dloftbs_lab.synthetic.strand import integrate
from dloftbs_lab.synthetic.tube import footprint

SIZE = (120, 160)


def slow_distance(points, size):
    rows, columns = np.mgrid[: size[0], : size[1]]
    distance, _ = cKDTree(points).query(np.stack((columns.ravel(), rows.ravel()), axis=1))
    return distance.reshape(size)


def ring(turns=1.15, radius=30.0):
    """A strand that winds around a circle and passes over its own beginning."""
    length = 2 * np.pi * radius * turns
    return integrate(np.linspace(0, 2 * np.pi * turns, 1000), length).moved(np.array([80.0, 30.0]))


@pytest.mark.parametrize("width", [1.0, 3.0, 7.5, 24.0])
@pytest.mark.parametrize("seed", range(2))
def test_a_tube_is_the_pixels_within_half_a_width(seed, width):
    curve = random_curve(np.random.default_rng(seed), 180.0, SIZE, min_radius_px=15.0, margin_px=0.0)
    distance = slow_distance(curve.sample(18000), SIZE)
    mask = draw_tube_mask(curve, width, SIZE)
    clear = np.abs(distance - width / 2) > 0.005
    assert mask.dtype == bool
    assert mask.shape == SIZE
    np.testing.assert_array_equal(mask[clear], (distance < width / 2)[clear])


def test_a_straight_tube_counted_by_hand():
    curve = BSplineCurve([0, 0, 1, 1], [[2, 3], [6, 3]], 1)
    expected = """
    .........
    .........
    ..#####..
    .#######.
    ..#####..
    .........
    """
    wanted = [[c == "#" for c in line.strip()] for line in expected.split()]
    np.testing.assert_array_equal(draw_tube_mask(curve, 2.0, (6, 9)), wanted)


def test_a_tube_may_leave_the_image():
    curve = BSplineCurve([0, 0, 1, 1], [[-50, 10], [50, 10]], 1)
    mask = draw_tube_mask(curve, 5.0, (20, 30))
    assert mask.sum() == 5 * 30
    assert not draw_tube_mask(curve, 5.0, (5, 30)).any()


def test_only_plane_curves_of_some_width_are_drawn():
    with pytest.raises(InputError, match="in the plane, got 3"):
        draw_tube_mask(BSplineCurve([0, 0, 1, 1], [[0, 0, 0], [1, 1, 1]], 1), 3.0, SIZE)
    with pytest.raises(InputError, match="width_px must be positive, got 0"):
        draw_tube_mask(BSplineCurve([0, 0, 1, 1], [[0, 0], [1, 1]], 1), 0, SIZE)


@pytest.mark.parametrize("reach", [3.0, 6.5, 13.0])
def test_a_footprint_covers_the_tube_and_counts_every_pass_once(reach):
    strand = ring()
    found = footprint(strand, reach, SIZE)
    distance = slow_distance(strand.curve().sample(20000), SIZE)
    clear = np.abs(distance - reach) > 0.02
    covered = np.zeros(SIZE, bool)
    covered.ravel()[found.pixel] = True
    np.testing.assert_array_equal(covered[clear], (distance < reach)[clear])
    nearest = np.full(SIZE[0] * SIZE[1], np.inf)
    np.minimum.at(nearest, found.pixel, np.abs(found.offset))
    np.testing.assert_allclose(nearest.reshape(SIZE)[covered], distance[covered], atol=0.02)
    # Twice over the same pixel is one turn further along, not a seam between two windows.
    again = np.diff(found.pixel) == 0
    assert again.any()
    assert np.diff(found.arc)[again].min() > 150.0


def test_offsets_are_positive_on_the_right_of_travel():
    strand = integrate(np.zeros(200), 60.0).moved(np.array([20.0, 50.0]))
    found = footprint(strand, 4.0, SIZE)
    rows = found.pixel // SIZE[1]
    beside = (found.arc > 0) & (found.arc < 60)
    np.testing.assert_allclose(found.offset[beside], rows[beside] - 50.0, atol=1e-9)
    assert found.arc.min() < -2.0
    assert found.arc.max() > 62.0


def test_a_strand_becomes_a_curve_by_arc_length():
    strand = ring()
    curve = strand.curve()
    u = np.linspace(0, 1, len(strand.points))
    assert np.linalg.norm(curve(u) - strand.points, axis=1).max() < 0.02
    assert curve.length == pytest.approx(strand.length, rel=1e-4)
    np.testing.assert_allclose(np.linalg.norm(curve(u, 1), axis=1), curve.length, rtol=5e-3)


@pytest.mark.parametrize("seed", range(10))
def test_a_random_curve_has_its_length_bends_gently_and_stays_inside(seed):
    curve = random_curve(np.random.default_rng(seed), 300.0, SIZE, min_radius_px=12.0, margin_px=8.0)
    points = curve.sample(2000)
    assert curve.length == pytest.approx(300.0, rel=5e-3)
    assert (points >= 8.0 - 0.05).all()
    assert (points <= np.array([SIZE[1], SIZE[0]]) - 9.0 + 0.05).all()
    assert curve.curvature(np.linspace(0.02, 0.98, 500)).max() < 1 / 11.0
    assert random_curve(np.random.default_rng(seed), 300.0, SIZE, min_radius_px=12.0, margin_px=8.0) == curve


def test_random_curves_that_cannot_be_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="no curve of 5000 px"):
        random_curve(rng, 5000, SIZE, min_radius_px=2000)
    with pytest.raises(InputError, match="must be positive"):
        random_curve(rng, 0, SIZE)
