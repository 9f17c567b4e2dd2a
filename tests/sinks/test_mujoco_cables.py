"""Cables of a MuJoCo model: as MuJoCo loads them, they lie on the curves."""

from __future__ import annotations

import numpy as np
import pytest
import sinks.sink_examples as examples
from builders import curve_through
from hypothesis import given
from hypothesis import strategies as st
from properties import few_examples
from scipy.spatial import cKDTree
from sinks.test_sink_geometry import CAMERA, frame, helix, in_space, knot, result, ring, straight

from dloftbs.data.object_shape import width_in_space
from dloftbs.errors import InputError, SinkError
from dloftbs.sinks import MujocoSink

mujoco = pytest.importorskip("mujoco")

CURVES = {"helix": helix(), "ring": ring(), "straight": straight(), "random": knot(3)}
DOWN = {"translation_m": [0.1, 0.2, 1.5], "rpy": [np.pi, 0.0, 0.0]}
"""A camera that looks down."""


def write(path, *results, **options):
    with MujocoSink(path, **options) as sink:
        for index, what in enumerate(results):
            sink.write(frame(index), what)


def loaded(path):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def axis_of(model, data, name):
    """Return the axis of a cable's capsules, ten points each, and their radius."""
    bodies = slice(model.body(f"{name}_B_first").id, model.body(f"{name}_B_last").id + 1)
    geoms = [model.body(body).geomadr[0] for body in range(bodies.start, bodies.stop)]
    share = np.linspace(-1.0, 1.0, 10)[:, None]
    points = [
        data.geom_xpos[geom] + share * model.geom_size[geom][1] * data.geom_xmat[geom].reshape(3, 3)[:, 2]
        for geom in geoms
    ]
    return np.concatenate(points), model.geom_size[geoms][:, 0]


def distances(points, others):
    return cKDTree(others).query(points)[0]


@pytest.mark.parametrize("name", CURVES)
def test_a_loaded_cable_lies_on_its_curve_from_end_to_end(tmp_path, name):
    curve = CURVES[name]
    write(tmp_path / "a.xml", result(in_space(curve)))
    model, data = loaded(tmp_path / "a.xml")
    points, radius = axis_of(model, data, "detection_0_loop" if curve.closed else "detection_0")
    dense = curve.sample(5000)
    assert distances(points, dense).max() < 1e-3
    assert distances(dense[::10], points).max() < 1e-3 + np.linalg.norm(points[1] - points[0])
    assert radius == pytest.approx(0.5 * width_in_space(5.0, curve, CAMERA), rel=1e-3)


@few_examples
@given(st.floats(0.3, 3.0), st.floats(0.02, 0.2), st.floats(0.0, 0.4))
def test_any_helix_is_within_a_millimetre(tmp_path_factory, turns, radius, rise):
    curve = helix(turns, radius, rise)
    path = tmp_path_factory.mktemp("any") / "a.xml"
    write(path, result(in_space(curve)), radius_m=0.004)
    points, _ = axis_of(*loaded(path), "detection_0")
    assert distances(points, curve.sample(5000)).max() < 1e-3


def test_a_straight_cable_needs_few_capsules_and_a_bent_one_more(tmp_path):
    write(tmp_path / "a.xml", result(in_space(straight()), in_space(helix())))
    model, _ = loaded(tmp_path / "a.xml")
    segments = [model.body(f"detection_{n}_B_last").id - model.body(f"detection_{n}_B_first").id + 1 for n in (0, 1)]
    assert segments[0] == 8 < segments[1]


@pytest.mark.parametrize("name", ["helix", "ring", "straight"])
def test_nothing_collides_at_the_start_and_the_simulation_is_stable(tmp_path, name):
    write(tmp_path / "a.xml", result(in_space(CURVES[name])), radius_m=0.008, pose=DOWN)
    model, data = loaded(tmp_path / "a.xml")
    assert data.ncon == 0
    before = data.xpos[1:].copy()
    for _ in range(200):
        mujoco.mj_step(model, data)
    assert sum(warning.number for warning in data.warning) == 0
    fallen = before[:, 2].mean() - data.xpos[1:, 2].mean()
    assert fallen == pytest.approx(0.5 * 9.81 * 0.2**2, rel=0.02)


def test_the_ends_of_a_loop_stay_together(tmp_path):
    write(tmp_path / "a.xml", result(in_space(ring())), pose=DOWN)
    model, data = loaded(tmp_path / "a.xml")
    rng = np.random.default_rng(0)
    data.qvel[:] = rng.normal(0.0, 0.3, model.nv)
    for _ in range(300):
        mujoco.mj_step(model, data)
    first, last = (data.body(f"detection_0_loop_B_{which}") for which in ("first", "last"))
    length = 2.0 * model.geom_size[model.body("detection_0_loop_B_last").geomadr[0]][1]
    assert np.linalg.norm(last.xpos + length * last.xmat.reshape(3, 3)[:, 0] - first.xpos) < 2e-3
    assert np.linalg.norm(first.xpos - ring().start * (1.0, -1.0, -1.0) - (0.1, 0.2, 1.5)) > 0.1  # it has moved


def test_without_a_pose_there_is_no_gravity_and_with_one_coordinates_are_the_worlds(tmp_path):
    write(tmp_path / "a.xml", result(in_space(helix())))
    write(tmp_path / "b.xml", result(in_space(helix())), pose=DOWN)
    (seen, at), (world, there) = loaded(tmp_path / "a.xml"), loaded(tmp_path / "b.xml")
    assert seen.opt.gravity.tolist() == [0.0, 0.0, 0.0]
    assert world.opt.gravity.tolist() == [0.0, 0.0, -9.81]
    turned = axis_of(seen, at, "detection_0")[0] * (1.0, -1.0, -1.0) + (0.1, 0.2, 1.5)
    assert axis_of(world, there, "detection_0")[0] == pytest.approx(turned, abs=2e-6)


def test_the_newest_frame_with_an_object_in_space_is_there_at_any_time(tmp_path):
    path = tmp_path / "new" / "a.xml"
    with MujocoSink(path, radius_m=0.004) as sink:
        sink.write(frame(), result(in_space(helix())))
        assert loaded(path)[0].nbody > 9
        sink.write(frame(1), result(in_space(straight()), index=1))
        assert loaded(path)[0].nbody == 9
        sink.write(frame(2), examples.nothing(2))
        assert loaded(path)[0].nbody == 9
    assert [p.name for p in path.parent.iterdir()] == ["a.xml"]


def test_tracks_have_their_ids_and_hidden_ones_are_left_out(tmp_path, caplog):
    with MujocoSink(tmp_path / "a.xml", radius_m=0.004) as sink:
        sink.write(examples.frame(1), examples.tracked(1))
    model, _ = loaded(tmp_path / "a.xml")
    names = {model.body(n).name.partition("_B_")[0] for n in range(1, model.nbody)}
    assert names == {"cable_3"}
    assert len(caplog.messages) == 1  # of the track that is seen, and has no curve in space


def test_no_object_in_space_is_an_error_and_an_older_file_stays(tmp_path):
    (tmp_path / "a.xml").write_text("precious")
    with pytest.raises(SinkError, match="no object in the frame has a curve in space: no depth"):
        write(tmp_path / "a.xml", result(in_space(None, "no depth")))
    assert (tmp_path / "a.xml").read_text() == "precious"
    MujocoSink(tmp_path / "a.xml").close()
    assert (tmp_path / "a.xml").read_text() == "precious"


def test_wrong_arguments(tmp_path):
    for path, options, what in (
        ("a.mjcf", {}, r"must end in \.xml, got .*a\.mjcf"),
        ("a.xml", {"radius_m": -1.0}, "radius_m must be a positive number, got -1.0"),
        ("a.xml", {"pose": np.eye(3)}, r"pose must be a matrix \(4, 4\), .* got shape \(3, 3\)"),
    ):
        with pytest.raises(InputError, match=what):
            MujocoSink(tmp_path / path, **options)
    flat = curve_through(np.linspace((0.0, 0.0, 0.8), (0.3, 0.0, 0.8), 12))
    with MujocoSink(tmp_path / "b.xml") as sink, pytest.raises(InputError, match="or radius_m; got neither"):
        sink.write(examples.frame(), result(in_space(flat)))
    assert not list(tmp_path.iterdir())
