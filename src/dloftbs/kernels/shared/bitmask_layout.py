"""Layout of a bitmask, see `dloftbs.kernels.bitmask`."""

from __future__ import annotations

WORD_BITS = 64
"""Columns of a word."""

TILE_ROWS = 16
"""The number of rows of a framed bitmask, but for the first and the last, is a multiple of this."""
