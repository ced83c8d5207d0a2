"""Every normalisation and backbone, as a whole network: packed batches equal one mesh after another."""

import pytest
import torch

from meshshard import UsageError
from meshshard_train.config import BACKBONES, NORMALISATIONS
from meshshard_train.model import BLOCKS, Block, TaskDrivenNet, drop_path_factors
from meshshard_train.recipes import paper
from meshshard_train.rows import Rows

SIZES = (5, 30, 9)
MESH = torch.repeat_interleave(torch.tensor(SIZES))
USED = torch.arange(44) % 7 != 3
AREAS = 0.1 + torch.rand(44, dtype=torch.float64, generator=torch.Generator().manual_seed(2))
VARIANTS = [
    ("layer", "mlp_residual"),
    ("batch", "mlp_residual"),
    ("instance", "mlp_residual"),
    ("instance_area", "mlp_residual"),
    ("group", "mlp"),
    ("grn", "conv"),
    ("batch", "conv_residual"),
]


def network(normalisation, backbone):
    """In double, with branches that matter from the start."""
    torch.manual_seed(0)
    found = TaskDrivenNet(4, 3, normalisation, backbone).double()
    found.pads_to = 8
    with torch.no_grad():
        for name, parameter in found.named_parameters():
            if name.endswith("gamma"):
                parameter.fill_(0.5)
            elif parameter.ndim == 1:
                parameter.add_(0.1 * torch.randn_like(parameter))
    return found


def features():
    return torch.randn(44, 4, dtype=torch.float64, generator=torch.Generator().manual_seed(1)) * USED[:, None]


@pytest.mark.parametrize(("normalisation", "backbone"), VARIANTS)
def test_narrow_networks(normalisation, backbone):
    network = TaskDrivenNet(4, 3, normalisation, backbone, width=16).double().eval()
    together = network(features(), MESH, None, USED)
    assert together.shape == (44, 3)
    assert together.isfinite().all()


def test_widths_that_there_are():
    with pytest.raises(UsageError, match="width is a multiple of 16, from 16 to 4096, not 100"):
        paper("segmentation", width=100)


def test_the_variants_are_all_there_are():
    assert {name for name, _ in VARIANTS} == set(NORMALISATIONS)
    assert {name for _, name in VARIANTS} == set(BACKBONES)


@pytest.mark.parametrize(("normalisation", "backbone"), VARIANTS)
def test_packed_gradients_are_the_sum_of_those_of_each_mesh(normalisation, backbone):
    net, x = network(normalisation, backbone), features()
    drops = drop_path_factors(torch.rand(3, BLOCKS), 0.5).double()
    target = torch.randn(44, 3, dtype=torch.float64)

    def gradients(losses):
        net.zero_grad()
        sum(losses).backward()
        return {name: p.grad.clone() for name, p in net.named_parameters()}

    def loss(logits, part):
        return (logits * target[part])[USED[part]].sum() / part.sum()

    packed, parts = net(x, MESH, drops[MESH], USED, AREAS), [number == MESH for number in range(3)]
    together = gradients([loss(packed[part], part) for part in parts])
    singles = [
        net(x[part], None, drops[number].expand(int(part.sum()), -1), USED[part], AREAS[part])
        for number, part in enumerate(parts)
    ]
    alone = gradients([loss(single, part) for single, part in zip(singles, parts, strict=True)])
    largest = max(float(gradient.abs().max()) for gradient in alone.values())
    assert largest > 0
    for name, gradient in alone.items():
        torch.testing.assert_close(together[name], gradient, atol=1e-9 * largest, rtol=1e-6)


@pytest.mark.parametrize(("normalisation", "backbone"), VARIANTS)
@torch.inference_mode()
def test_neither_padding_nor_unused_vertices_change_anything(normalisation, backbone):
    net, x, found = network(normalisation, backbone), features(), []
    for rows, unused in ((1, 0.0), (8, 0.0), (64, 0.0), (1, 1e3)):
        net.pads_to = rows
        found.append(net(torch.where(USED[:, None], x, unused), MESH, None, USED, AREAS)[USED])
    for other in found[1:]:
        torch.testing.assert_close(other, found[0], atol=1e-10, rtol=1e-8)


@pytest.mark.parametrize("backbone", ["mlp", "conv"])
def test_without_residual_the_output_is_the_branch_alone(backbone):
    block, x = Block(8, backbone=backbone), torch.randn(5, 8)
    torch.nn.init.normal_(block.gamma)
    rows = Rows(x)
    inner = block.bottleneck(x, rows)
    branch = block.gamma * (block.expand(inner, rows) if backbone == "conv" else block.expand(inner))
    torch.testing.assert_close(block(x, None, rows), branch.relu())
    assert torch.equal(block(x, torch.zeros(5, 1), rows), block(x, None, rows))


def test_a_plain_mlp_starts_blind_and_a_convolution_does_not():
    """As the article's figures have it: 25.2 %, the share of the largest class, against 84.0 %."""
    x = features().float()
    spread = {}
    for backbone in ("mlp", "conv"):
        torch.manual_seed(0)
        block = Block(256, backbone=backbone)
        inputs = torch.nn.functional.pad(x, (0, 252))
        spread[backbone] = block(inputs, None, Rows(inputs)).std(0).max()
    assert spread["mlp"] < 1e-5 < 1e-2 < spread["conv"]


@pytest.mark.parametrize("normalisation", NORMALISATIONS)
@pytest.mark.parametrize("backbone", BACKBONES)
def test_parameters_of_the_variants(normalisation, backbone):
    """25 inputs, 8 classes. A normalisation changes none; a convolution has three weights for one."""
    with torch.device("meta"):
        net = TaskDrivenNet(25, 8, normalisation, backbone)
    linear = sum(
        blocks * (width**2 // 4 + width**2 // 16 + width**2 // 4) for blocks, width in ((13, 256), (19, 512))
    )
    assert 4_101_672 + 2 * linear == 10_663_464
    expected = 10_663_464 if backbone.startswith("conv") else 4_101_672
    assert sum(parameter.numel() for parameter in net.parameters()) == expected


@pytest.mark.parametrize("training", [True, False])
def test_evaluation_changes_batch_normalisation_alone(training):
    """Running averages, which are kept with the weights, decide in evaluation and change in training only."""
    for normalisation in NORMALISATIONS:
        net = network(normalisation, "mlp_residual").train(training)
        before = {name: value.clone() for name, value in net.state_dict().items()}
        net(features(), MESH, None, USED)
        moved = {name for name, value in net.state_dict().items() if not torch.equal(value, before[name])}
        averages = {name for name in before if "running" in name}
        assert moved == (averages if training else set())
        assert bool(averages) == (normalisation == "batch")
        assert all(value.is_floating_point() for value in before.values())
