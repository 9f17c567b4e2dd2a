"""Examples, run as they stand: each script in at most 40 lines, each notebook's code one cell after the other."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
MAX_LINES = 40
WRITTEN = {
    "photo": ("overlay.png", "cable.csv"),
    "video": ("cable.mp4", "curves.csv", "length.png"),
    "live_camera": (),
    "robot_loop": (),
    "own_segmenter": ("overlay.png",),
    "metres": ("cable.ply",),
    "two_cameras": (),
    "harness": ("harness.png", "harness.jsonl"),
}
PRINTED = {
    "photo": "1 found",
    "video": "mean    4",
    "live_camera": "frame 29, cable 1: ends at",
    "robot_loop": "9 0.62",
    "own_segmenter": "[(1, 4",
    "metres": "length 0.8",
    "two_cameras": "off the true axis: 0.",
    "harness": "joins 3 ends",
}
"""A part of the last or the only answer of each: found where it is right."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["example"])
    return tmp_path


@pytest.fixture
def pyplot(monkeypatch: pytest.MonkeyPatch):
    matplotlib = pytest.importorskip("matplotlib")
    monkeypatch.setenv("MPLBACKEND", "Agg")
    with matplotlib.rc_context({"backend": "Agg"}):
        yield
        import matplotlib.pyplot as plt

        plt.close("all")


def test_there_is_a_test_of_each_script_and_none_is_long():
    scripts = {path.stem: path for path in EXAMPLES.glob("*.py")}
    assert scripts.keys() == WRITTEN.keys() == PRINTED.keys()
    assert {name: len(path.read_text("utf-8").splitlines()) for name, path in scripts.items()} == {
        name: pytest.approx(MAX_LINES / 2, abs=MAX_LINES / 2) for name in scripts
    }


@pytest.mark.parametrize("name", sorted(WRITTEN))
def test_a_script_runs(name, folder, capsys, request):
    if name == "video":
        pytest.importorskip("pandas")
        request.getfixturevalue("pyplot")
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    assert PRINTED[name] in capsys.readouterr().out
    assert all((folder / file).stat().st_size > 100 for file in WRITTEN[name])


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_pictures(path, folder, pyplot):
    pytest.importorskip("pandas")
    cells = json.loads(path.read_text("utf-8"))["cells"]
    names: dict[str, object] = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), str(path), "exec"), names)
    shown = [kind for cell in cells for output in cell.get("outputs", ()) for kind in output.get("data", ())]
    assert sum(kind.startswith("image/") for kind in shown) >= 2
    assert not any(output["output_type"] == "error" for cell in cells for output in cell.get("outputs", ()))


def test_there_are_two_notebooks_and_they_are_small():
    sizes = [path.stat().st_size for path in EXAMPLES.glob("*.ipynb")]
    assert len(sizes) == 2
    assert max(sizes) < 400_000
