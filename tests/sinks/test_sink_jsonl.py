from __future__ import annotations

import json
import logging

import numpy as np
import pytest
import sinks.sink_examples as examples

from dloftbs.data.curve import BSplineCurve
from dloftbs.data.frame_result import FrameResult
from dloftbs.errors import SinkError, SourceError
from dloftbs.sinks import JsonLinesSink, read_json_lines


def test_round_trip(tmp_path):
    results = [examples.detected(0, in_space=True), examples.nothing(1), examples.tracked(2)]
    path = tmp_path / "new" / "Kabel ł 電.jsonl"
    with JsonLinesSink(path) as sink:
        for result in results:
            sink.write(examples.frame(), result)
    records = list(read_json_lines(path))
    assert records == [result.to_dict() for result in results]
    assert BSplineCurve.from_dict(records[0]["detections"][0]["curve_3d"]) == results[0].detections[0].curve_3d


def test_every_line_is_there_before_the_sink_is_closed(tmp_path):
    path = tmp_path / "a.jsonl"
    with JsonLinesSink(path) as sink:
        for i in range(3):
            sink.write(examples.frame(i), examples.detected(i))
            assert len(list(read_json_lines(path))) == i + 1


def test_a_line_is_the_result_s_dictionary_whatever_made_its_numbers(tmp_path):
    times = {"float": np.float32(0.5), "int": np.int64(3)}
    result = FrameResult((), (), "empty", (np.int16(48), 64), times, np.uint8(7), np.float32(0.25))
    with JsonLinesSink(tmp_path / "a.jsonl") as sink:
        sink.write(examples.frame(), result)
        sink.write(examples.frame(), examples.tracked(1))
    lines = [json.loads(line) for line in (tmp_path / "a.jsonl").read_text().splitlines()]
    assert lines == [result.to_dict(), examples.tracked(1).to_dict()]
    assert lines[0]["stage_ms"] == {"float": 0.5, "int": 3.0}


def test_part_of_a_line_at_the_end_is_left_out_with_a_warning(tmp_path, caplog):
    path = tmp_path / "a.jsonl"
    path.write_text('{"index":0}\n{"index":1}\n{"ind')
    with caplog.at_level(logging.WARNING, "dloftbs.sinks"):
        assert list(read_json_lines(path)) == [{"index": 0}, {"index": 1}]
    assert "line 3 is cut off" in caplog.text


def test_a_last_line_without_its_end_of_line_is_whole(tmp_path, caplog):
    path = tmp_path / "a.jsonl"
    path.write_text('{"index":0}\n{"index":1}')
    assert len(list(read_json_lines(path))) == 2
    assert not caplog.records


@pytest.mark.parametrize("bad", ["{oops}", "[1]", "", '{"index":'])
def test_a_corrupt_line_raises_with_its_number(tmp_path, bad):
    path = tmp_path / "a.jsonl"
    path.write_text('{"index":0}\n' + bad + '\n{"index":2}\n')
    records = read_json_lines(path)
    assert next(records) == {"index": 0}
    with pytest.raises(SourceError, match="line 2"):
        next(records)


def test_a_missing_file_is_a_source_error(tmp_path):
    with pytest.raises(SourceError, match=r"none\.jsonl"):
        list(read_json_lines(tmp_path / "none.jsonl"))


def test_a_disk_that_was_full_for_a_moment_spoils_no_line(tmp_path, monkeypatch):
    path = tmp_path / "a.jsonl"
    with JsonLinesSink(path) as sink:
        sink.write(examples.frame(), examples.nothing(0))

        def half(data):
            sink._file._file.write(data[: len(data) // 2])
            raise OSError(28, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(sink._file, "_write_all", half)
            with pytest.raises(SinkError, match="No space left"):
                sink.write(examples.frame(), examples.detected(1))
        sink.write(examples.frame(), examples.nothing(2))
    assert [record["index"] for record in read_json_lines(path)] == [0, 2]


@pytest.mark.parametrize("line", [b'{"name": "\xff"}\n', b"[" * 20_000 + b"\n", b'{"a": ' * 20_000 + b"\n", b"1e999\n"])
def test_lines_that_are_no_text_or_nested_too_deeply_are_named(tmp_path, line):
    path = tmp_path / "a.jsonl"
    path.write_bytes(b'{"a": 1}\n' + line)
    with pytest.raises(SourceError, match=r"a\.jsonl', line 2: "):
        list(read_json_lines(path))
    path.write_bytes(b'{"a": 1}\n' + line.rstrip())  # cut off within a letter, say
    assert list(read_json_lines(path)) == [{"a": 1}]
