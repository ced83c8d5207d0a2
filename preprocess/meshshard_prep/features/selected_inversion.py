"""The diagonals of (A - p I)^-1 for several complex shifts p, without the inverses.

A is sparse, real and symmetric, p is no eigenvalue. One ordering and one structure serve all shifts. Each A - p I is
factored into L D L^T (complex symmetric, no pivoting: its real or its imaginary part is definite), and the entries of
the inverse on the pattern of L follow from each other, last column first (Takahashi, Fagan and Chin 1973; Erisman and
Tinney 1975). LANES shifts go through the loops together.
"""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Complex128, Float64

from meshshard_prep.features.compiled import compiled
from meshshard_prep.features.lanes import LANES, add_product, copy_row, lane_rows, subtract_dot, subtract_product
from meshshard_prep.features.sparse_factor import BLOCK, fill_reducing_order, structure_of


def inverse_diagonals(
    matrix: sp.csc_matrix, shifts: Complex128[np.ndarray, " P"], probe: Float64[np.ndarray, " N"]
) -> tuple[Complex128[np.ndarray, "N P"], Float64[np.ndarray, " P"]]:
    """diag (A - p I)^-1 for every shift p, and the rounding of each factorisation as measured.

    `probe` > 0 is a vector whose image under A - p I is computed and solved for again: the rounding is the largest
    relative difference that this makes.
    """
    order = fill_reducing_order(matrix)
    permuted = sp.csc_matrix(matrix[order][:, order])
    indptr, indices, data = permuted.indptr.astype(np.int64), permuted.indices.astype(np.int32), permuted.data
    structure = structure_of(permuted)
    known = probe[order]
    image = permuted @ known
    start, rows = structure.start, structure.rows
    low, inverse, work = lane_rows(len(rows)), lane_rows(len(order)), lane_rows(len(order))
    longest = int(np.diff(start).max())
    column, line, total = lane_rows(longest), lane_rows(longest), lane_rows(BLOCK * longest + 1)
    entry_of = np.empty(longest**2, np.int64)
    diagonals = np.empty((len(order), len(shifts)), dtype=complex)
    rounding = np.empty(len(shifts))
    for first in range(0, len(shifts), LANES):
        count = min(LANES, len(shifts) - first)
        batch = np.resize(shifts[first : first + count], LANES)  # the last one repeats its own
        lanes = np.stack([batch.real, batch.imag])
        factorise(indptr, indices, data, lanes, structure.parent, start, rows, low, inverse, work)
        rounding[first : first + count] = measure(start, rows, low, inverse, known, image, lanes, work, total)[:count]
        invert_on_pattern(start, rows, structure.blocks, low, inverse, column, total, line, entry_of)
        diagonals.real[order, first : first + count] = inverse[:, 0, :count]
        diagonals.imag[order, first : first + count] = inverse[:, 1, :count]
    return diagonals, rounding


@compiled
def factorise(indptr, indices, data, shifts, parent, start, rows, low, inverse, work):  # type: ignore[no-untyped-def]
    """L into `low` (entries, lanes) and D^-1 into `inverse` (N, lanes), for A by columns minus shifts (2, LANES).

    Row by row: a row of L solves a triangular system whose pattern is a subtree of the elimination tree. `work`
    (N, lanes) is overwritten.
    """
    size = len(indptr) - 1
    free = start[:size].copy()
    seen = np.full(size, -1, np.int64)
    climbed = np.empty(size, np.int64)
    subtree = np.empty(size, np.int64)
    work[:] = 0.0
    for row in range(size):
        inverse[row] = -shifts
        first = size
        seen[row] = row
        for entry in range(indptr[row], indptr[row + 1]):
            column = indices[entry]
            if column == row:
                inverse[row, 0] += data[entry]
            if column >= row:
                continue
            work[column, 0] = data[entry]
            length = 0
            while seen[column] != row:
                climbed[length] = column
                length += 1
                seen[column] = row
                column = parent[column]
            first -= length
            subtree[first : first + length] = climbed[:length]
        for column in subtree[first:]:
            last = free[column]
            for entry in range(start[column], last):
                subtract_product(work, rows[entry], low, entry, work, column)
            low[last] = 0.0
            add_product(low, last, work, column, inverse, column)
            subtract_product(inverse, row, work, column, low, last)
            work[column] = 0.0
            free[column] = last + 1
        for lane in range(LANES):
            x, y = inverse[row, 0, lane], inverse[row, 1, lane]
            square = x * x + y * y
            inverse[row, 0, lane] = x / square
            inverse[row, 1, lane] = -y / square


@compiled
def solve(start, rows, low, inverse, vector, spare):  # type: ignore[no-untyped-def]
    """Solve L D L^T x = vector, in place, before L is inverted. `spare` is one row of lanes, overwritten."""
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
def measure(start, rows, low, inverse, known, image, shifts, work, spare):  # type: ignore[no-untyped-def]
    """Largest relative difference, in each lane, of `known` > 0 and the solution for what A - p I makes of it.

    `image` is A known. `work` (N, lanes) and `spare` are overwritten.
    """
    for row in range(len(known)):
        work[row] = -known[row] * shifts
        work[row, 0] += image[row]
    solve(start, rows, low, inverse, work, spare)
    largest = np.zeros(LANES)
    for row in range(len(known)):
        for lane in range(LANES):
            x, y = work[row, 0, lane] / known[row] - 1, work[row, 1, lane] / known[row]
            difference = np.sqrt(x * x + y * y)
            if not difference <= largest[lane]:
                largest[lane] = difference if np.isfinite(difference) else np.inf
    return largest


@compiled
def invert_on_pattern(start, rows, blocks, low, inverse, column, total, line, entry_of):  # type: ignore[no-untyped-def]
    """Turn L and D^-1, in place, into the entries of the inverse on the pattern of L and on the diagonal.

    With Z the inverse, R the rows of column j of L, and l that column: Z[R, j] = -Z[R, R] l and
    Z[j, j] = 1 / D[j] - l^T Z[R, j]. All of Z[R, R] is on the pattern, in columns after j. A block of columns has
    its rows below the block in common: their part of Z is looked up once. `column` and `line` (longest column,
    lanes), `total` (BLOCK times that) and `entry_of` (that squared) are overwritten.
    """
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
            finish_column(start, j, end, size, low, inverse, column, total, (j - first) * size)


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


def count_below(matrix: sp.csc_matrix, bound: float) -> int:
    """How many eigenvalues of A lie below `bound`: the negative pivots of A - bound I (law of inertia)."""
    order = fill_reducing_order(matrix)
    permuted = sp.csc_matrix(matrix[order][:, order])
    indptr, indices, data = permuted.indptr.astype(np.int64), permuted.indices.astype(np.int32), permuted.data
    structure = structure_of(permuted)
    low, inverse, work = lane_rows(len(structure.rows)), lane_rows(len(order)), lane_rows(len(order))
    shifts = np.stack([np.full(LANES, bound), np.zeros(LANES)])
    factorise(indptr, indices, data, shifts, structure.parent, structure.start, structure.rows, low, inverse, work)
    return int((inverse[:, 0, 0] < 0).sum())
