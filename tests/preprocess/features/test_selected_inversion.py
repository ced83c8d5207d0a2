import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from shapes import FAMILY, sphere

import meshshard_prep
from meshshard.recipe import RECIPES
from meshshard_prep.features.compiled import compiled
from meshshard_prep.features.hks import heat_kernel_signature
from meshshard_prep.features.lanes import LANES, add_product, copy_row, lane_rows, subtract_dot, subtract_product
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.features.selected_inversion import (
    Workspace,
    count_below,
    factorise,
    inverse_diagonals,
    invert_on_pattern,
    solve,
)
from meshshard_prep.features.sparse_factor import (
    BLOCK,
    fill_reducing_order,
    minimum_degree,
    nested_dissection,
    structure_of,
)

SHIFTS = np.array([3 + 1j, 40 + 30j, -5 + 2j])


def random_matrix(size, seed, density=0.1):
    """Sparse, symmetric, indefinite; possibly in pieces."""
    rng = np.random.default_rng(seed)
    half = sp.random_array((size, size), density=density, rng=rng, data_sampler=rng.standard_normal)
    return sp.csc_matrix(half + half.T + sp.diags_array(rng.standard_normal(size)))


def mesh_matrix(name):
    stiffness, mass = laplacian(*FAMILY[name], RECIPES["paper"])
    scaling = sp.diags_array(1 / np.sqrt(mass))
    return sp.csc_matrix(scaling @ stiffness @ scaling)


MATRICES = {
    "one": sp.csc_matrix(np.array([[2.0]])),
    "diagonal": sp.csc_matrix(np.diag([1.0, 2.0, 3.0])),
    "dense": random_matrix(12, 0, density=0.9),
    **{f"random-{size}": random_matrix(size, size) for size in (2, 5, 30, 80)},
    **{name: mesh_matrix(name) for name in FAMILY},
}


def factored(matrix, shifts):
    """Dense L and D of every lane, and what the next steps take."""
    structure = structure_of(matrix)
    size = matrix.shape[0]
    low, inverse, work = lane_rows(len(structure.rows)), lane_rows(size), Workspace.of(structure)
    lanes = np.stack([np.resize(shifts, LANES).real, np.resize(shifts, LANES).imag])
    columns = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int32), matrix.data
    factorise(columns, lanes, structure, low, inverse, work)
    return structure, low, inverse, work


@pytest.mark.parametrize(("product", "sign"), [(add_product, 1), (subtract_product, -1)])
def test_products_of_lanes(product, sign):
    rng = np.random.default_rng(0)
    target, a, b = (lane_rows(3) for _ in range(3))
    for array in (target, a, b):
        assert array.ctypes.data % 64 == 0
        array[:] = rng.standard_normal(array.shape)
    as_complex = [array[:, 0] + 1j * array[:, 1] for array in (target, a, b)]

    @compiled
    def run(target, a, b):
        product(target, 1, a, 2, b, 0)

    run(target, a, b)
    as_complex[0][1] += sign * as_complex[1][2] * as_complex[2][0]
    np.testing.assert_allclose(target[:, 0] + 1j * target[:, 1], as_complex[0], rtol=1e-15)


@pytest.mark.parametrize("length", [0, 1, 3])
def test_dot_and_copy_of_lanes(length):
    rng = np.random.default_rng(0)
    target, a, b = (lane_rows(5) for _ in range(3))
    for array in (target, a, b):
        array[:] = rng.standard_normal(array.shape)
    x, y, z = (array[:, 0] + 1j * array[:, 1] for array in (target, a, b))

    @compiled
    def run(target, a, b, length):
        subtract_dot(target, 1, a, 2, b, 0, length)
        copy_row(target, 4, b, 3)

    run(target, a, b, length)
    x[1] -= (y[2 : 2 + length] * z[:length]).sum(axis=0)
    x[4] = z[3]
    np.testing.assert_allclose(target[:, 0] + 1j * target[:, 1], x, rtol=1e-14)


@pytest.mark.parametrize("name", MATRICES)
def test_columns_of_a_block_share_their_rows(name):
    structure = structure_of(MATRICES[name])
    assert structure.blocks[0] == 0
    assert structure.blocks[-1] == MATRICES[name].shape[0]
    for first, end in pairwise(structure.blocks):
        assert 1 <= end - first <= BLOCK
        last = structure.rows[structure.start[end - 1] : structure.start[end]]
        for column in range(first, end):
            rows = structure.rows[structure.start[column] : structure.start[column + 1]]
            np.testing.assert_array_equal(rows, [*range(column + 1, end), *last])


@pytest.mark.parametrize("name", MATRICES)
def test_pattern_is_that_of_a_dense_factor(name):
    matrix = MATRICES[name]
    size = matrix.shape[0]
    structure = structure_of(matrix)
    positive = abs(matrix).toarray() * np.random.default_rng(1).uniform(1, 2, matrix.shape)
    positive += positive.T + np.diag(10 * positive.sum(axis=1) + 1)  # no entry of its factor cancels
    factor = np.linalg.cholesky(positive)
    for column in range(size):
        rows = structure.rows[structure.start[column] : structure.start[column + 1]]
        below = np.flatnonzero(np.abs(factor[:, column]) > 1e-200)
        np.testing.assert_array_equal(rows, below[below > column])
        assert structure.parent[column] == (rows[0] if len(rows) else -1)


@pytest.mark.parametrize("name", MATRICES)
def test_factor_multiplies_back(name):
    matrix = MATRICES[name]
    structure, low, inverse, work = factored(matrix, SHIFTS)
    np.testing.assert_allclose(work.vector[:, 0] * inverse[:, 0] - work.vector[:, 1] * inverse[:, 1], 1)
    for lane, shift in enumerate(SHIFTS):
        lower = np.eye(matrix.shape[0], dtype=complex)
        for column in range(len(lower)):
            entries = slice(structure.start[column], structure.start[column + 1])
            lower[structure.rows[entries], column] = low[entries, 0, lane] + 1j * low[entries, 1, lane]
        diagonal = 1 / (inverse[:, 0, lane] + 1j * inverse[:, 1, lane])
        expected = matrix.toarray() - shift * np.eye(len(lower))
        np.testing.assert_allclose(lower * diagonal @ lower.T, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("name", MATRICES)
def test_solves_and_inverts_on_the_pattern(name):
    matrix = MATRICES[name]
    size = matrix.shape[0]
    structure, low, inverse, work = factored(matrix, SHIFTS)
    rng = np.random.default_rng(2)
    vector = lane_rows(size)
    vector[:] = rng.standard_normal(vector.shape)
    right = vector[:, 0] + 1j * vector[:, 1]
    solve(structure, low, inverse, vector, work.line)
    invert_on_pattern(structure, low, inverse, work)
    for lane, shift in enumerate(SHIFTS):
        expected = np.linalg.inv(matrix.toarray() - shift * np.eye(size))
        np.testing.assert_allclose(
            vector[:, 0, lane] + 1j * vector[:, 1, lane], expected @ right[:, lane], atol=1e-11
        )
        np.testing.assert_allclose(inverse[:, 0, lane] + 1j * inverse[:, 1, lane], np.diag(expected), atol=1e-11)
        columns = np.repeat(np.arange(size), np.diff(structure.start))
        on_pattern = expected[structure.rows, columns]
        np.testing.assert_allclose(low[:, 0, lane] + 1j * low[:, 1, lane], on_pattern, atol=1e-11)


@pytest.mark.parametrize("count", [1, LANES - 1, LANES, LANES + 1, 3 * LANES])
def test_any_number_of_shifts(count):
    matrix = MATRICES["bumpy"]
    shifts = np.linspace(1, 50, count) + 1j * np.linspace(2, 9, count)
    probe = np.random.default_rng(3).uniform(0.5, 2, matrix.shape[0])
    diagonals, rounding = inverse_diagonals(matrix, shifts, probe, matrix @ probe)
    for column, shift in enumerate(shifts):
        expected = np.diag(np.linalg.inv(matrix.toarray() - shift * np.eye(len(probe))))
        np.testing.assert_allclose(diagonals[:, column], expected, rtol=1e-11)
    assert rounding.shape == (count,)
    assert (rounding < 1e-12).all()


def test_rounding_is_seen():
    """A matrix with entries of 1e12 that should cancel, and do not to one unit in their last place."""
    matrix = sp.csc_matrix(np.array([[1e12, -1e12], [-1e12, 1e12 * (1 + 2.3e-16)]]))
    _, rounding = inverse_diagonals(matrix, np.array([0.1 + 0.1j]), np.ones(2), np.zeros(2))
    assert 1e-6 < rounding[0] < 1e-2


def test_no_number_is_infinite_rounding():
    matrix = sp.csc_matrix(np.diag([1.0, np.nan]))
    _, rounding = inverse_diagonals(matrix, np.array([0.1 + 0.1j]), np.ones(2), np.ones(2))
    assert rounding[0] == np.inf


def test_changed_sources_are_compiled_anew(tmp_path):
    """Also where the change is in a file that the compiled function only calls."""
    package = tmp_path / "meshshard_prep" / "features"
    package.mkdir(parents=True)
    source = Path(meshshard_prep.__file__).parent / "features"
    (package / "compiled.py").write_bytes((source / "compiled.py").read_bytes())
    for folder in (package, package.parent):
        (folder / "__init__.py").write_text("")
    (package / "sparse_factor.py").write_text(
        "from meshshard_prep.features.compiled import compiled\n"
        "from meshshard_prep.features.lanes import STEP\n"
        "@compiled\ndef add(x):\n    return x + STEP\n"
    )
    results = []
    for step in (1, 2):
        (package / "lanes.py").write_text(f"STEP = {step}\n")
        script = (
            "from meshshard_prep.features.sparse_factor import add;print(add(0), sum(add.stats.cache_hits.values()))"
        )
        environment = os.environ | {"PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
        words = [sys.executable, "-c", script]
        for _ in range(2):
            done = subprocess.run(words, capture_output=True, text=True, env=environment, check=True, cwd=tmp_path)
            results.append(done.stdout.split())
    assert results == [["1", "0"], ["1", "1"], ["2", "0"], ["2", "1"]]  # value, and whether the cache was hit


@pytest.mark.parametrize("order_of", [minimum_degree, nested_dissection])
@pytest.mark.parametrize("name", MATRICES)
def test_order_is_a_permutation(order_of, name):
    matrix = MATRICES[name]
    order = order_of(matrix)
    assert sorted(order) == list(range(matrix.shape[0]))
    np.testing.assert_array_equal(order_of(matrix), order)


@pytest.mark.parametrize("level", [3, 5])
def test_order_saves_fill_on_either_side_of_the_threshold(level):
    stiffness, _ = laplacian(*sphere(level), RECIPES["paper"])
    order = fill_reducing_order(stiffness)
    assert sorted(order) == list(range(stiffness.shape[0]))
    shuffled = np.random.default_rng(0).permutation(len(order))
    fill = [len(structure_of(sp.csc_matrix(stiffness[o][:, o])).rows) for o in (order, shuffled)]
    assert fill[0] < fill[1] / 2


def test_a_mesh_beyond_the_threshold():
    """4098 vertices, by nested dissection: the unit sphere's closed form again."""
    stiffness, mass = laplacian(*sphere(5), RECIPES["paper"])
    found = heat_kernel_signature(stiffness, mass, (0.5, 1.0))
    degree = np.arange(50)
    exact = ((2 * degree + 1) / (4 * np.pi)) @ np.exp(-np.outer(degree * (degree + 1), [0.5, 1.0]))
    np.testing.assert_allclose(found.values, np.broadcast_to(exact, found.values.shape), rtol=2e-3)


def test_order_looks_at_the_pattern_alone():
    matrix = MATRICES["random-80"]
    other = matrix.copy()
    other.data = np.random.default_rng(0).uniform(1e-300, 1e300, other.nnz)
    for order_of in (minimum_degree, nested_dissection):
        np.testing.assert_array_equal(order_of(matrix), order_of(other))


@pytest.mark.parametrize("name", [n for n in MATRICES if n != "one"])
def test_inertia(name):
    matrix = MATRICES[name]
    values = scipy.linalg.eigvalsh(matrix.toarray())
    widest = int(np.argmax(np.diff(values)))
    assert count_below(matrix, (values[widest] + values[widest + 1]) / 2) == widest + 1


@pytest.mark.parametrize("writable", [True, False])
def test_compiles_with_and_without_a_cache(tmp_path, writable):
    """An installation that cannot be written to, for a user without a home."""
    package = tmp_path / "meshshard_prep"
    (package / "features").mkdir(parents=True)
    source = Path(meshshard_prep.__file__).parent / "features"
    for name in ("compiled.py", "sparse_factor.py"):
        (package / "features" / name).write_bytes((source / name).read_bytes())
    for folder in (package, package / "features"):
        (folder / "__init__.py").write_text("")
    home = tmp_path / "home"
    if not writable:
        (package / "features" / "__pycache__").write_text("no folder")
        home.write_text("no folder either")
    script = (
        "import numpy as np; from meshshard_prep.features.sparse_factor import elimination_tree as tree;"
        "print(tree(np.array([0, 2, 4]), np.array([0, 1, 0, 1], dtype='i4'))[0].tolist())"
    )
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG"))}
    environment = kept | {"PYTHONPATH": str(tmp_path), "HOME": str(home), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=environment, cwd=tmp_path, check=False
    )
    assert done.stdout.strip() == "[1, -1]", done.stderr
    assert any(tmp_path.rglob("*.nbi")) == writable
