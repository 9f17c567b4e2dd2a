"""Text that others wrote: what it may hold, and what it may not ask for."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest
import yaml
from bounded import run_bounded
from hypothesis import given
from hypothesis import strategies as st

from dloftbs.errors import InputError
from dloftbs.support.documents import (
    MAX_BYTES,
    MAX_DEPTH,
    MAX_NODES,
    parse_json,
    parse_opencv_xml,
    parse_yaml,
    read_lines,
    read_text,
)

words = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), max_size=5).filter(
    lambda word: not re.fullmatch("[-+.0-9]+[eE][-+0-9]+", word)  # PyYAML writes text like a number without quotes
)
plain = st.none() | st.booleans() | st.integers(-(10**20), 10**20) | st.floats(allow_nan=False) | words
values = st.recursive(
    plain, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(words, inner, max_size=3), max_leaves=8
)


class _Plain(yaml.SafeDumper):
    def ignore_aliases(self, data: object) -> bool:
        return True


@given(st.dictionaries(words, values, max_size=3))
def test_what_is_written_comes_back(value: dict[str, object]) -> None:
    for flow in (True, False):
        assert parse_yaml(yaml.dump(value, Dumper=_Plain, default_flow_style=flow, allow_unicode=True)) == [value]
    if all(math.isfinite(x) for x in _floats(value)):
        assert parse_json(json.dumps(value)) == value


def _floats(value: object) -> list[float]:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return [value] if isinstance(value, float) else [x for item in inner for x in _floats(item)]


def test_yaml_is_read_as_yaml_says() -> None:
    text = "%YAML:1.0\n---\na: [1, 0x10, 1., -2.5e-3, .inf, ~, yes, '3', 2026-11-21]\n2: !!float 3\n---\n"
    assert parse_yaml(text) == [{"a": [1, 16, 1.0, -0.0025, math.inf, None, True, "3", "2026-11-21"], "2": 3.0}]
    assert parse_yaml("a: !!opencv-matrix {rows: 3}\nb: !!str 1\n") == [{"a": {"rows": 3}, "b": "1"}]
    assert parse_yaml("1\n---\n[]\n...\n") == [1, []]
    assert parse_yaml("{a: 170:10, b: [1:30.5, 40:55], c: 7}") == [{"a": "170:10", "b": ["1:30.5", "40:55"], "c": 7}]
    assert parse_yaml("[1e-3, -2E+3, 1.5e3, '1e3', 1e, e3, 1e3m]") == [
        [0.001, -2000.0, 1500.0, "1e3", "1e", "e3", "1e3m"]
    ]
    assert parse_yaml("") == []


def test_a_key_stands_once_where_that_is_asked_for() -> None:
    text = "a:\n  b: 1\nc:\n  b: 2\n  b: 3\n"
    assert parse_yaml(text) == [{"a": {"b": 1}, "c": {"b": 3}}]
    with pytest.raises(InputError, match=r"the key 'b' must stand once in its place, and is there again \(line 5\)"):
        parse_yaml(text, once=True)


def bomb(levels: int) -> str:
    lines = ["a0: &a0 [1, 1]"] + [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, levels)]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (bomb(10), "aliases are not supported; write out what \\*a0 stands for \\(line 2\\)"),
        ("a: &a [*a]", "aliases are not supported"),
        ("a: &a {b: 1}\nc: {<<: *a}", "aliases are not supported"),
        ("a: !!float abc", "'abc' is no float \\(line 1\\)"),
        ("a:\n  !!timestamp 5", "'5' is no timestamp \\(line 2\\)"),
        ("a: 2001-99-99", "'2001-99-99' is no timestamp"),
        ("a: !!int ''", "'' is no int"),
        ("a: !!bool maybe", "'maybe' is no bool"),
        ("a: !!binary aa==", "the tag tag:yaml.org,2002:binary is not supported"),
        ("a: !!set {b}", "the tag tag:yaml.org,2002:set is not supported"),
        ("!!python/object/apply:os.system ['true']", "the tag .*os.system is not supported"),
        ("a: " + "1" * 400, "a number must have at most 100 digits, got 400 characters"),
        ("a: " + "1:" * 10**6 + "1", "a number must have at most 100 digits"),
        ("a: !!int " + "1" * 5000, "at most 100 characters, got 5000"),
        ("[" * 20_000, f"must be nested at most {MAX_DEPTH} deep"),
        ("- " * 20_000, f"must be nested at most {MAX_DEPTH} deep"),
        ("{a: " * 20_000, f"must be nested at most {MAX_DEPTH} deep"),
        ("? " * 20_000, "a key must be a word"),
        ("[1]: 2", "a key must be a word, not a list or a mapping"),
        ("[" + "1," * (MAX_NODES + 1) + "]", f"holds more than {MAX_NODES} values"),
        ("%TAG !a! b\n" * 1000 + "---\na: 1", "lines may begin with %"),
        ("a: [1", "is no YAML"),
        ("a: \0", "is no YAML"),
        ("a: \udc80", "is no YAML"),
    ],
    ids=lambda text: text[:16],
)
def test_yaml_beyond_the_limits_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_yaml(text)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"[" * 20_000, "nested too deeply"),
        (b'{"a":' * 20_000, "nested too deeply"),
        (b"[" * 100 + b"]" * 100, f"must be nested at most {MAX_DEPTH} deep"),
        (b"1" * 400, "a number must have at most 100 digits"),
        (b"[" + b"1" * 5000 + b"]", "out of range"),
        (b'{"a": "\xff"}', "must be UTF-8"),
        (b"[1e999]", "out of range"),
        (b"{", "truncated"),
    ],
    ids=lambda data: str(data[:16]),
)
def test_json_beyond_the_limits_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_json(data)


def test_opencvs_xml_is_read() -> None:
    text = """<?xml version="1.0"?>
    <opencv_storage><a>3</a><b>"x y"</b><c type_id="opencv-matrix"><rows>1</rows><data>1. 2e-1</data></c>
    <d><_>1 2</_><_>.Nan_</_></d><e/></opencv_storage>"""
    known = {"a": 3.0, "b": "x y", "c": {"rows": 1.0, "data": [1.0, 0.2]}, "d": [[1.0, 2.0], ".Nan_"], "e": []}
    assert parse_opencv_xml(text) == known


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><opencv_storage>&b;</opencv_storage>", "DOCTYPE"),
        ("<opencv_storage>" + "<a>" * 20_000, f"must be nested at most {MAX_DEPTH} deep"),
        ("<opencv_storage>" + "<a/>" * (MAX_NODES + 1), f"holds more than {MAX_NODES} values"),
        (f"<opencv_storage><a>{'1' * 400}</a></opencv_storage>", "at most 100 digits, got 400"),
        ("<camera/>", "its root must be opencv_storage, got 'camera'"),
        ("<", "is no XML"),
        ("<a>&b;</a>", "is no XML"),
    ],
    ids=lambda text: text[:16],
)
def test_xml_beyond_the_limits_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_opencv_xml(text)


def test_a_file_that_is_too_large_is_not_read_whole(tmp_path) -> None:
    (tmp_path / "a").write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(InputError, match=f"at most {MAX_BYTES} bytes"):
        read_text(tmp_path / "a")


def test_lines_are_read_from_a_file_of_any_length(tmp_path) -> None:
    (tmp_path / "a").write_bytes(b"\xef\xbb\xbfone\r\n" + b"two\n" * (MAX_BYTES // 4))
    lines = read_lines(tmp_path / "a")
    assert (next(lines), next(lines), sum(1 for _ in lines)) == ("one\r\n", "two\n", MAX_BYTES // 4 - 1)
    for content, why in ((b"#" * (MAX_BYTES + 1), f"fewer than {MAX_BYTES} characters"), (b"\xff", "must be UTF-8")):
        (tmp_path / "a").write_bytes(content)
        with pytest.raises(InputError, match=f"^cannot be read: .*{why}"):
            list(read_lines(tmp_path / "a"))
    with pytest.raises(InputError, match=r"^cannot be read: No such file"):
        list(read_lines(tmp_path / "none"))


HOSTILE = """
import sys
for file in sys.argv[1:]:
    for read in (PinholeCamera.from_file, DepthRegistration.from_file, Config.from_file):
        try:
            print(read(file))
        except (SourceError, ConfigError) as error:
            assert file in str(error), error
            assert len(str(error)) < 2000
"""
IMPORTS = """
import yaml, numpy.linalg
from xml.etree import ElementTree
from dloftbs import PinholeCamera, Config
from dloftbs.camera import DepthRegistration
import dloftbs.camera.calibration_files
from dloftbs.errors import ConfigError, SourceError
"""
MATRIX = "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [{}]\n"


def test_no_file_crashes_hangs_or_takes_much_memory(tmp_path) -> None:
    texts = [
        *(
            MATRIX.format(rows, cols, data)
            for rows, cols in ((3, -1), (-3, -3), (10**9, 10**9), (3, 4))
            for data in ("1, 2, 3", "600, 0, 320, 0, 600, 240, 0, 0, 1")
        ),
        "%YAML:1.0\n---\nK: " + "[" * 50_000,
        '{"K": ' + "[" * 50_000,
        "<?xml version='1.0'?><opencv_storage><K>" + "<_>" * 50_000,
        bomb(40),
        "a: &a {b: *a}",
        "fx: " + "1" * 400 + "\nfy: 1\ncx: 1\ncy: 1",
        json.dumps({"fx": 10**400, "fy": 1, "cx": 1, "cy": 1}),
        json.dumps({"fx": 10**90, "fy": 10**90, "cx": "1e999", "cy": 1}),
        '{"fx": !!opencv-matrix {}, "a": ' + "{a: " * 5000,
        "K: [" + "x" * (1 << 21) + ", 1" * 50_000 + "]",
        "intrinsic_matrix: [[1, 0], [0, 1, 0, 0, 0, 0, 1]]",
        "camera_model: " + "x" * (1 << 21) + "\nintrinsics: 1",
    ]
    files = [tmp_path / f"{i}.yaml" for i in range(len(texts))]
    for file, text in zip(files, texts, strict=True):
        file.write_text(text)
    assert run_bounded(HOSTILE, *files, first=IMPORTS, extra_bytes=1 << 30) == ""


def test_a_path_with_a_null_byte_cannot_be_read() -> None:
    with pytest.raises(InputError, match="cannot be read: embedded null byte"):
        read_text(Path("a\0.yaml"))
