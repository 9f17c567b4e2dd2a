"""Tubes and lines, and the files that they go into."""

from __future__ import annotations

import logging
from collections import Counter

import numpy as np
import pytest
import sinks.sink_examples as examples
from builders import curve_through
from hypothesis import given
from hypothesis import strategies as st

import dloftbs
from dloftbs.camera import PinholeCamera
from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import InputError, SinkError
from dloftbs.sinks import GeometrySink, _mesh

CAMERA = PinholeCamera(500.0, 500.0, 32.0, 24.0)
NUMPY = {"float": "<f4", "int": "<i4", "uchar": "u1"}


def read_ply(path):
    """A slow reader of what the header declares."""
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header\n")
    lines = header.decode().splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    elements = {}
    for line in lines[2:]:
        words = line.split()
        if words[0] == "element":
            elements[words[1]] = (int(words[2]), [])
        elif words[0] == "property":
            list(elements.values())[-1][1].append(words[1:])
    found, at = {}, 0
    for name, (count, properties) in elements.items():
        fields = []
        for words in properties:
            if words[0] == "list":
                fields += [("count", NUMPY[words[1]]), ("items", NUMPY[words[2]], 3)]
            else:
                fields.append((words[1], NUMPY[words[0]]))
        kind = np.dtype(fields)
        found[name] = np.frombuffer(body, kind, count, at)
        at += count * kind.itemsize
    assert at == len(body)
    return found


def read_obj(path):
    found = {"o": [], "v": [], "vn": [], "f": [], "l": []}
    for line in path.read_text().splitlines():
        kind, *words = line.split()
        if kind != "#":
            found[kind].append(words)
    return found


def helix(turns=2.0, radius=0.1, rise=0.2):
    t = np.linspace(0.0, 1.0, 120)
    angle = 2.0 * np.pi * turns * t
    return curve_through(np.column_stack((radius * np.cos(angle), radius * np.sin(angle), 0.8 + rise * t)))


def ring(tilt=0.3):
    angle = 2.0 * np.pi * np.arange(80) / 80
    wobble = 0.02 * np.sin(3 * angle)  # not flat, so that what is carried around it comes back turned
    return curve_through(np.column_stack((0.2 * np.cos(angle), 0.2 * np.sin(angle) + wobble, 1 + tilt * wobble)), True)


def straight():
    return curve_through(np.linspace((0.0, 0.1, 0.8), (0.3, 0.1, 1.2), 12))


def knot(seed):
    rng = np.random.default_rng(seed)
    return curve_through(np.cumsum(rng.normal(0.0, 0.05, (8, 3)), axis=0) + np.array([0.0, 0.0, 1.0]))


CURVES = {"helix": helix(), "ring": ring(), "straight": straight(), "random": knot(3)}


def borders(faces):
    """The edges that not exactly one triangle passes in each direction."""
    passed = Counter((int(a), int(b)) for face in faces for a, b in zip(face, np.roll(face, -1), strict=True))
    assert max(passed.values()) == 1
    return {edge for edge in passed if edge[::-1] not in passed}


def volume(shape):
    a, b, c = (shape.points[shape.faces[:, i]] for i in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("name", CURVES)
def test_a_tube_with_caps_is_watertight_and_has_its_volume(name):
    curve, radius = CURVES[name], 0.004
    shape = _mesh.tube(curve, radius)
    assert borders(shape.faces) == set()
    sides, whole = 12, np.pi * radius**2 * (curve.length + (0.0 if curve.closed else 4.0 / 3.0 * radius))
    polygon = sides * np.sin(2 * np.pi / sides) / (2 * np.pi)  # of a circle's area
    assert volume(shape) == pytest.approx(polygon * whole, rel=0.03)
    edges = {tuple(sorted((int(a), int(b)))) for f in shape.faces for a, b in zip(f, np.roll(f, 1), strict=True)}
    assert len(shape.points) - len(edges) + len(shape.faces) == (0 if curve.closed else 2)  # Euler: a torus, a sphere


@pytest.mark.parametrize("name", ["helix", "straight"])
def test_an_open_tube_has_two_round_borders(name):
    shape = _mesh.tube(CURVES[name], 0.004, caps=False)
    assert len(borders(shape.faces)) == 2 * _mesh.SIDES


@pytest.mark.parametrize("name", ["helix", "ring", "straight"])
def test_points_lie_a_radius_from_the_curve_along_their_normals(name):
    curve, radius = CURVES[name], 0.004
    shape = _mesh.tube(curve, radius)
    assert np.linalg.norm(shape.normals, axis=1) == pytest.approx(1.0)
    assert shape.points - radius * shape.normals == pytest.approx(curve(shape.u))
    assert (shape.normals * curve.tangent(shape.u)).sum(axis=1)[_off_caps(shape, curve)] == pytest.approx(0.0, abs=1e-9)
    a, b, c = (shape.points[shape.faces[:, i]] for i in range(3))
    outwards = np.cross(b - a, c - a)
    outwards /= np.linalg.norm(outwards, axis=1)[:, None]
    agree = (outwards[:, None] * shape.normals[shape.faces]).sum(axis=-1)
    assert agree.min() > 0.6


def _off_caps(shape, curve):
    return np.ones(len(shape.u), bool) if curve.closed else (shape.u > 0.0) & (shape.u < 1.0)


@pytest.mark.parametrize("name", ["helix", "straight", "random"])
def test_a_tube_does_not_twist(name):
    """The seam of the rings turns about the curve by nothing but rounding, as a much finer tube's does."""
    curve = CURVES[name]
    fine, coarse = (_mesh.tube(curve, radius, caps=False) for radius in (0.0005, 0.004))
    seam = [shape.normals[:: _mesh.SIDES] for shape in (fine, coarse)]
    u = [shape.u[:: _mesh.SIDES] for shape in (fine, coarse)]
    at = np.abs(u[0][:, None] - u[1]).argmin(axis=0)
    assert np.degrees(np.arccos(np.clip((seam[0][at] * seam[1]).sum(axis=1), -1, 1))).max() < 3.0
    step = np.diff(seam[0], axis=0)
    sideways = np.cross(curve.tangent(u[0]), seam[0])
    turn = np.abs((step * 0.5 * (sideways[1:] + sideways[:-1])).sum(axis=1)).sum()
    assert turn < 0.02


def test_a_loop_closes_without_a_jump():
    shape = _mesh.tube(ring(), 0.002)
    seam = shape.normals[:: _mesh.SIDES]
    steps = np.linalg.norm(np.roll(seam, -1, axis=0) - seam, axis=1)
    assert steps.max() < 3.0 * np.median(steps)


@given(st.integers(0, 10_000), st.floats(0.001, 0.02), st.booleans())
def test_any_tube_is_watertight_and_finite(seed, radius, caps):
    shape = _mesh.tube(knot(seed), radius, caps=caps)
    assert np.isfinite(shape.points).all()
    assert (len(borders(shape.faces)) == 0) == caps
    assert set(shape.faces.ravel()) == set(range(len(shape.points)))


@given(st.integers(0, 10_000))
def test_a_turned_curve_has_the_turned_tube(seed):
    curve = knot(seed)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    shape, turned = _mesh.tube(curve, 0.004), _mesh.tube(curve.transformed(quarter, (0.0, 0.0, 0.5)), 0.004)
    # Which side the first ring begins at is arbitrary; what is enclosed is not.
    assert volume(turned) == pytest.approx(volume(shape), rel=1e-3)
    assert turned.points.mean(axis=0) == pytest.approx(quarter @ shape.points.mean(axis=0) + (0, 0, 0.5), abs=1e-5)


def test_a_line_runs_along_the_curve():
    shape = _mesh.line(helix(), 0.01)
    assert shape.points == pytest.approx(helix()(shape.u))
    assert shape.edges.tolist() == [[i, i + 1] for i in range(len(shape.points) - 1)]
    closed = _mesh.line(ring(), 0.01)
    assert closed.edges[-1].tolist() == [len(closed.points) - 1, 0]


def in_space(curve=None, reason=None, inferred=()):
    flat = examples.detection()
    return Detection(flat.centerline, flat.curve, curve, reason, inferred_3d=inferred)


def result(*detections, index=0):
    return FrameResult(detections, (), None, (48, 64), index=index)


def frame(index=0):
    return Frame(mask=np.zeros((48, 64), bool), camera=CAMERA, index=index)


def test_a_single_frame_is_a_single_file(tmp_path):
    path = tmp_path / "new" / "curves.ply"
    with GeometrySink(path, radius_m=0.005) as sink:
        sink.write(frame(), result(in_space(helix()), in_space(straight(), inferred=((0.25, 0.5),))))
    assert [p.name for p in path.parent.iterdir()] == ["curves.ply"]
    found = read_ply(path)
    vertex, face = found["vertex"], found["face"]
    first = vertex["object"] == 0
    assert set(vertex["object"]) == {0, 1}
    shape = _mesh.tube(helix(), 0.005)
    points = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    assert points[first] == pytest.approx(shape.points, abs=1e-6)
    assert (face["count"] == 3).all()
    assert borders(face["items"]) == set()
    assert set(face["items"].ravel()) == set(range(len(vertex)))
    colours = {tuple(int(vertex[c][i]) for c in ("red", "green", "blue")) for i in np.flatnonzero(first)}
    assert colours == {(86, 180, 233)}  # the palette's first, as red, green, blue
    assert not vertex["inferred"][first].any()
    share = vertex["inferred"][~first].mean()
    assert 0.2 < share < 0.27


def test_the_radius_follows_from_width_and_distance(tmp_path):
    flat = curve_through(np.linspace((0.0, 0.0, 0.8), (0.3, 0.0, 0.8), 12))
    with GeometrySink(tmp_path / "a.ply") as sink:
        sink.write(frame(), result(in_space(flat)))
    vertex = read_ply(tmp_path / "a.ply")["vertex"]
    assert np.ptp(vertex["z"]) / 2 == pytest.approx(2.5 * 0.8 / 500.0, rel=1e-4)  # 2.5 px of radius, 0.8 m away
    with GeometrySink(tmp_path / "b.ply") as sink, pytest.raises(InputError, match="radius_m"):
        sink.write(examples.frame(), result(in_space(flat)))


def test_more_frames_are_a_folder(tmp_path):
    with GeometrySink(tmp_path / "curves.obj", radius_m=0.005) as sink:
        for index in (3, 5, 5):
            sink.write(frame(index), result(in_space(helix()), index=index))
            assert sum(p.is_file() for p in tmp_path.rglob("*")) > 0
    assert sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*.*")) == [
        "curves/000003.obj",
        "curves/000005.obj",
        "curves/000005_1.obj",
    ]


def test_obj_says_the_same_as_ply(tmp_path):
    what = result(in_space(helix()), in_space(straight()))
    for name in ("a.ply", "a.OBJ"):
        with GeometrySink(tmp_path / name, radius_m=0.01) as sink:
            sink.write(frame(), what)
    table, text = read_ply(tmp_path / "a.ply"), read_obj(tmp_path / "a.OBJ")
    assert text["o"] == [["object_0"], ["object_1"]]
    points = np.array(text["v"], float)
    assert points[:, :3] == pytest.approx(np.stack([table["vertex"][a] for a in "xyz"], 1), abs=2e-6)
    assert points[0, 3:] * 255 == pytest.approx([86, 180, 233], abs=0.2)
    assert np.array(text["vn"], float) == pytest.approx(
        np.stack([table["vertex"][f"n{a}"] for a in "xyz"], 1), abs=1e-4
    )
    corners = np.array([[word.split("//")[0] for word in face] for face in text["f"]], int) - 1
    np.testing.assert_array_equal(corners, table["face"]["items"])


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_lines(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    with GeometrySink(path, form="line") as sink:
        sink.write(examples.frame(), result(in_space(helix()), in_space(straight())))
    if suffix == ".ply":
        edges = read_ply(path)["edge"]
        pairs = np.column_stack((edges["vertex1"], edges["vertex2"]))
    else:
        pairs = np.array(read_obj(path)["l"], int) - 1
    assert (np.diff(pairs, axis=1) == 1).all()
    assert len(pairs) == 2 * (200 - 1)
    assert not (pairs == [199, 200]).all(axis=1).any()  # one object is not joined to the next


def test_what_has_no_curve_in_space_is_left_out_and_told(tmp_path, caplog):
    with caplog.at_level(logging.WARNING), GeometrySink(tmp_path / "a.ply", radius_m=0.005) as sink:
        sink.write(frame(), result(in_space(helix()), in_space(None, "no depth"), in_space(None, "no depth")))
    assert set(read_ply(tmp_path / "a.ply")["vertex"]["object"]) == {0}
    first, all_of_them = caplog.messages
    assert first == "frame 0: object 1 is not in a.ply, since it has no curve in space: no depth"
    assert all_of_them == "a.ply lacks 2 of 3 objects, since they have no curve in space"


def test_tracks_have_their_ids_and_hidden_ones_are_left_out(tmp_path, caplog):
    with GeometrySink(tmp_path / "a.ply", radius_m=0.005) as sink:
        sink.write(examples.frame(1), examples.tracked(1))
    assert set(read_ply(tmp_path / "a.ply")["vertex"]["object"]) == {3}
    assert len(caplog.messages) == 1  # of the track that is seen, and has no curve in space


def write(path, *results):
    with GeometrySink(path, radius_m=0.005) as sink:
        for index, what in enumerate(results):
            sink.write(frame(index), what)


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
@pytest.mark.parametrize("before", [None, "precious"])
def test_a_scene_without_any_object_in_space_is_an_error_and_no_file(tmp_path, suffix, before):
    path = tmp_path / f"a{suffix}"
    if before is not None:
        path.write_text(before)
        (tmp_path / "a").mkdir()
        (tmp_path / "a" / f"000000{suffix}").write_text(before)
    there = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    reason = "the frame has depth, but no camera (camera=, --camera)"
    with pytest.raises(SinkError) as caught:
        write(path, result(in_space(None, reason)), examples.nothing(1))
    assert str(caught.value) == (
        f"nothing was written to {str(path)!r}: no object in the 2 frames has a curve in space: {reason}. Curves in "
        "space need depth and the camera's intrinsics (Frame.depth and Frame.camera, --depth and --camera)"
    )
    with pytest.raises(SinkError, match="the frame showed no object that could have a curve in space"):
        write(path, examples.nothing())
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == there


def test_frames_before_the_first_object_in_space_have_their_files(tmp_path):
    write(tmp_path / "a.ply", examples.nothing(0), examples.nothing(1), result(in_space(helix()), index=2))
    sizes = {p.name: len(read_ply(p)["vertex"]) > 0 for p in (tmp_path / "a").iterdir()}
    assert sizes == {"000000.ply": False, "000001.ply": False, "000002.ply": True}
    assert not (tmp_path / "a.ply").exists()
    write(tmp_path / "b.ply", result(in_space(helix())), examples.nothing(1))
    assert [len(read_ply(p)["vertex"]) > 0 for p in sorted((tmp_path / "b").iterdir())] == [True, False]


def test_no_frame_is_no_file_and_no_error(tmp_path):
    GeometrySink(tmp_path / "a.ply").close()
    assert list(tmp_path.iterdir()) == []


def test_what_ended_the_block_outranks_that_there_is_nothing(tmp_path, caplog):
    def interrupted():
        with GeometrySink(tmp_path / "a.ply") as sink:
            sink.write(frame(), examples.nothing())
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert "nothing was written to" in caplog.text


def test_wrong_arguments(tmp_path):
    for path, options, what in (
        ("a.stl", {}, r"\.ply, \.obj"),
        ("a.ply", {"form": "ribbon"}, "form must be"),
        ("a.ply", {"radius_m": 0.0}, "radius_m"),
        ("a.ply", {"radius_m": float("nan")}, "radius_m"),
    ):
        with pytest.raises(InputError, match=what):
            GeometrySink(tmp_path / path, **options)
    assert not list(tmp_path.iterdir())


def test_a_file_in_the_place_of_the_folder_of_frames(tmp_path):
    (tmp_path / "a").write_text("precious")
    with GeometrySink(tmp_path / "a.ply", radius_m=0.005) as sink:
        sink.write(frame(), result(in_space(helix())))
        with pytest.raises(SinkError, match="cannot write"):
            sink.write(frame(1), result(in_space(helix()), index=1))
    assert len(read_ply(tmp_path / "a.ply")["vertex"]) > 0
    assert (tmp_path / "a").read_text() == "precious"


def branched_in_space():
    mask = np.zeros((120, 200), np.uint8)
    mask[56:64, 10:190] = mask[60:110, 96:104] = 1
    camera = PinholeCamera(200.0, 200.0, 100.0, 60.0)
    frame = Frame(mask=mask, depth=np.full(mask.shape, 0.5), camera=camera)
    return frame, dloftbs.detect(frame, branched=True)


def test_a_ball_is_closed_and_looks_outwards():
    ball = _mesh.ball(np.array([0.0, 0.0, 1.0]), 0.01)
    assert len(ball.faces) == 20
    assert borders(ball.faces) == set()
    assert volume(ball) == pytest.approx(4.0 / 3.0 * np.pi * 1e-6, rel=0.4)
    assert volume(ball) > 0.0


@pytest.mark.parametrize(("form", "points"), [("tube", 12), ("line", 1)])
def test_branch_points_are_white_and_have_negative_numbers(tmp_path, form, points):
    frame, result = branched_in_space()
    (point,) = result.branch_points
    with GeometrySink(tmp_path / "a.ply", form=form) as sink:
        sink.write(frame, result)
    vertices = read_ply(tmp_path / "a.ply")["vertex"]
    own = vertices[vertices["object"] == -1]
    assert len(own) == points
    assert {tuple(one) for one in own[["red", "green", "blue"]].tolist()} == {(255, 255, 255)}
    middle = np.mean([own["x"], own["y"], own["z"]], axis=1)
    assert middle == pytest.approx(point.position_3d, abs=1e-4)
    assert set(vertices["object"].tolist()) == {-1, 0, 1, 2}
