"""Order in which help lists commands and options."""

from __future__ import annotations

import click

ORDER = (
    *("demo", "tune", "detect", "track", "view", "diagnose", "batch", "stereo", "colour", "background"),
    *("config", "evaluate", "warmup"),
)
"""Commands in the order of use; others come behind."""

_REST = "Page and run"
SECTIONS = {
    "Input": (
        *("kind", "masks", "instances", "occluders", "limit", "every", "fps", "topic", "mask_topic"),
        *("side_by_side", "right_topic", "right_masks", "right_mask_topic"),
    ),
    "Cable or ground": ("hsv", "local", "background", "mask_is", "roi"),
    "Method": ("config_file", "changes", "paper", "objects", "branched", "min_confidence"),
    "Metres": (
        *("depth", "depth_unit", "depth_topic", "camera", "info_topic", "registration", "rig_files", "rectified"),
        *("robot", "joints", "camera_pose"),
    ),
    "Output": ("outs", "out", "overlay", "stages", "with_input", "answer_kinds", "bend_limit", "rerun"),
    _REST: (),
}
"""Headings, and the options below each by the names of their parameters; the last has all others."""


class SectionedCommand(click.Command):
    """A command whose help lists its options under headings, in the order of `SECTIONS`."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options under their headings."""
        homes = {name: heading for heading, names in SECTIONS.items() for name in names}
        rows: dict[str, list[tuple[str, str]]] = {heading: [] for heading in SECTIONS}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            # Arguments are in the line of usage and in the text; some versions of click list them again, bare.
            if record is not None and not isinstance(parameter, click.Argument):
                rows[homes.get(parameter.name or "", _REST)].append(record)
        for heading, records in rows.items():
            if records:
                with formatter.section(heading):
                    formatter.write_dl(records)
