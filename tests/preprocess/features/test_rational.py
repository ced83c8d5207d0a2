import itertools

import numpy as np
import pytest

from meshshard.recipe import RECIPES
from meshshard_prep.features import stored_poles
from meshshard_prep.features.rational import fit_exponential, poles_on_hyperbola
from meshshard_prep.features.stored_poles import COUNTS, PACKAGE, rational_exponential

PAPER = RECIPES["paper"].times
NAMED = {recipe.times for recipe in RECIPES.values()}
"""Of all named recipes; those that are alike once."""
FINE = {
    "paper": PAPER,
    "one": (0.1,),
    "linear": tuple(np.linspace(0.1, 1, 10)),
    "wide": tuple(np.geomspace(1e-4, 1, 5)),
    "long": tuple(np.geomspace(100, 1e4, 4)),
}


def half_line(times):
    """Twenty times as fine as the fit's, and reaching further."""
    return np.append(0, np.geomspace(1e-5 / max(times), 1e8 / min(times), 30_000))


@pytest.mark.parametrize("name", FINE)
def test_error_is_below_its_majorant_between_the_samples_too(name):
    times = np.array(FINE[name])
    found = fit_exponential(times, 16)
    x = half_line(times)
    cauchy = 1 / (x[:, None] - found.poles)
    error = np.abs((cauchy @ found.weights.T).real - np.exp(-np.outer(x, times)))
    majorant = cauchy.imag @ found.majorants.T
    assert (majorant > 0).all()
    rounding = 4e-16 * np.abs(cauchy) @ np.abs(found.weights).T
    assert ((error - rounding) / majorant).max() <= 1
    assert error.max() <= 1.01 * found.uniform_error


@pytest.mark.parametrize("name", FINE)
def test_more_poles_are_better_down_to_rounding(name):
    errors = [fit_exponential(np.array(FINE[name]), count).error for count in COUNTS]
    assert all(after < before / 2 or after < 1e-7 for before, after in itertools.pairwise(errors))
    assert errors[-1] < 1e-6


def test_promised_error_is_that_of_evenly_spread_eigenvalues():
    """Weyl: with constant density d the sum over eigenvalues of exp(-t x) is d / t."""
    found = rational_exponential(PAPER, 16)
    x = np.append(0, np.geomspace(1e-4, 1e8, 20_000))
    majorant = (1 / (x[:, None] - found.poles)).imag @ found.majorants.T
    relative = np.trapezoid(majorant, x, axis=0) * np.array(PAPER)
    assert relative.max() == pytest.approx(found.error, rel=0.02)


def test_poles_are_above_the_real_axis_and_on_a_hyperbola():
    poles = poles_on_hyperbola(8, 2.0, 0.5, np.log(0.4), 1.0)
    assert (poles.imag > 0).all()
    size = np.exp(2.0)
    real, imaginary = poles.real / size + 1, poles.imag / size
    np.testing.assert_allclose((real / np.sin(0.5)) ** 2 - (imaginary / np.cos(0.5)) ** 2, 1, rtol=1e-12)


@pytest.mark.parametrize("times", NAMED, ids=lambda times: f"{len(times)} times")
@pytest.mark.parametrize("count", COUNTS)
def test_the_package_brings_the_named_recipes_sums(times, count, monkeypatch):
    monkeypatch.setattr(stored_poles, "fit_exponential", lambda *_: pytest.fail("computed, not read"))
    rational_exponential.cache_clear()
    stored = rational_exponential(times, count)
    again = fit_exponential(np.array(times), count)
    assert stored.error == pytest.approx(again.error, rel=0.5, abs=1e-7)  # a search: last digits lead elsewhere
    assert len(list(PACKAGE.glob(f"*-{count}.npz"))) == len(NAMED)


def test_other_sums_are_cached(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_poles, "cache_folder", lambda: tmp_path / "cache")
    rational_exponential.cache_clear()
    times = (0.25, 0.5)
    first = rational_exponential(times, 8)
    rational_exponential.cache_clear()
    monkeypatch.setattr(stored_poles, "fit_exponential", lambda *_: pytest.fail("computed again"))
    second = rational_exponential(times, 8)
    np.testing.assert_array_equal(first.weights, second.weights)
    assert (first.error, first.uniform_error) == (second.error, second.uniform_error)
    assert [path.suffix for path in (tmp_path / "cache").iterdir()] == [".npz"]


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 broken", b"no archive"])
def test_a_damaged_cache_is_written_again(tmp_path, monkeypatch, content):
    monkeypatch.setattr(stored_poles, "cache_folder", lambda: tmp_path)
    for _ in range(2):
        rational_exponential.cache_clear()
        assert rational_exponential((0.375,), 8).error < 1e-6
        (file,) = tmp_path.iterdir()
        whole, _ = file.read_bytes(), file.write_bytes(content)
    assert len(whole) > 1000
    rational_exponential.cache_clear()


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(stored_poles, "cache_folder", lambda: tmp_path / "file" / "cache")
    rational_exponential.cache_clear()
    assert rational_exponential((0.125,), 8).error < 1e-6
    rational_exponential.cache_clear()
