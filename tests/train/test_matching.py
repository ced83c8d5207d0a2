from dataclasses import replace

import numpy as np
import pytest
import torch
from matched import matched_dataset, matched_sample
from samples import PAPER, write_dataset

from meshshard import open_dataset
from meshshard_train import checkpoint, matching
from meshshard_train.functional_map import true_map
from meshshard_train.loading import Loading, Meshes
from meshshard_train.matching import (
    THRESHOLDS,
    GeodesicErrors,
    errors_of,
    evaluate_matching,
    evaluate_true_maps,
)
from meshshard_train.pairs import evaluated_pairs
from meshshard_train.recipes import paper
from meshshard_train.spectra import spectrum_of
from meshshard_train.team import Team

CPU = torch.device("cpu")
CONFIG = paper("correspondence", eigenfunctions=10, precision="fp32")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return open_dataset(matched_dataset(tmp_path_factory.mktemp("matched")))


@pytest.fixture(scope="module")
def meshes(dataset):
    return Meshes(dataset, CONFIG, CPU, Loading())


def spectra_of(dataset, numbers=range(7)):
    return {number: spectrum_of(dataset[number], CONFIG) for number in numbers}


def test_errors_are_added_and_divided_once():
    rng = np.random.default_rng(0)
    errors = [rng.random(size) * 0.4 for size in (5, 30, 1)]
    parts = [GeodesicErrors(), GeodesicErrors()]
    parts[0].add(errors[0])
    parts[0].add(errors[1])
    parts[1].add(errors[2])
    parts[0].merge(parts[1])
    whole = np.concatenate(errors)
    assert parts[0].mean() == pytest.approx(whole.mean())
    np.testing.assert_allclose(parts[0].curve(), [(whole <= at).mean() for at in THRESHOLDS])
    assert np.isnan(GeodesicErrors().mean())


def test_a_point_right_on_a_threshold_is_below_it():
    errors = GeodesicErrors()
    errors.add(np.array([0.0, THRESHOLDS[10], 1.0]))
    assert errors.curve()[0] == pytest.approx(1 / 3)
    assert errors.curve()[9] == pytest.approx(1 / 3)
    assert errors.curve()[10] == errors.curve()[-1] == pytest.approx(2 / 3)


def test_the_identity_of_a_mesh_has_no_error(dataset):
    spectra = spectra_of(dataset)
    found = errors_of(lambda *_: torch.eye(10, dtype=torch.float64), dataset, spectra, {2: [2], 3: [3]})
    assert found.mean() == 0
    assert found.curve()[0] == 1
    assert found.count == 2 * len(dataset[0].correspondence)


def test_the_true_maps_are_near_and_more_eigenfunctions_bring_them_nearer(tmp_path):
    dataset = open_dataset(matched_dataset(tmp_path, spectrum=16, splits=("test",) * 4))
    means = []
    for count in (3, 8, 16):
        config = paper("correspondence", eigenfunctions=count)
        means.append(evaluate_true_maps(Meshes(dataset, config, CPU, Loading()), range(4)).mean())
    assert means[0] > means[1] > means[2]
    assert means[2] < 0.05


def test_errors_are_distances_over_the_root_of_the_area(dataset):
    """Everything sent to one vertex: its distances to all others, by an independent road."""
    spectra, sample = spectra_of(dataset), dataset[1]
    row = spectra[1].eigenfunctions_VK[7].double()
    second = spectra[3].eigenfunctions_VK.double()
    constant = second[:, 0].mean()  # Phi_2 C has the row of vertex 7 everywhere
    collapse = torch.zeros(10, 10, dtype=torch.float64)
    collapse[0] = row / constant
    found = errors_of(lambda *_: collapse, dataset, spectra, {1: [3]})
    corners = sample.vertices[sample.faces].astype("f8")
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1).sum() / 2
    lengths = matching.distances(sample.vertices, sample.faces, np.array([7]))[0]
    assert found.mean() == pytest.approx(lengths[sample.correspondence].mean() / np.sqrt(area), rel=1e-5)


def test_unknown_points_are_not_counted(tmp_path):
    known = matched_sample(0).correspondence.copy()
    known[:20] = -1
    samples = [matched_sample(0, correspondence=known), matched_sample(1)]
    folder = write_dataset(
        tmp_path, samples, ["test"] * 2, task="correspondence", classes=(), recipe=replace(PAPER, spectrum=10)
    )
    dataset = open_dataset(folder)
    found = evaluate_true_maps(Meshes(dataset, CONFIG, CPU, Loading()), [0, 1])
    assert found.count == 2 * (len(known) - 20)


def test_of_many_points_some_are_drawn(dataset, monkeypatch):
    monkeypatch.setattr(matching, "POINTS", 7)
    matching._lengths.cache_clear()
    spectra = spectra_of(dataset)
    found = errors_of(lambda a, b: true_map(spectra[a], spectra[b]), dataset, spectra, evaluated_pairs(range(4)))
    matching._lengths.cache_clear()
    assert found.count == 7 * 12


def test_a_team_finds_what_one_finds(meshes):
    """Each process its share of the first meshes; gathered, they are all."""
    network = checkpoint.network_for(CONFIG, 16, 0)
    whole = evaluate_matching(network, meshes, range(5))

    class Half(Team):
        def gather(self, value):
            return [value]

    halves = [evaluate_matching(network, meshes, range(5), Half(rank, 2)) for rank in range(2)]
    halves[0].merge(halves[1])
    assert halves[0].count == whole.count == 20 * len(meshes.dataset[0].correspondence)
    assert halves[0].mean() == pytest.approx(whole.mean(), rel=1e-12)


def test_the_networks_maps_are_those_of_its_coordinates(dataset, meshes):
    """A network that knows the correspondence, and gives at each vertex functions of the template's vertex there."""
    undeformed = spectrum_of(dataset[0], CONFIG)
    functions = undeformed.eigenfunctions_VK[undeformed.points_M]

    numbers = [0, 2, 4]

    def know(module, inputs, outputs):  # noqa: ARG001
        rows = []
        for number, count in zip(numbers, torch.bincount(inputs[1]).tolist(), strict=True):
            place = torch.tensor(dataset[number].correspondence).long()
            rows.append(torch.zeros(count, 10).index_copy(0, place, functions[: len(place)]))
        return torch.cat(rows)

    network = checkpoint.network_for(CONFIG, 16, 0)
    network.register_forward_hook(know)
    knowing = evaluate_matching(network, meshes, numbers).mean()
    assert knowing < 1.5 * evaluate_true_maps(meshes, numbers).mean() < 0.02
