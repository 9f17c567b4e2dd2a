"""One clock for the messages of a topic, whatever single headers say."""

from __future__ import annotations

from dloftbs.ros.message_fields import NS_PER_S

_LEAP_NS = 60 * NS_PER_S
"""Largest advance of a header on the recording between two messages; more is another clock."""


class TopicClock:
    """Gives the messages of a topic ascending times: those of their headers, as long as these ascend.

    A header is ignored if it has no time, or a time that does not follow the previous message. The message then comes
    as long after the previous one as it does in the recording.

    Parameters
    ----------
    offset_ns : int, optional
        Time in headers minus that of the recording. Without one, all times are those of the recording.

    Attributes
    ----------
    deviates : bool
        Whether the last time is not that of its header, although headers have times.
    """

    def __init__(self, offset_ns: int | None) -> None:
        self._offset_ns = offset_ns
        self._last_ns: int | None = None
        self._last_log_ns = 0
        self.deviates = False

    def time_ns(self, header_ns: int | None, log_ns: int) -> int:
        """Return the time of the next message.

        Parameters
        ----------
        header_ns : int, optional
            Time in its header, if it has one.
        log_ns : int
            Time at which it was recorded.
        """
        time_ns = self._followed(header_ns, log_ns)
        self.deviates = self._offset_ns is not None and time_ns != header_ns
        self._last_ns, self._last_log_ns = time_ns, log_ns
        return time_ns

    def _followed(self, header_ns: int | None, log_ns: int) -> int:
        if self._offset_ns is None:
            return log_ns
        if self._last_ns is None:
            return log_ns + self._offset_ns if header_ns is None else header_ns
        passed_ns = max(log_ns - self._last_log_ns, 0)
        if header_ns is not None and 0 < header_ns - self._last_ns <= passed_ns + _LEAP_NS:
            return header_ns
        return self._last_ns + passed_ns
