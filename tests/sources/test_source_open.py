"""What `open` refuses, and that it costs nothing to import."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from dloftbs import sources
from dloftbs.errors import DloftbsError, InputError, SourceError
from dloftbs.sources.source import Source


@pytest.mark.parametrize("where", [None, 1.5, True, b"a.png", [], [1, 2], [np.zeros((3, 3))], {"a.png"}])
def test_wrong_where(where):
    with pytest.raises(InputError, match="where must be"):
        sources.open(where)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "video"}, "kind must be one of auto, image, mask, auto_image, got 'video'"),
        ({"mask_is": "soft"}, "mask_is must be one of auto, binary, probability, labels, got 'soft'"),
        ({"mask_is": None}, "mask_is must be one of auto, binary, probability, labels, got None"),
        ({"kind": "mask", "masks": "m"}, "kind must be 'image' where masks are given"),
        ({"fps": 0}, "positive number, got 0"),
        ({"fps": float("nan")}, "positive number"),
        ({"fps": "30"}, "positive number, got '30'"),
        ({"camera": (1, 2, 3)}, r"camera must be a PinholeCamera, its matrix K \(3, 3\), .* got \(1, 2, 3\)"),
        ({"depth": 3}, "depth must be a path or a naming rule, got 3"),
        ({"masks": np.zeros((2, 3, 3))}, "mask must be a path"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(InputError, match=message):
        sources.open(np.zeros((2, 3, 5), bool), **options)


def test_negative_camera():
    with pytest.raises(InputError, match="at least 0, got -1"):
        sources.open(-1)


def test_errors_are_the_built_ins_too(tmp_path):
    with pytest.raises(OSError, match="no file"):
        sources.open(tmp_path / "gone.mp4")
    assert issubclass(SourceError, DloftbsError)


def test_home_is_expanded(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    np.save(tmp_path / "a.npy", np.ones((2, 3, 5), bool))
    with sources.open("~/a.npy") as source:
        assert source.length == 2


def test_a_source_of_ones_own():
    class Empty(Source):
        name = "nothing"

        def __iter__(self):
            return iter(())

    with Empty() as source:
        assert (list(source), source.fps, source.length, source.skipped) == ([], None, None, 0)


def test_opencv_is_imported_late():
    paths = list(Path(sources.__file__).parent.glob("*.py"))
    assert len(paths) > 5
    for path in paths:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [alias.name for alias in getattr(node, "names", [])]
            assert not (isinstance(node, (ast.Import, ast.ImportFrom)) and "cv2" in names), path
