"""The table of all families."""

from __future__ import annotations

from fuzz import arrays, commands, files, masks, processes, streams, values
from fuzz.checks import check_curves_on_mask, check_mask
from fuzz.family import Family

_MASKS = [
    *(Family(name, make, check_mask, cases=20) for name, make in masks.GENERATORS.items()),
    Family("border-blobs", masks.blob_at_border, check_mask, cases=20),
    Family("cables-seen", masks.cables, check_curves_on_mask, cases=100),
    Family("border-blobs-seen", masks.blob_at_border, check_curves_on_mask, 100, masks.BORDER_BLOBS_FOUND),
    Family("tangles-seen", masks.drawn_tangle, check_curves_on_mask, cases=100),
    Family("anything-seen", masks.any_mask, check_curves_on_mask, 100, masks.ANYTHING_FOUND),
]
_ARRAYS = [
    Family("mask-layouts", arrays.laid_mask, arrays.check_laid_mask, cases=100),
    Family("wrong-arrays", arrays.wrong_array, arrays.check_wrong_array, cases=100, fixed=arrays.WRONG),
    Family("depth", arrays.with_depth, arrays.check_with_depth, cases=40, fixed=arrays.DEPTH_FOUND),
    Family("colours", arrays.some_seed, arrays.check_image_colours, cases=20),
]
_STREAMS = [
    Family("moving", streams.moving, streams.check_stream, cases=20),
    Family("changing", streams.changing, streams.check_stream, cases=30),
    Family("crowds", streams.crowded, streams.check_stream, cases=3),
    Family("come-and-go", streams.come_and_go, streams.check_stream, cases=10, fixed=streams.COME_AND_GO_FOUND),
    Family("long-streams", arrays.some_seed, streams.check_long_stream, cases=1),
    Family("bare-curves", streams.bare_curves, streams.check_bare_curves, cases=40),
]
_VALUES = [
    Family(name, arrays.some_seed, values.of(strategy, check), cases, values.fixed(found))
    for name, strategy, check, cases, found in (
        ("cameras", values.CAMERAS, values.check_camera, 3, values.CAMERAS_FOUND),
        ("frames", values.FRAMES, values.check_frame, 3, values.FRAMES_FOUND),
        ("settings", values.CHANGES, values.check_changes, 4, values.CHANGES_FOUND),
        ("dictionaries", values.NESTED, values.check_from_dict, 5, values.FROM_DICT_FOUND),
        ("colour-ranges", values.HSV, values.check_hsv, 3, {}),
        ("curves", values.CURVES, values.check_curve_values, 3, values.CURVES_FOUND),
    )
]
_FILES = [
    Family("calibrations", files.calibration, files.check_calibration, 80, files.CALIBRATIONS_FOUND),
    Family("images", files.image_file, files.check_image, 60, files.IMAGES_FOUND),
    Family("videos", files.video_file, files.check_video, 40),
    Family("stacks", files.stack_file, files.check_stack, 60, files.STACKS_FOUND),
    Family("lines", files.lines_file, files.check_lines, 20, files.LINES_FOUND),
]
_RUNS = [
    Family("calls", commands.call, commands.check_call, 60, commands.CALLS_FOUND),
    Family("over-inputs", commands.over_input, commands.check_call, 40, commands.OVER_INPUT_FOUND),
    Family("kills", processes.kill, processes.check_kill, 3),
    Family("full-disks", processes.full_disk, processes.check_full_disk, 20, processes.FULL_DISKS_FOUND),
    Family("two-writers", processes.two_writers, processes.check_two_writers, 3),
    Family("names", processes.names, processes.check_names, 20, processes.NAMES_FOUND),
    Family("endings", processes.ending, processes.check_ending, 3, processes.ENDINGS_FOUND),
]

FAMILIES = {family.name: family for family in (*_MASKS, *_ARRAYS, *_STREAMS, *_VALUES, *_FILES, *_RUNS)}
"""By name, in the order in which they run."""
