"""Networks of the user's own: tiny ones, run for real."""

import builtins

import numpy as np
import pytest

import dloftbs
from dloftbs.config import Config, NetworkConfig, SegmentationConfig
from dloftbs.errors import ConfigError
from dloftbs.segmentation import make_segmenter

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
from onnx import TensorProto, helper  # noqa: E402 - only where it is there

SIZE = 48, 80


def picture():
    image = np.full((*SIZE, 3), (40, 50, 60), np.uint8)
    image[20:26, 10:70] = (30, 20, 230)
    return image


def save(path, weights, shape=(1, 3, "h", "w"), nodes=(), output="y", kind=TensorProto.FLOAT):
    """Write a network of one convolution by 1 x 1: weights (channels out, 3)."""
    weights = np.asarray(weights, np.float32)
    first = [helper.make_node("Conv", ["x", "w"], ["y"])] if not nodes else list(nodes)
    tensor = helper.make_tensor("w", TensorProto.FLOAT, (*weights.shape, 1, 1), weights.ravel())
    graph = helper.make_graph(
        first,
        "tiny",
        [helper.make_tensor_value_info("x", kind, shape)],
        [helper.make_tensor_value_info(output, TensorProto.FLOAT, None)],
        [tensor],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8), str(path))
    return str(path)


RED_ALONE = [(1.0, 0.0, 0.0)]


def probability_of(image, **settings):
    segmenter = make_segmenter(SegmentationConfig(onnx=NetworkConfig(**settings)))
    return segmenter(dloftbs.Frame(image=image))


def mask_of(image, **settings):
    return probability_of(image, **settings) >= 0.5


def test_a_network_makes_the_mask(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE)
    np.testing.assert_array_equal(mask_of(picture(), file=file), picture()[..., 2] > 127)
    config = Config(segmentation=SegmentationConfig(onnx=NetworkConfig(file=file)))
    assert len(dloftbs.detect(picture(), config=Config.from_yaml(config.to_yaml()))) == 1


def test_the_order_of_channels_and_their_scaling_count(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE)
    blue = picture()[..., ::-1].copy()
    assert not mask_of(blue, file=file).any()
    assert np.count_nonzero(mask_of(blue, file=file, order="bgr")) == 360
    scaled = {"scale": 1.0, "mean": (100.0, 0.0, 0.0), "std": (10.0, 1.0, 1.0), "threshold": 12.9}
    assert np.count_nonzero(mask_of(picture(), file=file, **scaled)) == 360
    assert not mask_of(picture(), file=file, **{**scaled, "threshold": 13.1}).any()


def test_scores_in_0_to_1_are_probabilities_that_the_threshold_moves(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE)
    red = picture()[..., 2] / 255.0
    np.testing.assert_allclose(probability_of(picture(), file=file), red, atol=1e-6)
    low = probability_of(picture(), file=file, threshold=0.2)
    np.testing.assert_allclose(low, red * 0.8 / (red * 0.8 + (1.0 - red) * 0.2), atol=1e-6)


def test_other_scores_are_log_odds(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE)
    scores = picture()[..., 2].astype(float) - 128.0
    found = probability_of(picture(), file=file, scale=1.0, mean=(128.0, 0.0, 0.0), threshold=-3.0)
    np.testing.assert_allclose(found, 1.0 / (1.0 + np.exp(-(scores + 3.0))), atol=1e-6)


def test_of_several_channels_the_cable_s_share_counts(tmp_path):
    file = save(tmp_path / "m.onnx", [(0.0, 0.5, 0.0), (0.5, 0.0, 0.0)])
    green, red = picture()[..., 1] / 510.0, picture()[..., 2] / 510.0
    np.testing.assert_allclose(probability_of(picture(), file=file), red / (red + green), atol=1e-6)
    file = save(tmp_path / "n.onnx", [(0.0, 9.0, 0.0), (9.0, 0.0, 0.0)])
    odds = 18.0 * (red - green)
    np.testing.assert_allclose(probability_of(picture(), file=file), 1.0 / (1.0 + np.exp(-odds)), atol=1e-5)


def test_the_probability_is_what_the_pipeline_reads(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE)
    image = np.zeros((*SIZE, 3), np.uint8)
    image[20:26, 10:50] = (0, 0, 230)
    image[20:26, 50:70] = (0, 0, 60)
    (found,) = dloftbs.detect(image, segmenter=file)
    assert found.curve.length > 55
    (joined,) = dloftbs.detect(image, config={"segmentation": {"onnx": {"file": file}, "hsv": ["0:179,0:255,70:255"]}})
    assert joined.curve.length < 45


def test_the_size_that_the_model_states_is_kept(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE, shape=(1, 3, 96, 160))
    mask = mask_of(picture(), file=file)
    assert mask.shape == SIZE
    assert np.count_nonzero(mask) == pytest.approx(360, abs=70)
    with pytest.raises(ConfigError, match=r"takes 96 x 160, onnx.size says \(48, 80\)"):
        mask_of(picture(), file=file, size=(48, 80))


def test_a_size_that_is_given_scales_the_image(tmp_path):
    mask = mask_of(picture(), file=save(tmp_path / "m.onnx", RED_ALONE), size=(96, 96))
    assert np.count_nonzero(mask) == pytest.approx(360, abs=70)


def test_sides_are_padded_to_multiples(tmp_path):
    pool = [
        helper.make_node("Conv", ["x", "w"], ["c"]),
        helper.make_node("Reshape", ["c", "s"], ["y"]),  # fails for all but 64 x 96
    ]
    file = save(tmp_path / "m.onnx", RED_ALONE, nodes=pool)
    model = onnx.load(file)
    model.graph.initializer.append(helper.make_tensor("s", TensorProto.INT64, [4], [1, 1, 64, 96]))
    onnx.save(model, file)
    np.testing.assert_array_equal(mask_of(picture(), file=file, multiple=32), picture()[..., 2] > 127)
    with pytest.raises(ConfigError, match="the network failed on"):
        mask_of(picture(), file=file)


def test_channels_may_come_last(tmp_path):
    turned = [
        helper.make_node("Transpose", ["x"], ["t"], perm=[0, 3, 1, 2]),
        helper.make_node("Conv", ["t", "w"], ["c"]),
        helper.make_node("Transpose", ["c"], ["y"], perm=[0, 2, 3, 1]),
    ]
    file = save(tmp_path / "m.onnx", RED_ALONE, shape=(1, "h", "w", 3), nodes=turned)
    np.testing.assert_array_equal(mask_of(picture(), file=file), picture()[..., 2] > 127)


def test_of_several_channels_the_largest_counts_or_the_one_that_is_named(tmp_path):
    file = save(tmp_path / "m.onnx", [(0.3, 0.3, 0.3), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    assert np.count_nonzero(mask_of(picture(), file=file, channel=1)) == 360
    assert not mask_of(picture(), file=file, channel=2).any()
    assert mask_of(picture(), file=file)[22, 30]
    with pytest.raises(ConfigError, match=r"onnx\.channel is 3, the network has 3"):
        mask_of(picture(), file=file, channel=3)


def test_what_is_no_network_for_images_is_refused(tmp_path):
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"no model")
    with pytest.raises(ConfigError, match="cannot read the network"):
        mask_of(picture(), file=str(broken))
    with pytest.raises(ConfigError, match="there is no file"):
        mask_of(picture(), file=str(tmp_path / "none.onnx"))
    with pytest.raises(ConfigError, match="four dimensions"):
        mask_of(
            picture(),
            file=save(
                tmp_path / "flat.onnx", RED_ALONE, shape=(1, 3, "n"), nodes=[helper.make_node("Identity", ["x"], ["y"])]
            ),
        )


def test_without_onnx_runtime_the_extra_is_named(tmp_path, monkeypatch):
    real = builtins.__import__

    def missing(name, *rest, **more):
        if name.startswith("onnxruntime"):
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(ConfigError, match=r"pip install 'dloftbs\[onnx\]'"):
        mask_of(picture(), file="m.onnx")


def test_an_empty_image_has_an_empty_mask(tmp_path):
    file = save(tmp_path / "m.onnx", RED_ALONE)
    assert mask_of(np.zeros((0, 5, 3), np.uint8), file=file).shape == (0, 5)
