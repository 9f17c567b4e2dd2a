"""Scenes of USD: usd-core reads the points that were written, at the times at which they were seen."""

from __future__ import annotations

import numpy as np
import pytest
import sinks.sink_examples as examples
from builders import curve_through
from sinks.test_sink_geometry import frame, helix, in_space, result, ring, straight

from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track, TrackState
from dloftbs.errors import InputError, SinkError
from dloftbs.sinks import UsdSink

pytest.importorskip("pxr")
from pxr import Sdf, Usd, UsdGeom, UsdShade

DOWN = {"translation_m": [0.1, 0.2, 1.5], "rpy": [np.pi, 0.0, 0.0]}


def write(path, *results, **options):
    with UsdSink(path, **options) as sink:
        for index, what in enumerate(results):
            sink.write(frame(index), what)


def scene(path):
    """Return the stage of a file as it is now, whatever was read from it before."""
    return Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(path)))


def curves_of(stage):
    return {prim.GetName(): UsdGeom.BasisCurves(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.BasisCurves)}


def seen(*curves, index=0, stamp=None):
    """Return a result with a track for each curve in space; None for a hidden one."""
    found = [in_space(curve or helix()) for curve in curves]
    tracks = [
        Track(number, TrackState.HIDDEN, one.curve, one.curve_3d, 5, 1, None)
        if curve is None
        else Track(number, TrackState.CONFIRMED, one.curve, one.curve_3d, 5, 0, one)
        for number, (curve, one) in enumerate(zip(curves, found, strict=True), 1)
    ]
    detections = tuple(one for one, curve in zip(found, curves, strict=True) if curve is not None)
    return FrameResult(detections, tuple(tracks), None, (48, 64), index=index, stamp=stamp)


def test_a_single_frame_has_the_points_of_its_curves(tmp_path):
    write(tmp_path / "a.usda", result(in_space(helix()), in_space(ring())))
    stage = scene(tmp_path / "a.usda")
    assert (UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)) == (1.0, "Z")
    assert stage.GetDefaultPrim().GetPath() == "/World"
    found = curves_of(stage)
    assert list(found) == ["detection_0", "detection_1_loop"]
    opened, loop = found.values()
    np.testing.assert_array_equal(np.array(opened.GetPointsAttr().Get()), helix().sample(100).astype(np.float32))
    np.testing.assert_array_equal(np.array(loop.GetPointsAttr().Get()), ring().sample(100)[:-1].astype(np.float32))
    assert [one.GetWrapAttr().Get() for one in found.values()] == ["nonperiodic", "periodic"]
    for one in found.values():
        assert one.GetTypeAttr().Get() == "linear"
        assert one.GetCurveVertexCountsAttr().Get()[0] == len(one.GetPointsAttr().Get())
        assert UsdGeom.Imageable(one).ComputeVisibility() == "inherited"
        assert one.GetWidthsInterpolation() == "constant"
    assert opened.GetPointsAttr().GetTimeSamples() == []


def test_thickness_is_the_width_in_space_for_eyes_and_simulators(tmp_path):
    level = curve_through(np.linspace((-0.15, 0.0, 1.0), (0.15, 0.0, 1.0), 12))
    write(tmp_path / "a.usda", result(in_space(level)))
    write(tmp_path / "b.usda", result(in_space(level)), radius_m=0.007)
    for name, thickness in (("a", 5.0 * 1.0 / 500.0), ("b", 0.014)):
        stage = scene(tmp_path / f"{name}.usda")
        (curve,) = curves_of(stage).values()
        assert list(curve.GetWidthsAttr().Get()) == pytest.approx([thickness], rel=1e-2)
        material = UsdShade.MaterialBindingAPI(curve).ComputeBoundMaterial("physics")[0]
        assert material.GetPrim().GetAttribute("physics:thickness").Get() == curve.GetWidthsAttr().Get()[0]
        schemas = curve.GetPrim().GetPrimTypeInfo().GetAppliedAPISchemas()
        assert "PhysicsCurvesDeformableSimAPI" in schemas


def test_tracks_are_prims_with_time_samples(tmp_path):
    shapes = [(helix(), straight()), (helix(1.0), straight()), (helix(0.5), None), (helix(0.7), straight())]
    stamps = [3.0, 3.05, 3.1, 3.2]
    frames = [seen(*two, index=n, stamp=t) for n, (two, t) in enumerate(zip(shapes, stamps, strict=True))]
    write(tmp_path / "a.usda", *frames)
    stage = scene(tmp_path / "a.usda")
    assert stage.GetTimeCodesPerSecond() == pytest.approx(20.0)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 4.0)
    first, second = curves_of(stage)["cable_1"], curves_of(stage)["cable_2"]
    assert first.GetPointsAttr().GetTimeSamples() == [0.0, 1.0, 2.0, 4.0]
    for code, (curve, _) in zip((0.0, 1.0, 2.0, 4.0), shapes, strict=True):
        points = np.array(first.GetPointsAttr().Get(code))
        np.testing.assert_array_equal(points, curve.sample(100).astype(np.float32))
    np.testing.assert_array_equal(np.array(first.GetPointsAttr().Get()), np.array(first.GetPointsAttr().Get(4.0)))
    assert second.GetPointsAttr().GetTimeSamples() == [0.0, 1.0, 4.0]
    shown = [UsdGeom.Imageable(second).ComputeVisibility(code) for code in (0.0, 1.0, 2.0, 4.0)]
    assert shown == ["inherited", "inherited", "invisible", "inherited"]
    assert UsdGeom.Imageable(second).ComputeVisibility() == "inherited"


def test_a_track_that_begins_late_and_ends_early_is_invisible_before_and_after(tmp_path):
    frames = [seen(helix()), seen(helix(), straight(), index=1), seen(helix(), index=2)]
    write(tmp_path / "a.usda", *frames)
    stage = scene(tmp_path / "a.usda")
    late = UsdGeom.Imageable(curves_of(stage)["cable_2"])
    assert [late.ComputeVisibility(code) for code in (0.0, 1.0, 2.0)] == ["invisible", "inherited", "invisible"]
    assert late.ComputeVisibility() == "invisible"


@pytest.mark.parametrize(
    ("indices", "stamps", "expected"),
    [
        ((4, 6, 9), (None, None, None), [4, 6, 9]),
        ((0, 0, 0), (1.0, None, 2.0), [0, 1, 2]),
        ((3, 4, 5), (1, 1, 1), [3, 4, 5]),
        ((3, 4, 5), (2, 1, 3), [3, 4, 5]),
    ],
)
def test_without_rising_stamps_times_are_indices_or_a_count(tmp_path, indices, stamps, expected):
    write(tmp_path / "a.usda", *(seen(helix(), index=n, stamp=t) for n, t in zip(indices, stamps, strict=True)))
    stage = scene(tmp_path / "a.usda")
    assert curves_of(stage)["cable_1"].GetPointsAttr().GetTimeSamples() == expected
    assert stage.GetTimeCodesPerSecond() == 24.0


def test_frames_of_one_stamp_follow_each_other_at_the_rate_of_the_others(tmp_path):
    stamps = [0.0, 0.1, 0.1, 0.1, 0.2, 0.3, 0.3]
    write(tmp_path / "a.usda", *(seen(helix(), index=n, stamp=t) for n, t in enumerate(stamps)))
    stage = scene(tmp_path / "a.usda")
    assert stage.GetTimeCodesPerSecond() == pytest.approx(10.0)
    times = curves_of(stage)["cable_1"].GetPointsAttr().GetTimeSamples()
    assert times == pytest.approx([0.0, 1.0, 1.001, 1.002, 2.0, 3.0, 3.001], abs=1e-6)


def test_points_and_pose_are_arguments(tmp_path):
    write(tmp_path / "a.usda", result(in_space(helix())), points=7, pose=DOWN)
    stage = scene(tmp_path / "a.usda")
    (curve,) = curves_of(stage).values()
    expected = helix().sample(7) * (1.0, -1.0, -1.0) + (0.1, 0.2, 1.5)
    assert np.array(curve.GetPointsAttr().Get()) == pytest.approx(expected, abs=1e-6)


def test_half_of_the_frames_at_least_are_there_before_it_is_closed(tmp_path):
    path = tmp_path / "a.usda"
    with UsdSink(path) as sink:
        for index in range(7):
            sink.write(frame(index), seen(helix(), index=index))
            stage = scene(path)
            assert max(1, curves_of(stage)["cable_1"].GetPointsAttr().GetNumTimeSamples()) >= (index + 1) / 2


def test_no_object_in_space_is_an_error_and_an_older_file_stays(tmp_path, caplog):
    (tmp_path / "a.usda").write_text("precious")
    with pytest.raises(SinkError, match="no object in the frame has a curve in space: no depth"):
        write(tmp_path / "a.usda", result(in_space(None, "no depth")))
    UsdSink(tmp_path / "a.usda").close()
    assert (tmp_path / "a.usda").read_text() == "precious"
    write(tmp_path / "a.usda", examples.nothing(), seen(helix(), index=1))
    stage = scene(tmp_path / "a.usda")
    curve = curves_of(stage)["cable_1"]
    assert UsdGeom.Imageable(curve).ComputeVisibility(0.0) == "invisible"


def test_wrong_arguments(tmp_path):
    for path, options, what in (
        ("a.usd", {}, r"must end in \.usda, got .*a\.usd"),
        ("a.usda", {"points": 1}, "points must be"),
        ("a.usda", {"radius_m": 0.0}, "radius_m must be a positive number, got 0.0"),
        ("a.usda", {"pose": 2 * np.eye(4)}, "the last row of pose must be 0 0 0 1"),
    ):
        with pytest.raises(InputError, match=what):
            UsdSink(tmp_path / path, **options)
    assert not list(tmp_path.iterdir())
