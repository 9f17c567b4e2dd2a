"""Naming rules: which files go with which frame, with wildcards and without."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest

from dloftbs.sources.naming_rules import is_pattern, is_rule, partner_of, partners_of, stem_in, without_partners


def touch(folder: Path, *names: str) -> list[Path]:
    paths = [folder / name for name in names]
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return paths


def names(groups: list[list[Path]]) -> list[list[str]]:
    return [[path.name for path in group] for group in groups]


@pytest.mark.parametrize(
    ("rule", "rules", "patterns"),
    [
        (None, False, False),
        ("masks/*.png", False, False),
        ("{stem}_m.png", True, False),
        ("{stem}_m_*.png", True, True),
        ("{stem}/[0-9]?.png", True, True),
    ],
)
def test_kinds_of_rules(rule, rules, patterns):
    assert is_rule(rule) is rules
    assert is_pattern(rule or "") is patterns


@pytest.mark.parametrize(
    ("text", "name", "stem"),
    [
        ("a_mask_0.png", "{stem}_mask_*.png", "a"),
        ("a_mask_1_mask_0.png", "{stem}_mask_*.png", "a_mask_1"),  # the longest
        ("m_a.png", "m_{stem}.png", "a"),
        ("a_mask_.jpg", "{stem}_mask_*.png", None),
        ("_mask_0.png", "{stem}_mask_*.png", None),
        ("a[1]_x.png", "{stem}_?.png", "a[1]"),
        ("a.b_3.png", "{stem}_[0-9].png", "a.b"),
    ],
)
def test_the_stem_in_a_name(text, name, stem):
    assert stem_in(text, name) == stem


def test_a_rule_without_wildcards_names_one_file_there_or_not():
    paths = [Path("f/a.png"), Path("f/b.jpg")]
    assert partners_of(paths, "../m/{stem}.png") == [[Path("m/a.png")], [Path("m/b.png")]]
    assert partner_of(paths[0], "{stem}_depth.npy") == Path("f/a_depth.npy")


def test_files_of_objects_are_in_natural_order_without_the_union(tmp_path):
    paths = touch(tmp_path, "img1.png", "img10.png", "img2.png")
    touch(tmp_path, "img1_mask_10.png", "img1_mask_2.png", "img1_mask_all.png", "img10_mask_0.png", ".img2_mask_0.png")
    groups = partners_of(paths, "{stem}_mask_*.png")
    assert names(groups) == [["img1_mask_2.png", "img1_mask_10.png"], ["img10_mask_0.png"], []]
    assert names(partners_of(paths, "{stem}_mask_[0-9].png")) == [["img1_mask_2.png"], ["img10_mask_0.png"], []]


def test_a_file_belongs_to_the_longest_stem(tmp_path):
    paths = touch(tmp_path, "a.png", "a_b.png")
    touch(tmp_path, "a_b_0.png", "a_0.png")
    assert names(partners_of(paths, "{stem}_*.png")) == [["a_0.png", "a_b.png"], ["a_b_0.png"]]
    files = [tmp_path / name for name in ("a.png", "a_0.png", "a_b.png", "a_b_0.png")]
    assert without_partners(files, "{stem}_*.png") == paths


def test_a_folder_for_each_frame(tmp_path):
    paths = touch(tmp_path / "rgb", "a.png", "b.png", "c.png")
    touch(tmp_path, "masks/a/0.png", "masks/a/1.png", "masks/a/notes.csv", "masks/b/a_0.png", "masks/b/b_0.png")
    assert names(partners_of(paths, "../masks/{stem}/*.png")) == [["0.png", "1.png"], ["a_0.png", "b_0.png"], []]
    assert names(partners_of(paths, "../masks/{stem}/{stem}_*.png")) == [[], ["b_0.png"], []]
    touch(tmp_path, "masks/a_1.png", "masks/c_1.png", "masks/c_2.png")
    assert names(partners_of(paths, "../masks/{stem}_*.png")) == [["a_1.png"], [], ["c_1.png", "c_2.png"]]
    assert names(partners_of(paths, "../none/{stem}_*.png")) == [[], [], []]


def test_frames_are_what_is_nobodys_partner(tmp_path, caplog):
    caplog.set_level(logging.WARNING, "dloftbs.sources")
    frames = touch(tmp_path, "a.png", "b.png")
    masks = touch(tmp_path, "a_mask_0.png", "a_mask_all.png", "b_mask_0.png", "b_mask_1.png")
    assert without_partners([*frames, *masks], "{stem}_mask_*.png") == frames
    assert caplog.messages == []
    lost = touch(tmp_path, "c_mask_0.png")
    assert without_partners([*frames, *lost], "{stem}_mask_*.png") == frames
    assert "c_mask_0.png: it is named by the rule" in caplog.text
