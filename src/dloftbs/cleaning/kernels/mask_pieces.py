"""Connected pieces of bitmasks.

A pixel's number is that of its word, ``k R + r``, times 64, plus its bit; `stride` is 64 times the number R of rows.
"""

from __future__ import annotations

import numpy as np

from dloftbs.kernels.compiler import Ints, Words, helper, inlined
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.copying import longer
from dloftbs.kernels.shared.popcount import count_ones

FIRST_QUEUE = 1024
"""Length of a queue at first; it grows."""

AROUND = 8
"""Neighbours of a pixel."""

MAX_TOUCHED = 320
"""Number of pixels by a piece that may be a joint; it bounds time, for thicker cables than `thin_px` is meant for.

Source: geometry; a piece of n pixels has up to 4 n + 4 neighbours, and one beside thick parts up to 79 pixels.
"""


@inlined
def is_set(words: Words, p: int) -> bool:
    """Return whether a pixel is set."""
    return (words[p >> 6] >> np.uint64(p & 63)) & np.uint64(1) != 0


@inlined
def set_pixel(words: Words, p: int) -> None:
    """Set a pixel."""
    words[p >> 6] |= np.uint64(1) << np.uint64(p & 63)


@inlined
def clear_pixel(words: Words, p: int) -> None:
    """Clear a pixel."""
    words[p >> 6] &= ~(np.uint64(1) << np.uint64(p & 63))


@inlined
def left_of(p: int, stride: int) -> int:
    """Return the pixel to the left."""
    return p - 1 if p & 63 > 0 else p + 63 - stride


@inlined
def right_of(p: int, stride: int) -> int:
    """Return the pixel to the right."""
    return p + 1 if p & 63 < 63 else p - 63 + stride


@inlined
def collect(seed: int, stride: int, pieces: Words, kept: Words, queue: Ints, start: int) -> tuple[int, int, Ints]:
    """Take the 8-connected piece that holds a pixel out of the pieces.

    Returns
    -------
    size, touches : int
        Of its pixels, and of their neighbours in the mask that is kept, each as often as it is met.
    queue : (n,) int64
        Its entries from `start` on are the piece.
    """
    one, two = np.uint64(1), np.uint64(2)
    clear_pixel(pieces, seed)
    while start + AROUND >= len(queue):
        queue = longer(queue)
    queue[start] = seed
    count, done, touches = start + 1, start, 0
    while done < count:
        p = queue[done]
        done += 1
        if count + AROUND > len(queue):
            queue = longer(queue)
        for line in (p - WORD_BITS, p, p + WORD_BITS):
            if 0 < line & 63 < 63:  # three pixels of one word at once
                word, shift = line >> 6, np.uint64((line & 63) - 1)
                three = (kept[word] >> shift) & np.uint64(7)
                touches += np.int64((three & one) + (three >> one & one) + (three >> two))
                three = (pieces[word] >> shift) & np.uint64(7)
                if three == 0:
                    continue
                pieces[word] &= ~(three << shift)
                for k in range(3):
                    queue[count] = line - 1 + k
                    count += np.int64(three >> np.uint64(k) & one)
                continue
            for q in (left_of(line, stride), line, right_of(line, stride)):
                if is_set(kept, q):
                    touches += 1
                elif is_set(pieces, q):
                    clear_pixel(pieces, q)
                    queue[count] = q
                    count += 1
    return count - start, touches, queue


@helper
def joins_parts(queue: Ints, start: int, size: int, rows: int, mask: Words, touched: Ints) -> bool:
    """Return whether a small piece is all that joins parts of a mask: it touches two sets of pixels or more."""
    count = 0
    stride = WORD_BITS * rows
    for i in range(start, start + size):
        for line in (queue[i] - WORD_BITS, queue[i], queue[i] + WORD_BITS):
            for q in (left_of(line, stride), line, right_of(line, stride)):
                if not is_set(mask, q) or count == MAX_TOUCHED:
                    continue
                row, column = (q >> 6) % rows, (q >> 6) // rows * WORD_BITS + (q & 63)
                known = False
                for k in range(count):
                    known |= touched[k, 0] == row and touched[k, 1] == column
                if not known:
                    touched[count, 0], touched[count, 1] = row, column
                    count += 1
    if count < 2:
        return False
    reached = 1  # number of leading entries that hang together with the first
    done = 0
    while done < reached:
        for i in range(reached, count):
            if abs(touched[i, 0] - touched[done, 0]) <= 1 and abs(touched[i, 1] - touched[done, 1]) <= 1:
                for d in range(2):
                    touched[i, d], touched[reached, d] = touched[reached, d], touched[i, d]
                reached += 1
        done += 1
    return reached < count


@helper
def non_zero(words: Words) -> Ints:
    """Return the indices of the words that are not 0."""
    count = 0
    for word in words:
        count += word != 0
    indices = np.empty(count, dtype=np.int64)
    count = 0
    for i in range(len(words)):
        if words[i] != 0:
            indices[count] = i
            count += 1
    return indices


@helper
def total_ones(words: Words) -> int:
    """Return the number of ones."""
    count = np.uint64(0)
    for word in words:
        count += count_ones(word)
    return np.int64(count)


@inlined
def beside(words: Words, i: int, rows: int) -> int:
    """Return the pixels that are left or right of those of a word."""
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    return (words[i] << one) | (words[i] >> one) | (words[i - rows] >> last) | (words[i + rows] << last)


@inlined
def around(words: Words, i: int, rows: int) -> int:
    """Return the pixels that are neighbours of others, in the place of a word."""
    above, below = beside(words, i - 1, rows), beside(words, i + 1, rows)
    return above | words[i - 1] | beside(words, i, rows) | words[i + 1] | below


@inlined
def touches_any(piece: Ints, size: int, stride: int, mask: Words) -> bool:
    """Return whether a piece has a neighbour in a mask."""
    for i in range(size):
        for line in (piece[i] - WORD_BITS, piece[i], piece[i] + WORD_BITS):
            for q in (left_of(line, stride), line, right_of(line, stride)):
                if is_set(mask, q):
                    return True
    return False
