"""The file ``metadata.yaml`` beside the files of a rosbag2."""

from __future__ import annotations

import re
from collections.abc import Mapping

import yaml

_VERSION = 5
"""Of the format: that of Humble, which later ones read."""


QOS = "offered_qos_profiles"
"""Key of the publishers' QoS, here and in the metadata of a channel."""
_IN_NUMBERS = re.compile(r"history: *[0-9]")
"""Begin of a QoS as that version has it; later ones have words, which its readers do not know."""


def metadata_yaml(
    file: str,
    counts: Mapping[tuple[str, str], int],
    span_ns: tuple[int, int] | None,
    qos: Mapping[str, str] | None = None,
) -> str:
    """Return the content of ``metadata.yaml`` of a recording in one MCAP file.

    Parameters
    ----------
    file : str
        Name of the file.
    counts : mapping of (str, str) to int
        Messages by topic and type.
    span_ns : (int, int), optional
        First and last time; None where there are no messages.
    qos : mapping of str to str, optional
        QoS of topics' publishers, as recordings have it; written where it is in the form of this version.
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
                QOS: text if _IN_NUMBERS.search(text := (qos or {}).get(name, "")) else "",
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
