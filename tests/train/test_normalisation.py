"""Against torch's own layers on one mesh; mesh by mesh when packed."""

import pytest
import torch
from torch import nn

from meshshard.errors import UsageError
from meshshard_train.config import NORMALISATIONS
from meshshard_train.normalisation import EPS, GROUPS, normalisation
from meshshard_train.recipes import paper
from meshshard_train.rows import OfMesh, Rows
from meshshard_train.team import Team

WIDTH = 2 * GROUPS
THEIRS = {
    "batch": nn.BatchNorm1d(WIDTH, eps=EPS),
    "group": nn.GroupNorm(GROUPS, WIDTH, eps=EPS),
    "instance": nn.InstanceNorm1d(WIDTH, eps=EPS, affine=True),
    "instance_area": nn.InstanceNorm1d(WIDTH, eps=EPS, affine=True),  # where areas are alike
}
OF_MESH = [name for name in NORMALISATIONS if name != "layer"]


def drawn(name, seed=0):
    """A layer in double with a drawn weight and bias."""
    torch.manual_seed(seed)
    layer = normalisation(name, WIDTH).double()
    nn.init.normal_(layer.weight)
    nn.init.normal_(layer.bias)
    return layer


def meshes(*sizes, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return [3 * torch.randn(n, WIDTH, dtype=torch.float64, generator=generator) + 1 for n in sizes]


def call(layer, x, *of):
    return layer(x, Rows(x, *of)) if isinstance(layer, OfMesh) else layer(x)


@pytest.mark.parametrize("name", THEIRS)
@pytest.mark.parametrize("size", [2, 5, 200])
def test_one_mesh_is_normalised_as_by_torch(name, size):
    ours, theirs, (x,) = drawn(name, size), THEIRS[name].double(), meshes(size)
    theirs.load_state_dict(ours.state_dict(), strict=False)
    expected = theirs(x) if name == "batch" else theirs(x.T[None])[0].T
    torch.testing.assert_close(call(ours, x), expected)


@pytest.mark.parametrize(("width", "groups"), [(4, 2), (16, 8), (64, 32), (80, 8), (512, 32)])
def test_groups_have_two_channels_at_least(width, groups):
    assert normalisation("group", width).groups == groups


def test_layer_is_the_published_one():
    layer = normalisation("layer", WIDTH)
    assert type(layer) is nn.LayerNorm
    assert layer.eps == 1e-6


@pytest.mark.parametrize("size", [1, 5, 200])
def test_global_response_is_its_formula(size):
    layer, (x,) = drawn("grn", size), meshes(size)
    x[:, 3] = 0  # a dead channel
    x.requires_grad_()
    length = torch.stack([(x[:, c] @ x[:, c]).sqrt() if c != 3 else x.new_zeros(()) for c in range(WIDTH)])
    response = length / (sum(length) / WIDTH + 1e-6)
    expected = layer.weight * (x * response) + layer.bias + x
    found = call(layer, x)
    torch.testing.assert_close(found, expected)
    (gradient,) = torch.autograd.grad(found.square().sum(), x, retain_graph=True)
    torch.testing.assert_close(gradient, torch.autograd.grad(expected.square().sum(), x)[0])


def test_global_response_starts_as_nothing():
    layer, (x,) = normalisation("grn", WIDTH).double(), meshes(9)
    assert torch.equal(call(layer, x), x)


@pytest.mark.parametrize("name", OF_MESH)
@pytest.mark.parametrize("training", [True, False])
def test_a_packed_mesh_is_treated_as_if_it_were_alone(name, training):
    layer, parts = drawn(name).train(training), meshes(3, 40, 7)
    if name == "batch":
        layer.running_mean.normal_()
        layer.running_var.uniform_(0.5, 2)
    mesh = torch.repeat_interleave(torch.tensor([3, 40, 7]))
    used = torch.arange(50) % 6 != 1
    packed = torch.cat([*parts, torch.full((5, WIDTH), 1e9, dtype=torch.float64)])
    found = layer(packed, Rows(packed, 50, mesh, used))[:50]
    for number, part in enumerate(parts):
        mine = used[mesh == number]
        torch.testing.assert_close(found[mesh == number][mine], call(layer, part[mine]))


def test_over_a_surface_a_row_counts_as_often_as_its_area_says():
    """Rows with whole numbers as areas, and each repeated so many times."""
    layer, parts = drawn("instance_area"), meshes(3, 40)
    areas = torch.arange(43) % 4
    areas[41] = 9
    mesh = torch.repeat_interleave(torch.tensor([3, 40]))
    used, x = torch.arange(43) != 41, torch.cat(parts)
    found = layer(x, Rows(x, None, mesh, used, areas.double() / 7))
    for number in (0, 1):
        mine = (mesh == number) & used
        repeated = x[mine].repeat_interleave(areas[mine], 0)
        plain = drawn("instance")(repeated, Rows(repeated))
        torch.testing.assert_close(found[mine].repeat_interleave(areas[mine], 0), plain)


def test_a_mesh_without_area_stays_finite():
    layer, (x,) = drawn("instance_area"), meshes(5)
    assert layer(x, Rows(x, areas_V=torch.zeros(5))).isfinite().all()


def test_running_averages_are_torchs_of_one_mesh_after_another():
    theirs, parts = nn.BatchNorm1d(WIDTH, eps=EPS).double(), meshes(3, 40, 7, 12)
    for part in parts:
        theirs(part)
    for packs in ([[0, 1, 2, 3]], [[0], [1], [2], [3]], [[0, 1], [2, 3]], [[0], [1, 2, 3]]):
        ours = normalisation("batch", WIDTH).double()
        for pack in packs:
            x = torch.cat([parts[number] for number in pack])
            mesh = torch.repeat_interleave(torch.tensor([len(parts[number]) for number in pack]))
            ours(x, Rows(x, None, mesh))
        torch.testing.assert_close(ours.running_mean, theirs.running_mean)
        torch.testing.assert_close(ours.running_var, theirs.running_var)
        x = torch.cat(parts)
        torch.testing.assert_close(ours.eval()(x, Rows(x)), theirs.eval()(x))
        theirs.train()


@pytest.mark.parametrize("name", OF_MESH)
def test_bfloat16_changes_the_result_by_its_rounding(name):
    layer, (x,) = drawn(name).float(), meshes(3000)
    torch.testing.assert_close(
        call(layer, x.bfloat16()).float(), call(layer, x.bfloat16().float()), atol=0.05, rtol=0.01
    )
    assert call(layer, x.bfloat16()).dtype == torch.bfloat16


def test_batch_normalisation_is_refused_in_several_processes():
    for name in NORMALISATIONS:
        Team().check(paper("segmentation", normalisation=name))
    Team(rank=1, size=2).check(paper("segmentation", normalisation="instance"))
    with pytest.raises(UsageError, match=r"normalisation = batch keeps averages .*: train without torchrun"):
        Team(rank=1, size=2).check(paper("segmentation", normalisation="batch"))
