"""Whatever frames are called, what is written for them stays in its folder, and every frame has a file of its own."""

from __future__ import annotations

import os
import re
from dataclasses import replace

import pytest
import sinks.sink_examples as examples
from hypothesis import example, given
from hypothesis import strategies as st
from recorded_examples import TinySequence

from dloftbs import sinks
from dloftbs.errors import InputError
from dloftbs_lab import write_sequence

NAMES = [
    "../../x",
    "../../x.png",
    "/etc/passwd",
    "/",
    "//",
    "..",
    ".",
    "...",
    "",
    " ",
    "~",
    "~root/x",
    "a\0b",
    "\0",
    "a/b/c.png",
    "..\\..\\x.png",
    "C:\\x.png",
    "C:x",
    "\\\\host\\share\\x",
    "file:///etc/passwd",
    "con",
    "CON.png",
    "nul.tar.gz",
    "COM1.",
    "aux ",
    "x" * 300,
    "x" * 300 + ".png",
    "ł" * 200,
    "電" * 100 + "/" + "電" * 100,
    "\U0001f9f5" * 80,
    "x" * 5000,
    "a\nb",
    "a\x1b[31mb",
    "caf\udce9.png",
    "\ud800",
    "-rf",
    "*",
    "a?b",
    "$(touch x)",
    "x.png/",
    "x.png/.",
    "x/..",
    ".hidden",
    ".a.png.tmp",
]

ENCODABLE = [name for name in NAMES if not re.search("[\ud800-\udfff]", name)]


def write(sink, names):
    with sink:
        for index, name in enumerate(names):
            sink.write(
                examples.frame(index, name=name),
                replace(examples.detected(index, 1, in_space=True), name=name if name in ENCODABLE else ""),
            )


def everything(folder):
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


@pytest.mark.parametrize("ending", ["", ".overlay"])
def test_pictures_stay_in_their_folder(tmp_path, ending):
    folder = tmp_path / "a" / "pictures"
    write(sinks.OverlayImagesSink(folder, draw=examples.draw, ending=ending), NAMES)
    check(tmp_path, folder, len(NAMES))
    for name in os.listdir(folder):
        assert name.endswith(f"{ending}.png")


def check(root, folder, count):
    """So many files lie in the folder and nowhere else; every file system takes their names, and none is a path."""
    names = os.listdir(folder)
    assert len(names) == count
    assert {root / path for path in everything(root)} == {folder.parent, folder, *(folder / name for name in names)}
    for name in names:
        assert len(name.encode()) <= 255 - len("..tmp")
        assert not re.search(r'[<>:"/\\|?*\x00-\x1f\x7f]', name)
        assert not name.startswith(".")
        assert name.partition(".")[0].upper() not in {"CON", "PRN", "AUX", "NUL", "COM1", "LPT1"}


@given(st.lists(st.text(st.characters(), max_size=300), min_size=1, max_size=5))
@example(["x" * 199 + "電", "x" * 199 + "語"])
def test_any_names_stay_in_their_folder(tmp_path_factory, names):
    root = tmp_path_factory.mktemp("any")
    write(sinks.OverlayImagesSink(root / "a" / "pictures", draw=examples.draw), names)
    check(root, root / "a" / "pictures", len(names))


@pytest.mark.parametrize("suffix", [".jsonl", ".csv", ".npz", ".ply", ".obj", ".usda", ".xml", ".json", ".mp4"])
def test_names_of_frames_name_no_other_files(tmp_path, suffix):
    folder = tmp_path / "a" / "b"
    write(examples.open_sink(f"{folder}/out{suffix}"), NAMES)
    found = everything(tmp_path) - {"a", "a/b"}
    if suffix in (".ply", ".obj"):
        assert found == {"a/b/out", *(f"a/b/out/{index:06d}{suffix}" for index in range(len(NAMES)))}
    else:
        assert found == {f"a/b/out{suffix}"}


def test_labels_stay_in_their_folder(tmp_path):
    write(sinks.LabelmeSink(tmp_path / "a" / "b.labelme"), NAMES)
    check(tmp_path, tmp_path / "a" / "b.labelme", 2 * len(NAMES))


@pytest.mark.parametrize("ending", ["/x", "a/b", "..\\x", "\0"])
def test_an_ending_is_no_path(tmp_path, ending):
    with pytest.raises(InputError, match="ending"):
        sinks.OverlayImagesSink(tmp_path, ending=ending)
    assert not list(tmp_path.iterdir())


class Named(TinySequence):
    """A sequence whose frames, and itself, have hostile names."""

    def __init__(self):
        super().__init__(len(ENCODABLE))
        self.name = "../../x"

    def frame(self, index):
        return replace(super().frame(index % 10), index=index, name=ENCODABLE[index])

    def truth(self, index):
        return super().truth(index % 10)


def test_a_sequence_names_its_files_by_their_numbers(tmp_path):
    write_sequence(Named(), tmp_path / "a" / "b")
    files = {name for name in everything(tmp_path) if re.search(r"\.[a-z]+$", name)}
    stems = {name.rpartition("/")[2].partition(".")[0] for name in files}
    assert stems == {"sequence", "truth", *(f"{index:06d}" for index in range(len(ENCODABLE)))}
    assert {name.split("/")[:2] == ["a", "b"] for name in files} == {True}
