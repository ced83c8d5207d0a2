"""The diagonals of (A - p I)^-1 for several complex shifts p, without the inverses.

A is sparse, real and symmetric, p is no eigenvalue. One ordering and one structure serve all shifts. Each A - p I is
factored into L D L^T (complex symmetric, no pivoting: its real or its imaginary part is definite), and the entries of
the inverse on the pattern of L follow from each other, last column first (Takahashi, Fagan and Chin 1973; Erisman and
Tinney 1975). LANES shifts go through the loops together, and blocks of columns with the same rows (supernodes).

Arrays of lanes: `low` has the entries of L, `inverse` those of D^-1, later of the inverse of A - p I.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from jaxtyping import Complex128, Float64, Int64

from meshshard_prep.features.compiled import compiled
from meshshard_prep.features.lanes import LANES, add_product, copy_row, lane_rows, subtract_dot, subtract_product
from meshshard_prep.features.sparse_factor import BLOCK, Structure, fill_reducing_order, structure_of


class Workspace(NamedTuple):
    """Memory that the steps overwrite, as rows of lanes but for `entry_of`. C is the longest column of L."""

    vector: Float64[np.ndarray, "N 2 8"]
    column: Float64[np.ndarray, "C 2 8"]
    line: Float64[np.ndarray, "lines 2 8"]
    panel: Float64[np.ndarray, "panel 2 8"]
    scaled: Float64[np.ndarray, "scaled 2 8"]
    entry_of: Int64[np.ndarray, " pairs"]

    @classmethod
    def of(cls, structure: Structure) -> "Workspace":
        """Memory enough for one structure."""
        longest = int(np.diff(structure.start).max())
        return cls(
            vector=lane_rows(len(structure.parent)),
            column=lane_rows(longest),
            line=lane_rows(longest + BLOCK),
            panel=lane_rows((longest + BLOCK) * BLOCK),
            scaled=lane_rows(BLOCK**2),
            entry_of=np.empty(longest**2, np.int64),
        )


def inverse_diagonals(
    matrix: sp.csc_matrix,
    shifts: Complex128[np.ndarray, " P"],
    probe: Float64[np.ndarray, " N"],
    image: Float64[np.ndarray, " N"],
) -> tuple[Complex128[np.ndarray, "N P"], Float64[np.ndarray, " P"]]:
    """diag (A - p I)^-1 for every shift p, and the rounding of each factorisation as measured.

    `probe` > 0 is a vector of which A makes `image`, known better than from the rounded A. It is solved for: the
    rounding is the largest relative difference that this makes, infinite where it is no number.
    """
    order, columns, structure = _analysed(matrix)
    known, image = probe[order], image[order]
    low, inverse = lane_rows(len(structure.rows)), lane_rows(len(order))
    work = Workspace.of(structure)
    diagonals = np.empty((len(order), len(shifts)), dtype=complex)
    rounding = np.empty(len(shifts))
    for first in range(0, len(shifts), LANES):
        count = min(LANES, len(shifts) - first)
        batch = np.resize(shifts[first : first + count], LANES)  # the last one repeats its own
        lanes = np.stack([batch.real, batch.imag])
        factorise(columns, lanes, structure, low, inverse, work)
        rounding[first : first + count] = measure(structure, low, inverse, known, image, lanes, work)[:count]
        invert_on_pattern(structure, low, inverse, work)
        diagonals.real[order, first : first + count] = inverse[:, 0, :count]
        diagonals.imag[order, first : first + count] = inverse[:, 1, :count]
    return diagonals, rounding


def count_below(matrix: sp.csc_matrix, bound: float) -> int:
    """How many eigenvalues of A lie below `bound`: the negative pivots of A - bound I (law of inertia)."""
    order, columns, structure = _analysed(matrix)
    low, inverse = lane_rows(len(structure.rows)), lane_rows(len(order))
    shifts = np.stack([np.full(LANES, bound), np.zeros(LANES)])
    factorise(columns, shifts, structure, low, inverse, Workspace.of(structure))
    return int((inverse[:, 0, 0] < 0).sum())


Columns = tuple[np.ndarray, np.ndarray, np.ndarray]
"""A matrix by columns: where each begins in the next two, row numbers, values."""


def _analysed(matrix: sp.csc_matrix) -> tuple[Int64[np.ndarray, " N"], Columns, Structure]:
    """The order of elimination, and the matrix in that order with its structure."""
    order = fill_reducing_order(matrix)
    permuted = sp.csc_matrix(matrix[order][:, order])
    columns = permuted.indptr.astype(np.int64), permuted.indices.astype(np.int32), permuted.data
    return order, columns, structure_of(permuted)


@compiled
def factorise(columns, shifts, structure, low, inverse, work):  # type: ignore[no-untyped-def]
    """L and D^-1 of A - p I, for shifts (2, LANES), into `low` and `inverse`; D is left in `work.vector`.

    Left-looking, block by block (Ng and Peyton 1993): what earlier blocks contribute is gathered in a dense panel,
    with a row for each of the block's columns and for each row below; then the panel is factored.
    """
    start, rows, blocks = structure.start, structure.rows, structure.blocks
    panel, pivot = work.panel, work.vector
    count = len(blocks) - 1
    block_of = np.empty(len(start) - 1, np.int64)
    for block in range(count):
        block_of[blocks[block] : blocks[block + 1]] = block
    waiting = np.full(count, -1, np.int64)  # the first in a block's list of those that contribute to it next
    after = np.full(count, -1, np.int64)  # the one behind it in that list
    used = np.zeros(count, np.int64)  # how many of a block's rows have had their contribution
    panel_row = np.empty(len(start) - 1, np.int64)
    for block in range(count):
        first, end = blocks[block], blocks[block + 1]
        width, below = end - first, start[end - 1]
        length = start[end] - below
        for column in range(first, end):
            panel_row[column] = column - first
        for i in range(length):
            panel_row[rows[below + i]] = width + i
        fill_panel(columns, shifts, first, end, panel_row, panel, width * (width + length))
        earlier = waiting[block]
        while earlier != -1:
            following = after[earlier]
            stop = contribute(structure, earlier, first, end, used[earlier], panel_row, low, pivot, work)
            used[earlier] = stop
            last = blocks[earlier + 1] - 1
            if stop < start[last + 1] - start[last]:
                owner = block_of[rows[start[last] + stop]]
                after[earlier] = waiting[owner]
                waiting[owner] = earlier
            earlier = following
        factor_panel(start, first, width, length, panel, low, inverse, pivot)
        if length > 0:
            owner = block_of[rows[below]]
            after[block] = waiting[owner]
            waiting[owner] = block


@compiled
def fill_panel(columns, shifts, first, end, panel_row, panel, size):  # type: ignore[no-untyped-def]
    """The lower half of A - p I in columns first to end - 1. The panel is row by row, of `size` entries."""
    indptr, indices, data = columns
    width = end - first
    panel[:size] = 0.0
    for column in range(first, end):
        for entry in range(indptr[column], indptr[column + 1]):
            if indices[entry] >= column:
                panel[panel_row[indices[entry]] * width + column - first, 0] = data[entry]
        panel[(column - first) * (width + 1)] -= shifts


@compiled
def contribute(structure, earlier, first, end, begin, panel_row, low, pivot, work):  # type: ignore[no-untyped-def]
    """Subtract L D L^T of block `earlier` from the panel of columns first to end - 1.

    The block's rows before number `begin` are done. Returns how many are done then: those before `end`.
    """
    start, rows = structure.start, structure.rows
    left, right = structure.blocks[earlier], structure.blocks[earlier + 1]
    below = start[right - 1]
    length = start[right] - below
    stop = begin
    while stop < length and rows[below + stop] < end:
        for k in range(left, right):
            target = (stop - begin) * BLOCK + k - left
            work.scaled[target] = 0.0
            add_product(work.scaled, target, low, start[k] + (right - 1 - k) + stop, pivot, k)
        stop += 1
    for i in range(begin, length):
        for k in range(left, right):
            copy_row(work.line, k - left, low, start[k] + (right - 1 - k) + i)
        target = panel_row[rows[below + i]] * (end - first) - first
        for j in range(begin, min(i + 1, stop)):
            scaled = (j - begin) * BLOCK
            subtract_dot(work.panel, target + rows[below + j], work.line, 0, work.scaled, scaled, right - left)
    return stop


@compiled
def factor_panel(start, first, width, length, panel, low, inverse, pivot):  # type: ignore[no-untyped-def]
    """Factor a dense panel, (width + length) x width, and store its columns of L, its D and its D^-1."""
    for c in range(width):
        column = first + c
        diagonal = c * width + c
        copy_row(pivot, column, panel, diagonal)
        for lane in range(LANES):
            x, y = panel[diagonal, 0, lane], panel[diagonal, 1, lane]
            square = x * x + y * y
            inverse[column, 0, lane] = x / square
            inverse[column, 1, lane] = -y / square
        for i in range(c + 1, width + length):
            entry = start[column] + i - c - 1
            low[entry] = 0.0
            add_product(low, entry, panel, i * width + c, inverse, column)
        for d in range(c + 1, width):
            for i in range(d, width + length):
                subtract_product(panel, i * width + d, low, start[column] + i - c - 1, panel, d * width + c)


@compiled
def solve(structure, low, inverse, vector, spare):  # type: ignore[no-untyped-def]
    """Solve L D L^T x = vector, in place, before L is inverted. Row 0 of `spare` is overwritten."""
    start, rows = structure.start, structure.rows
    size = len(start) - 1
    for column in range(size):
        for entry in range(start[column], start[column + 1]):
            subtract_product(vector, rows[entry], low, entry, vector, column)
    for column in range(size - 1, -1, -1):
        spare[0] = 0.0
        add_product(spare, 0, inverse, column, vector, column)
        vector[column] = spare[0]
        for entry in range(start[column], start[column + 1]):
            subtract_product(vector, column, low, entry, vector, rows[entry])


@compiled
def measure(structure, low, inverse, known, image, shifts, work):  # type: ignore[no-untyped-def]
    """Largest relative difference, in each lane, of `known` > 0 and the solution for what A - p I makes of it.

    `image` is A known. Infinite where the difference is no number.
    """
    vector = work.vector
    for row in range(len(known)):
        vector[row] = -known[row] * shifts
        vector[row, 0] += image[row]
    solve(structure, low, inverse, vector, work.line)
    largest = np.zeros(LANES)
    for row in range(len(known)):
        for lane in range(LANES):
            x, y = vector[row, 0, lane] / known[row] - 1, vector[row, 1, lane] / known[row]
            difference = np.sqrt(x * x + y * y)
            if not difference <= largest[lane]:
                largest[lane] = difference if np.isfinite(difference) else np.inf
    return largest


@compiled
def invert_on_pattern(structure, low, inverse, work):  # type: ignore[no-untyped-def]
    """Turn L and D^-1, in place, into the entries of the inverse on the pattern of L and on the diagonal.

    With Z the inverse, R the rows of column j of L, and l that column: Z[R, j] = -Z[R, R] l and
    Z[j, j] = 1 / D[j] - l^T Z[R, j]. All of Z[R, R] is on the pattern, in columns after j. A block of columns has
    its rows below the block in common: their part of Z is looked up once.
    """
    start, rows, blocks = structure.start, structure.rows, structure.blocks
    line, total, entry_of = work.line, work.panel, work.entry_of
    for block in range(len(blocks) - 2, -1, -1):
        first, end = blocks[block], blocks[block + 1]
        below = start[end - 1]
        size = start[end] - below
        locate_entries(start, rows, below, size, entry_of)
        total[: (end - first) * size] = 0.0
        for i in range(size):
            for k in range(size):
                if k == i:
                    copy_row(line, k, inverse, rows[below + i])
                else:
                    copy_row(line, k, low, entry_of[i * size + k])
            for j in range(first, end):
                subtract_dot(total, (j - first) * size + i, line, 0, low, start[j] + (end - 1 - j), size)
        for j in range(end - 1, first - 1, -1):
            finish_column(start, j, end, size, low, inverse, work.column, total, (j - first) * size)


@compiled
def locate_entries(start, rows, below, size, entry_of):  # type: ignore[no-untyped-def]
    """Where the entry of each pair of rows[below : below + size] is: entry_of[i * size + k], symmetric."""
    for i in range(size):
        # every later row is a row of this one's column too, and both rise: walk them together
        entry = start[rows[below + i]]
        for k in range(i + 1, size):
            while rows[entry] != rows[below + k]:
                entry += 1
            entry_of[i * size + k] = entry
            entry_of[k * size + i] = entry


@compiled
def finish_column(start, j, end, size, low, inverse, column, total, part):  # type: ignore[no-untyped-def]
    """Z in column j, of which total[part : part + size] has what the rows below the block contribute there.

    The other rows of the column are those of the block, j + 1 to end - 1; their columns of Z are done.
    """
    inside, begin = end - 1 - j, start[j]
    column[: inside + size] = low[begin : begin + inside + size]
    low[begin : begin + inside] = 0.0
    for i in range(inside):
        other = j + 1 + i
        others_below = start[other] + end - 1 - other
        subtract_product(low, begin + i, inverse, other, column, i)
        for k in range(i + 1, inside):
            subtract_product(low, begin + i, low, start[other] + k - i - 1, column, k)
            subtract_product(low, begin + k, low, start[other] + k - i - 1, column, i)
        subtract_dot(low, begin + i, low, others_below, column, inside, size)
        for k in range(size):
            subtract_product(total, part + k, low, others_below + k, column, i)
    low[begin + inside : begin + inside + size] = total[part : part + size]
    subtract_dot(inverse, j, low, begin, column, 0, inside + size)
