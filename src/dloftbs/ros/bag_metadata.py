"""The file ``metadata.yaml`` beside the files of a rosbag2."""

from __future__ import annotations

from collections.abc import Mapping

import yaml

_VERSION = 5
"""Of the format: that of Humble, which later ones read."""


def metadata_yaml(file: str, counts: Mapping[tuple[str, str], int], span_ns: tuple[int, int] | None) -> str:
    """Return the content of ``metadata.yaml`` of a recording in one MCAP file.

    Parameters
    ----------
    file : str
        Name of the file.
    counts : mapping of (str, str) to int
        Messages by topic and type.
    span_ns : (int, int), optional
        First and last time; None where there are no messages.
    """
    first, last = span_ns or (0, 0)
    total = sum(counts.values())
    span = {
        "duration": {"nanoseconds": last - first},
        "starting_time": {"nanoseconds_since_epoch": first},
        "message_count": total,
    }
    topics = [
        {
            "topic_metadata": {
                "name": name,
                "type": kind,
                "serialization_format": "cdr",
                "offered_qos_profiles": "",
            },
            "message_count": count,
        }
        for (name, kind), count in counts.items()
    ]
    information = {
        "version": _VERSION,
        "storage_identifier": "mcap",
        **span,
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file],
        "files": [{"path": file, **span}],
    }
    return yaml.dump({"rosbag2_bagfile_information": information}, Dumper=_Plain, sort_keys=False)


class _Plain(yaml.SafeDumper):
    """Writes a mapping that occurs twice out twice, without an alias."""

    def ignore_aliases(self, data: object) -> bool:
        """Return True, for all."""
        return True
