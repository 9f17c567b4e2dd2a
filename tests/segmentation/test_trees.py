"""Trees: what they learn, that they are the same each time, and the text that keeps them."""

import numpy as np
import pytest

from dloftbs.segmentation.trees import Trees


def ring(count=2000, seed=0):
    rng = np.random.default_rng(seed)
    features = rng.integers(0, 256, (5, count)).astype(np.uint8)
    inside = np.hypot(features[0] - 128.0, features[3] - 128.0) < 70.0
    return features, inside


@pytest.mark.large
def test_what_no_single_split_tells_is_learned_and_the_mean_is_a_probability():
    features, inside = ring()
    trees = Trees.grown(features, inside.astype(float), np.ones(features.shape[1]))
    others, true = ring(seed=1)
    found = trees.sums(others) / len(trees.value)
    assert found.min() >= 0.0
    assert found.max() <= 1.0 + 1e-6
    assert np.mean((found > 0.5) == true) > 0.9


@pytest.mark.large
def test_the_same_samples_give_the_same_trees_and_the_text_keeps_them():
    features, inside = ring()
    one, other = (Trees.grown(features, inside.astype(float), np.ones(features.shape[1])) for _ in range(2))
    assert one.to_text() == other.to_text()
    again = Trees.from_text(one.to_text())
    np.testing.assert_allclose(again.sums(features), one.sums(features), rtol=1e-3, atol=1e-6)
    assert again.to_text() == one.to_text()


def test_samples_of_one_kind_give_their_share():
    features, _ = ring(40)
    trees = Trees.grown(features, np.ones(features.shape[1]), np.ones(features.shape[1]))
    np.testing.assert_allclose(trees.sums(features) / len(trees.value), 1.0, rtol=1e-6)
