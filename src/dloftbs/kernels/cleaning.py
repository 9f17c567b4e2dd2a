"""What a morphological closing adds that is no hole, and what an opening takes that is more than a speck."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import int64, uint8

from dloftbs.kernels._compile import helper, kernel, write

_FIRST_QUEUE = 1024
_WORD = 8
_BLOCK = 16  # words compared without a branch
_NOTCH = 9  # pixels
_MOST_TOUCHED = 64  # by a piece that may be a joint; one of n pixels has up to 4 n + 4 neighbours

_Queue = npt.NDArray[np.int64]


@helper
def _longer(queue: _Queue) -> _Queue:
    """Return the same in an array that is twice as long."""
    longer = np.empty(2 * len(queue), dtype=np.int64)
    longer[: len(queue)] = queue
    return longer


@helper
def _most_changed(rows: int, columns: int) -> int:
    """Return how many pixels may change before a mask counts as noise, which bounds the time."""
    return rows * columns // 32 + 4096


@helper
def _next_difference(one: npt.NDArray[np.uint64], other: npt.NDArray[np.uint64], k: int) -> int:
    """Return the first index from `k` on at which two arrays differ; their length where there is none."""
    n = len(one)
    while k < n:
        if k + _BLOCK <= n:
            difference = np.uint64(0)
            for i in range(k, k + _BLOCK):
                difference |= one[i] ^ other[i]
            if difference == 0:
                k += _BLOCK
                continue
        if one[k] != other[k]:
            return k
        k += 1
    return n


@helper
def _list_added(
    before: npt.NDArray[np.uint8], closed: npt.NDArray[np.uint8], most: int
) -> tuple[npt.NDArray[np.int64], int]:
    """Return where a closing has added foreground, as the first so many entries of an array; stop above `most`."""
    added = np.empty(_FIRST_QUEUE, dtype=np.int64)
    count = 0
    whole = len(before) - len(before) % _WORD
    words_before, words_closed = before[:whole].view(np.uint64), closed[:whole].view(np.uint64)
    k = 0
    while k <= len(words_before):
        k = _next_difference(words_before, words_closed, k)
        if count > most:
            break
        if count + _WORD > len(added):
            added = _longer(added)
        for p in range(_WORD * k, min(_WORD * (k + 1), len(before))):
            if before[p] == 0 and closed[p] != 0:
                added[count] = p
                count += 1
        k += 1
    return added, count


@helper
def _is_beside_background(p: int, rows: int, columns: int, mask: npt.NDArray[np.uint8]) -> bool:
    """Tell whether one of a pixel's four neighbours is background, or beyond the image."""
    row, column = p // columns, p % columns
    if row == 0 or column == 0 or row == rows - 1 or column == columns - 1:
        return True
    return mask[p - columns] == 0 or mask[p - 1] == 0 or mask[p + 1] == 0 or mask[p + columns] == 0


@helper
def _recede(
    p: int, rows: int, columns: int, before: npt.NDArray[np.uint8], closed: npt.NDArray[np.uint8], stack: _Queue
) -> _Queue:
    """Take back an added pixel, and all that hang together with it by their sides; return the stack, as `_collect`."""
    closed[p] = 0
    stack[0] = p
    count = 1
    while count > 0:
        count -= 1
        p = stack[count]
        row, column = p // columns, p % columns
        if count + _WORD > len(stack):
            stack = _longer(stack)
        for q, is_inside in (
            (p - columns, row > 0),
            (p - 1, column > 0),
            (p + 1, column < columns - 1),
            (p + columns, row < rows - 1),
        ):
            if is_inside and closed[q] != 0 and before[q] == 0:
                closed[q] = 0
                stack[count] = q
                count += 1
    return stack


@helper
def _collect(
    seed: int,
    columns: int,
    larger: npt.NDArray[np.uint8],
    smaller: npt.NDArray[np.uint8],
    queue: _Queue,
    most: int,
) -> tuple[int, int, _Queue]:
    """Take the piece that holds a pixel, of what one mask has more than the other, out of the larger one.

    Beyond `most` pixels the rest of it stays.

    Returns
    -------
    size, touches : int
        Of its pixels, and of their neighbours in the smaller mask, each as often as it is met.
    queue : (n,) int64
        Its first entries are the piece.
    """
    larger[seed] = 0
    queue[0] = seed
    count, done, touches = 1, 0, 0
    while done < count <= most:
        p = queue[done]
        done += 1
        column = p % columns
        if count + _WORD > len(queue):
            queue = _longer(queue)
        for line in (p - columns, p, p + columns):
            if line < 0 or line >= len(larger):
                continue
            for q in range(line - (column > 0), line + (column < columns - 1) + 1):
                if smaller[q] != 0:
                    touches += 1
                elif larger[q] != 0:
                    larger[q] = 0
                    queue[count] = q
                    count += 1
    return count, touches, queue


@helper
def _joins(
    piece: _Queue,
    size: int,
    columns: int,
    mask: npt.NDArray[np.uint8],
    touched: npt.NDArray[np.int64],
) -> bool:
    """Tell whether a small piece is all that joins parts of a mask: it touches two sets of pixels or more."""
    count = 0
    for k in range(size):
        p = piece[k]
        row, column = p // columns, p % columns
        for r in range(max(row - 1, 0), min(row + 2, len(mask) // columns)):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                if mask[r * columns + c] == 0 or count == _MOST_TOUCHED:
                    continue
                known = False
                for i in range(count):
                    known |= touched[i, 0] == r and touched[i, 1] == c
                if not known:
                    touched[count, 0], touched[count, 1] = r, c
                    count += 1
    if count < 2:
        return False
    reached = 1  # the first so many hang together with the first
    done = 0
    while done < reached:
        for i in range(reached, count):
            if abs(touched[i, 0] - touched[done, 0]) <= 1 and abs(touched[i, 1] - touched[done, 1]) <= 1:
                for d in range(2):
                    touched[i, d], touched[reached, d] = touched[reached, d], touched[i, d]
                reached += 1
        done += 1
    return reached < count


@kernel(write(uint8, 2, "C"), write(uint8, 2, "C"))
def keep_filled(before: npt.NDArray[np.uint8], closed: npt.NDArray[np.uint8]) -> None:
    """Take back, in place, what a closing has added, but where it filled a whole hole, or a small notch.

    A hole is background that hangs together by its sides, as goes with foreground that hangs together by its corners
    too: to fill one joins nothing but what it encloses, and leaves every other hole as it is. What touches the image's
    border is none. Of the rest, 8-connected pieces of a few pixels stay that touch a single set of pixels: so pepper at
    a cable's rim grows no branch, and a slit stays open, since it has two sides. Pieces do not touch each other, so
    their order does not matter. The cost grows with the pixels added, beside one look at all of them; where they are so
    many that the mask is noise, all is taken back.

    Parameters
    ----------
    before : (H, W) uint8
        The mask before the closing; used up.
    closed : (H, W) uint8
        The same and more.
    """
    rows, columns = before.shape
    mask, kept = before.ravel(), closed.ravel()
    most = _most_changed(rows, columns)
    added, count = _list_added(mask, kept, most)
    if count > most:
        closed[:] = before
        return
    queue = np.empty(_FIRST_QUEUE, dtype=np.int64)
    for i in range(count):
        if kept[added[i]] != 0 and _is_beside_background(added[i], rows, columns, kept):
            queue = _recede(added[i], rows, columns, mask, kept, queue)
    # What has not receded is holes, and counts as foreground from here on; the rest is looked at again.
    for i in range(count):
        if kept[added[i]] != 0:
            mask[added[i]] = 1
        else:
            kept[added[i]] = 1
    touched = np.empty((_MOST_TOUCHED, 2), dtype=np.int64)
    for i in range(count):
        if kept[added[i]] == 0 or mask[added[i]] != 0:
            continue
        size, _, queue = _collect(added[i], columns, kept, mask, queue, count)
        if size <= _NOTCH and not _joins(queue, size, columns, mask, touched):
            for k in range(size):
                kept[queue[k]] = mask[queue[k]] = 1


@kernel(write(uint8, 2, "C"), write(uint8, 2, "C"), int64)
def give_back(before: npt.NDArray[np.uint8], opened: npt.NDArray[np.uint8], least: int) -> bool:
    """Put back into an opened mask, in place, the 8-connected pieces of at least so many pixels that it has lost.

    So are smaller ones that join what is left: at 2.5 px a cable is wide enough for the square in some places only.
    Pieces do not touch each other, so their order does not matter. The cost grows with the pixels lost, beside one look
    at all of them, eight at a time.

    Parameters
    ----------
    before : (H, W) uint8
        The mask before the opening; used up.
    opened : (H, W) uint8
        A part of it.
    least : int

    Returns
    -------
    bool
        False where so much was lost that the mask is noise: then the work is not done to the end, and opening the
        result again takes back what was put.
    """
    columns = before.shape[1]
    most = _most_changed(before.shape[0], columns)
    lost = 0
    lost_from, kept = before.ravel(), opened.ravel()
    queue = np.empty(_FIRST_QUEUE, dtype=np.int64)
    touched = np.empty((_MOST_TOUCHED, 2), dtype=np.int64)
    whole = len(kept) - len(kept) % _WORD
    words_from, words_kept = lost_from[:whole].view(np.uint64), kept[:whole].view(np.uint64)
    k = 0
    while k <= len(words_kept):
        k = _next_difference(words_from, words_kept, k)
        for p in range(_WORD * k, min(_WORD * (k + 1), len(kept))):
            if lost_from[p] == 0 or kept[p] != 0:
                continue
            count, touches, queue = _collect(p, columns, lost_from, kept, queue, most)
            lost += count
            if lost > most:
                return False
            if count >= least or (touches > 1 and _joins(queue, count, columns, kept, touched)):
                for i in range(count):
                    kept[queue[i]] = 1
        k += 1
    return True
