"""The structure of a sparse Cholesky-like factor: ordering, elimination tree, and the pattern of L.

Matrices are sparse with a symmetric pattern, given by columns (`indptr`, `indices`). L has a unit diagonal that is
not stored; the rows of its column j below the diagonal are rows[start[j] : start[j + 1]], rising.
"""

from typing import NamedTuple

import numpy as np
import pymetis
import scipy.sparse as sp
from jaxtyping import Int32, Int64
from scipy.sparse.linalg import spilu

from meshshard_prep.features.compiled import compiled


class Structure(NamedTuple):
    """`parent` (N,) in the elimination tree, -1 at roots; `start` (N+1,) and `rows` (entries,): the pattern of L.

    `blocks` (B+1,): columns blocks[b] to blocks[b + 1] have the same rows below the block, and are worked on as one.
    """

    parent: Int64[np.ndarray, " N"]
    start: Int64[np.ndarray, " N+1"]
    rows: Int32[np.ndarray, " entries"]
    blocks: Int64[np.ndarray, " edges"]


BLOCK = 8
"""Most columns of a block: their part of L should stay in the cache while the inverse passes by."""

DISSECTED_SIZE = 2000
"""From this many vertices on nested dissection saves more time than it takes: half the work at 9000 vertices."""


def fill_reducing_order(matrix: sp.csc_matrix) -> Int64[np.ndarray, " N"]:
    """Order of elimination that keeps L sparse: new -> old. Only the pattern is looked at."""
    return minimum_degree(matrix) if matrix.shape[0] < DISSECTED_SIZE else nested_dissection(matrix)


def nested_dissection(matrix: sp.csc_matrix) -> Int64[np.ndarray, " N"]:
    """Order that eliminates the halves of the graph before what separates them, and so on (METIS)."""
    off_diagonal = sp.csc_matrix(matrix, copy=True)
    off_diagonal.data = np.ones(matrix.nnz)
    off_diagonal.setdiag(0)
    off_diagonal.eliminate_zeros()
    graph = pymetis.CSRAdjacency(off_diagonal.indptr, off_diagonal.indices)
    return np.array(pymetis.nested_dissection(graph)[0], dtype=np.int64)


def minimum_degree(matrix: sp.csc_matrix) -> Int64[np.ndarray, " N"]:
    """Order by minimum degree (Liu 1985). SuperLU gives it with a factorisation: this is one of ones with a heavy
    diagonal, all of it dropped."""
    ones = np.ones(matrix.nnz)
    pattern = sp.csc_matrix((ones, matrix.indices, matrix.indptr), shape=matrix.shape)
    pattern.setdiag(np.diff(matrix.indptr) + 1.0)
    symmetric = {"SymmetricMode": True}
    factor = spilu(pattern, drop_tol=1.0, fill_factor=1.0, permc_spec="MMD_AT_PLUS_A", options=symmetric)
    return np.argsort(factor.perm_c)


def structure_of(matrix: sp.csc_matrix) -> Structure:
    """The structure of L of a matrix, eliminated in the order in which it is given."""
    indptr, indices = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int32)
    parent, start = elimination_tree(indptr, indices)
    rows = pattern_of_factor(indptr, indices, parent, start)
    return Structure(parent, start, rows, blocks_of(parent, start))


def blocks_of(parent: Int64[np.ndarray, " N"], start: Int64[np.ndarray, " N+1"]) -> Int64[np.ndarray, " edges"]:
    """(B+1,): where runs of at most BLOCK columns begin in which each has the next one's rows, and its number."""
    columns, length = np.arange(len(parent)), np.diff(start)
    nested = np.append(False, (parent[:-1] == columns[1:]) & (length[:-1] == length[1:] + 1))
    run_start = np.maximum.accumulate(np.where(nested, 0, columns))
    return np.append(np.flatnonzero((columns - run_start) % BLOCK == 0), len(parent))


@compiled
def elimination_tree(indptr, indices):  # type: ignore[no-untyped-def]
    """Parent of every column (N,), -1 at roots, and where the columns of L start (N+1,). Liu 1990.

    The rows of L have the pattern of subtrees: climbing from the entries of a row of A to it finds its own.
    """
    parent = np.full(len(indptr) - 1, -1, np.int64)
    count = np.zeros(len(indptr), np.int64)
    climb(indptr, indices, parent, count[1:], np.empty(0, np.int32))
    return parent, np.cumsum(count)


@compiled
def pattern_of_factor(indptr, indices, parent, start):  # type: ignore[no-untyped-def]
    """Row numbers of L below the diagonal (entries,), column by column, rising."""
    rows = np.empty(start[-1], np.int32)
    climb(indptr, indices, parent, start[:-1].copy(), rows)
    return rows


@compiled
def climb(indptr, indices, parent, used, rows):  # type: ignore[no-untyped-def]
    """Visit the entries of L row by row: set the parents that are -1, and count each column's entries in `used`.

    Where `rows` is not empty, each entry's row number is put there at its column's count.
    """
    size = len(indptr) - 1
    seen = np.full(size, -1, np.int64)
    for row in range(size):
        seen[row] = row
        for entry in range(indptr[row], indptr[row + 1]):
            column = indices[entry]
            while column < row and seen[column] != row:
                if parent[column] == -1:
                    parent[column] = row
                if len(rows) > 0:
                    rows[used[column]] = row
                used[column] += 1
                seen[column] = row
                column = parent[column]
