from dataclasses import replace

import numpy as np
import pytest
import torch
from packed import pack
from samples import sample, toy_dataset, write_dataset
from shapes import rotation

from meshshard import UsageError, open_dataset
from meshshard.recipe import RECIPES
from meshshard_train.data import epoch_order, packed, quarter_turn, steps_of
from meshshard_train.inputs import input_size, inputs_of
from meshshard_train.loading import Loading, Meshes
from meshshard_train.recipes import paper
from meshshard_train.tasks import check_task

CONFIG = paper("segmentation")


def test_inputs_have_the_announced_channels():
    inputs = inputs_of(sample(0), CONFIG)
    assert inputs.shape == (18, input_size(CONFIG, 16)) == (18, 23)
    assert inputs.dtype == torch.float32
    np.testing.assert_array_equal(inputs[:, :3], sample(0).vertices)
    only = replace(CONFIG, features=("hks", "vertices"))
    np.testing.assert_array_equal(inputs_of(sample(0), only)[:, 16:], sample(0).vertices)


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["hks", "dihedral", "vertices"])
def test_a_feature_that_is_not_finite_is_refused_and_not_taken_for_a_constant_one(name, value):
    bad = getattr(sample(0), name).copy()
    bad[3] = value
    with pytest.raises(UsageError, match=f"{sample(0).id}: {name} is not finite"):
        inputs_of(replace(sample(0), **{name: bad}), CONFIG)


def test_log_standard_scaling():
    inputs = inputs_of(sample(0), CONFIG).numpy()
    np.testing.assert_allclose(inputs[:, 6:].mean(axis=0), 0, atol=1e-5)
    np.testing.assert_allclose(inputs[:, 6:].std(axis=0), 1, atol=1e-5)
    logs = np.log(sample(0).hks)
    np.testing.assert_allclose(inputs[:, 7:], (logs - logs.mean(0)) / logs.std(0), rtol=1e-3, atol=1e-5)


def test_min_max_scaling():
    inputs = inputs_of(sample(0), replace(CONFIG, scaling="min-max")).numpy()
    np.testing.assert_allclose(
        [inputs[:, 6:].min(axis=0), inputs[:, 6:].max(axis=0)], [[0] * 17, [1] * 17], atol=1e-6
    )


@pytest.mark.parametrize("scaling", ["log-standard", "min-max"])
def test_a_constant_channel_becomes_zero(scaling):
    flat = sample(0, dihedral=np.full(18, 0.3, dtype="f4"), hks=np.full((18, 16), 2.0, dtype="f4"))
    assert not inputs_of(flat, replace(CONFIG, scaling=scaling))[:, 6:].any()


@pytest.mark.parametrize("scaling", ["log-standard", "min-max"])
def test_vertices_without_a_face_take_no_part_in_scaling(scaling):
    config = replace(CONFIG, scaling=scaling)
    whole = sample(0)
    values = {
        name: np.concatenate([getattr(whole, name), np.zeros_like(getattr(whole, name)[:1])])
        for name in ("vertices", "vertex_normals", "dihedral", "hks", "vertex_areas")
    }
    values["vertices"][-1] = 50
    found = inputs_of(replace(whole, **values), config)
    np.testing.assert_array_equal(found[:-1], inputs_of(whole, config))
    assert not found[-1].any()


def test_rotation_turns_positions_and_normals_only(monkeypatch):
    turn = rotation().astype("f4")
    monkeypatch.setattr("meshshard_train.data.quarter_turn", lambda *_: turn)
    plain, turned = inputs_of(sample(0), CONFIG).numpy(), pack([sample(0)], [0], CONFIG, 0).features_VC.numpy()
    np.testing.assert_allclose(turned[:, :3], plain[:, :3] @ turn.T, atol=1e-6)
    np.testing.assert_allclose(turned[:, 3:6], plain[:, 3:6] @ turn.T, atol=1e-6)
    np.testing.assert_array_equal(turned[:, 6:], plain[:, 6:])


def test_quarter_turns():
    rng = np.random.default_rng(0)
    found = {quarter_turn(rng, "xyz").tobytes() for _ in range(300)}
    assert len(found) == 10  # identity and three turns about each of three axes
    for matrix in found:
        array = np.frombuffer(matrix, dtype="f4").reshape(3, 3)
        np.testing.assert_array_equal(array @ array.T, np.eye(3))
        assert np.linalg.det(array) == pytest.approx(1)
    for _ in range(20):
        assert quarter_turn(rng, "y")[1, 1] == 1
    np.testing.assert_array_equal(quarter_turn(rng, ""), np.eye(3))


def test_order_depends_on_seed_and_epoch_alone():
    numbers = list(range(5, 40))
    assert epoch_order(numbers, 1, 2) == epoch_order(numbers, 1, 2)
    assert sorted(epoch_order(numbers, 1, 2)) == numbers
    assert len({tuple(epoch_order(numbers, seed, epoch)) for seed in range(3) for epoch in range(3)}) == 9


def test_packing_fills_the_budget():
    sizes = [5, 5, 5, 20, 1, 1, 9]
    assert list(packed(range(7), sizes, 10)) == [[0, 1], [2], [3], [4, 5], [6]]
    assert list(packed(range(7), sizes, 10, most=1)) == [[n] for n in range(7)]
    assert list(packed(range(7), sizes, 100, most=3)) == [[0, 1, 2], [3, 4, 5], [6]]
    assert list(packed([], sizes, 10)) == []


def test_each_mesh_once_an_epoch(tmp_path):
    dataset = open_dataset(toy_dataset(tmp_path))
    config = replace(CONFIG, batch_vertices=100)
    numbers = dataset.splits["train"]
    steps = steps_of(numbers, dataset.vertex_counts, config, 0)
    assert sorted(n for step in steps for n in step) == list(numbers)
    assert len(steps) > 2
    meshes = Meshes(dataset, config, torch.device("cpu"), Loading())
    assert [n for batch in meshes.evaluation_batches(numbers) for n in batch.numbers] == list(numbers)


def test_collate_keeps_meshes_apart():
    samples = [sample(0), sample(1, level=0), sample(2)]
    batch = pack(samples, [4, 5, 6], CONFIG, None)
    assert batch.drop_BL is None
    assert torch.bincount(batch.mesh_V).tolist() == [18, 6, 18]
    assert torch.bincount(batch.mesh_F).tolist() == [32, 8, 32]
    assert (batch.mesh_V[batch.faces_F3] == batch.mesh_F[:, None]).all()
    np.testing.assert_array_equal(batch.labels, np.concatenate([s.face_labels for s in samples]))


def test_a_mesh_is_treated_the_same_whatever_it_is_packed_with():
    samples = [sample(0), sample(1, level=0), sample(2)]
    together, alone = pack(samples, [4, 5, 6], CONFIG, 3), pack(samples[1:2], [5], CONFIG, 3)
    torch.testing.assert_close(together.features_VC[18:24], alone.features_VC)
    torch.testing.assert_close(together.drop_BL[1:2], alone.drop_BL)
    other = pack(samples[1:2], [5], CONFIG, 4)
    assert not torch.equal(other.drop_BL, alone.drop_BL)


def test_wrong_data_sets_are_refused_by_name(tmp_path):
    dataset = open_dataset(toy_dataset(tmp_path))
    with pytest.raises(UsageError, match="is a data set for segmentation, the run is for classification"):
        check_task(dataset, paper("classification"))
    advice = "type meshshard features toy --recipe official, and train on data/features/toy/official"
    with pytest.raises(UsageError, match=f"has no dihedral_official: its recipe is paper; {advice}"):
        check_task(dataset, paper("segmentation", features=("dihedral_official",)))
    with pytest.raises(UsageError, match=r"has no dihedral_signed: .*; compute features with a recipe that has it"):
        check_task(dataset, paper("segmentation", features=("dihedral_signed",)))
    folder = write_dataset(tmp_path / "none", [sample(0, labels=None)], ["train"])
    with pytest.raises(UsageError, match="has shards without face_labels"):
        check_task(open_dataset(folder), CONFIG)


def test_official_channels(tmp_path):
    recipe = RECIPES["official"]
    made = sample(0, recipe=recipe, dihedral_official=np.random.default_rng(0).random((18, 3)).astype("f4"))
    config = paper(
        "segmentation", features=("vertices", "vertex_normals", "dihedral_official", "hks"), scaling="min-max"
    )
    check_task(open_dataset(write_dataset(tmp_path, [made], ["train"], recipe=recipe)), config)
    assert inputs_of(made, config).shape == (18, 25)
