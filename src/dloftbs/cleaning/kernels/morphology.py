"""Corrections of closing and opening: closing fills holes alone, and opening takes specks alone.

Masks are bitmasks, as `dloftbs.kernels.bitmask` cuts them out: bit j of word ``[k, r]`` is the pixel in column
``64 k + j`` of row r. A pixel's number is that of its word, ``k R + r``, times 64, plus j.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int64, uint64

from dloftbs.kernels.compiler import helper, inlined, kernel, write
from dloftbs.kernels.shared.bitmask_layout import WORD_BITS
from dloftbs.kernels.shared.copying import longer
from dloftbs.kernels.shared.popcount import count_ones, lowest_one

_Words = npt.NDArray[np.uint64]
_Queue = npt.NDArray[np.int64]

_FIRST_QUEUE = 1024
_AROUND = 8
_NOTCH = 9  # pixels
_MOST_TOUCHED = 64  # by a piece that may be a joint; one of n pixels has up to 4 n + 4 neighbours


@helper
def _grow(source: _Words, target: _Words, inside: _Words, flip: int) -> None:
    """Add to the foreground its eight neighbours inside the image; with `flip` all ones, to the background."""
    n, rows = source.shape
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    line = np.zeros(rows, dtype=np.uint64)
    up, middle, down = line[:-2], line[1:-1], line[2:]
    for k in range(1, n - 1):
        left, here, right = source[k - 1, 1:-1], source[k, 1:-1], source[k + 1, 1:-1]
        in_left, in_here, in_right = inside[k - 1], inside[k], inside[k + 1]
        for r in range(rows - 2):
            word = (here[r] ^ flip) & in_here
            beside = (((left[r] ^ flip) & in_left) >> last) | (((right[r] ^ flip) & in_right) << last)
            middle[r] = word | (word << one) | (word >> one) | beside
        grown = target[k, 1:-1]
        for r in range(rows - 2):
            grown[r] = ((up[r] | middle[r] | down[r]) ^ flip) & in_here


@helper
def _grow_and_shrink(bitmask: _Words, inside: _Words, reach: int, first: int) -> _Words:
    """Grow the foreground `reach` times and shrink it as often, or with `first` all ones the other way around."""
    n, rows = bitmask.shape
    buffers = np.zeros((2, n, rows), dtype=np.uint64)
    source = bitmask
    for step in range(2 * reach):
        target = buffers[step % 2]
        _grow(source, target, inside, first if step < reach else ~first)
        source = target
    return source


@inlined
def _get(words: _Words, p: int) -> bool:
    """Tell whether a pixel is set."""
    return (words[p >> 6] >> np.uint64(p & 63)) & np.uint64(1) != 0


@inlined
def _set(words: _Words, p: int) -> None:
    words[p >> 6] |= np.uint64(1) << np.uint64(p & 63)


@inlined
def _clear(words: _Words, p: int) -> None:
    words[p >> 6] &= ~(np.uint64(1) << np.uint64(p & 63))


@inlined
def _left(p: int, stride: int) -> int:
    """Return the pixel to the left; `stride` is 64 times the number of rows."""
    return p - 1 if p & 63 > 0 else p + 63 - stride


@inlined
def _right(p: int, stride: int) -> int:
    return p + 1 if p & 63 < 63 else p - 63 + stride


@inlined
def _recede(seed: int, stride: int, added: _Words, stack: _Queue) -> _Queue:
    """Take an added pixel away, and all that hang together with it by their sides; return the stack, as `_collect`."""
    _clear(added, seed)
    stack[0] = seed
    count = 1
    while count > 0:
        count -= 1
        p = stack[count]
        if count + _AROUND > len(stack):
            stack = longer(stack)
        for q in (p - WORD_BITS, _left(p, stride), _right(p, stride), p + WORD_BITS):
            if _get(added, q):
                _clear(added, q)
                stack[count] = q
                count += 1
    return stack


@inlined
def _collect(seed: int, stride: int, pieces: _Words, kept: _Words, queue: _Queue) -> tuple[int, int, _Queue]:
    """Take the 8-connected piece that holds a pixel out of the pieces.

    Returns
    -------
    size, touches : int
        Of its pixels, and of their neighbours in the mask that is kept, each as often as it is met.
    queue : (n,) int64
        Its first entries are the piece.
    """
    _clear(pieces, seed)
    queue[0] = seed
    count, done, touches = 1, 0, 0
    while done < count:
        p = queue[done]
        done += 1
        if count + _AROUND > len(queue):
            queue = longer(queue)
        for line in (p - WORD_BITS, p, p + WORD_BITS):
            for q in (_left(line, stride), line, _right(line, stride)):
                if _get(kept, q):
                    touches += 1
                elif _get(pieces, q):
                    _clear(pieces, q)
                    queue[count] = q
                    count += 1
    return count, touches, queue


@inlined
def _joins(piece: _Queue, size: int, rows: int, mask: _Words, touched: npt.NDArray[np.int64]) -> bool:
    """Tell whether a small piece is all that joins parts of a mask: it touches two sets of pixels or more."""
    count = 0
    stride = WORD_BITS * rows
    for i in range(size):
        for line in (piece[i] - WORD_BITS, piece[i], piece[i] + WORD_BITS):
            for q in (_left(line, stride), line, _right(line, stride)):
                if not _get(mask, q) or count == _MOST_TOUCHED:
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
def _non_zero(words: _Words) -> _Queue:
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
def _holes(added: _Words, closed: _Words, rows: int) -> _Words:
    """Return the pixels added by a closing that are no part of the background around them."""
    one, last = np.uint64(1), np.uint64(WORD_BITS - 1)
    holes = added.copy()
    stack = np.empty(_FIRST_QUEUE, dtype=np.int64)
    for i in _non_zero(added):
        word = closed[i]
        left = (word << one) | (closed[i - rows] >> last)
        right = (word >> one) | (closed[i + rows] << last)
        edge = added[i] & ~(left & right & closed[i - 1] & closed[i + 1])
        while edge != 0:
            p = WORD_BITS * i + lowest_one(edge)
            edge &= edge - one
            if _get(holes, p):
                stack = _recede(p, WORD_BITS * rows, holes, stack)
    return holes


@helper
def _ones(words: _Words) -> int:
    """Return the number of ones."""
    count = np.uint64(0)
    for word in words:
        count += count_ones(word)
    return np.int64(count)


@kernel(write(uint64, 2, "C"), write(uint64, 1, "C"), int64, int64)
def close(bitmask: _Words, inside: _Words, reach: int, most: int) -> _Words:
    """Close a mask by a square, and keep the added pixels that fill a whole hole or a small notch.

    A hole is background that hangs together by its sides, as goes with foreground that hangs together by its corners
    too: to fill one joins nothing but what it encloses, and leaves every other hole as it is. What touches the image's
    border is none. Of the rest, 8-connected pieces of a few pixels stay that touch a single set of pixels: so pepper at
    a cable's rim grows no branch, and a slit stays open, since it has two sides. Pieces do not touch each other, so
    their order does not matter. The cost grows with the pixels added, beside some looks at all words.

    Parameters
    ----------
    bitmask : (n, R) uint64
        With a margin that is wider than `reach`, and one empty word more to both sides of each row.
    inside : (n,) uint64
        The columns that lie in the image.
    reach : int
        The square's side is ``2 reach + 1``, px.
    most : int
        Largest number of added pixels; with more, the mask is noise and nothing is added.

    Returns
    -------
    (n, R) uint64
    """
    rows = bitmask.shape[1]
    closed = _grow_and_shrink(bitmask, inside, reach, np.uint64(0)).ravel()
    result = bitmask.copy()
    mask = result.ravel()
    added = closed & ~mask
    if _ones(added) > most:
        return result
    holes = _holes(added, closed, rows)
    mask |= holes
    pieces = added & ~holes
    queue = np.empty(_FIRST_QUEUE, dtype=np.int64)
    touched = np.empty((_MOST_TOUCHED, 2), dtype=np.int64)
    for i in _non_zero(pieces):
        while pieces[i] != 0:
            size, _, queue = _collect(WORD_BITS * i + lowest_one(pieces[i]), WORD_BITS * rows, pieces, mask, queue)
            if size <= _NOTCH and not _joins(queue, size, rows, mask, touched):
                for k in range(size):
                    _set(mask, queue[k])
    return result


@kernel(write(uint64, 2, "C"), write(uint64, 1, "C"), int64, int64, int64)
def open_up(bitmask: _Words, inside: _Words, reach: int, least: int, most: int) -> _Words:
    """Open a mask by a square, and put back the large 8-connected pieces that it has lost.

    Smaller ones are put back, too, if they join parts of the rest: at 2.5 px a cable is wide enough for the square in
    some places only. Pieces do not touch each other, so their order does not matter. The cost grows with the pixels
    lost, beside some looks at all words.

    Parameters
    ----------
    bitmask : (n, R) uint64
        With a margin that is wider than `reach`.
    inside : (n,) uint64
        The columns that lie in the image.
    reach : int
        The square's side is ``2 reach + 1``, px.
    least : int
        0 puts nothing back.
    most : int
        Largest number of pixels taken; with more, the mask is noise and nothing is put back.

    Returns
    -------
    (n, R) uint64
    """
    rows = bitmask.shape[1]
    opened = _grow_and_shrink(bitmask, inside, reach, ~np.uint64(0))
    if least == 0:
        return opened
    kept = opened.ravel()
    pieces = bitmask.ravel() & ~kept
    if _ones(pieces) > most:
        return opened
    queue = np.empty(_FIRST_QUEUE, dtype=np.int64)
    touched = np.empty((_MOST_TOUCHED, 2), dtype=np.int64)
    for i in _non_zero(pieces):
        while pieces[i] != 0:
            size, touches, queue = _collect(
                WORD_BITS * i + lowest_one(pieces[i]), WORD_BITS * rows, pieces, kept, queue
            )
            if size >= least or (touches > 1 and _joins(queue, size, rows, kept, touched)):
                for k in range(size):
                    _set(kept, queue[k])
    return opened
