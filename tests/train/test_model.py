import pytest
import torch

from meshshard_train.model import (
    BLOCKS,
    Block,
    TaskDrivenNet,
    drop_path_factors,
    drop_path_rates,
    pool_faces,
    pool_meshes,
)
from meshshard_train.rows import Rows


@pytest.mark.parametrize(
    ("features", "classes", "parameters"),
    [(25, 4, 4_101_540), (25, 8, 4_101_672), (6, 30, 4_097_534), (6, 40, 4_097_864)],
)
def test_live_parameters_of_the_published_network(features, classes, parameters):
    assert sum(p.numel() for p in TaskDrivenNet(features, classes).parameters()) == parameters


@pytest.mark.parametrize("width", [16, 64, 512])
def test_parameters_of_other_widths(width):
    """A block of c channels has i = c/4 inside: three layers with biases, two norms, gamma."""
    w, half, double = width, width // 2, 2 * width

    def block(c, i):
        return (c * i + i) + (i * i + i) + (i * c + c) + 2 * (2 * i) + c

    def join(a, b, norm):
        return a * b + b + 2 * norm

    layers = [join(25, w, w), join(w, double, double), 3 * join(double, w, double), join(double, half, double)]
    layers += [3 * join(w, half, w), join(double, half, double), join(half, 32, half), 32 * 8 + 8]
    assert sum(p.numel() for p in TaskDrivenNet(25, 8, width=width).parameters()) == (
        sum(layers) + 13 * block(w, w // 4) + 19 * block(double, double // 4)
    )


def test_every_parameter_is_live():
    network = TaskDrivenNet(5, 3)
    network(torch.randn(7, 5)).square().sum().backward()
    assert all(p.grad is not None and p.grad.abs().sum() > 0 for p in network.parameters())


@pytest.mark.parametrize(("width", "std"), [(256, 0.02), (64, 0.04)])
def test_initial_weights(width, std):
    network = TaskDrivenNet(25, 8, width=width)
    assert network.stem1[0].weight.std().item() == pytest.approx(std, rel=0.1)
    assert not network.stem1[0].bias.any()
    assert (network.encoder[0].blocks[0].gamma == 1e-6).all()
    assert {m.eps for m in network.modules() if isinstance(m, torch.nn.LayerNorm)} == {1e-6}


@torch.inference_mode()
def test_no_vertex_sees_another():
    network = TaskDrivenNet(6, 4).eval()
    features = torch.randn(50, 6)
    together, order = network(features), torch.randperm(50)
    torch.testing.assert_close(network(features[order]), together[order])
    torch.testing.assert_close(network(features[:1]), together[:1], atol=1e-6, rtol=1e-5)


def test_block_is_the_formula():
    block = Block(8)
    torch.nn.init.normal_(block.gamma)
    x, scale = torch.randn(5, 8), torch.tensor([[0.0], [1.0], [2.0], [1.0], [0.0]])
    first, norm1, _, second, norm2, _ = block.bottleneck
    branch = block.gamma * block.expand(norm2(second(norm1(first(x)).relu())).relu())
    torch.testing.assert_close(block(x, scale, Rows(x)), (x + scale * branch).relu())
    torch.testing.assert_close(block(x, None, Rows(x)), (x + branch).relu())
    torch.testing.assert_close(block(x, scale, Rows(x))[0], x[0].relu())


def test_drop_path_rises_over_the_encoder_and_again_over_the_decoder():
    rates = drop_path_rates(0.1)
    assert BLOCKS == len(rates) == 32
    assert (rates[0], rates[15], rates[16], rates[31]) == pytest.approx((0, 0.1, 0, 0.1))
    factors = drop_path_factors(torch.rand(20_000, BLOCKS), 0.1)
    torch.testing.assert_close((factors == 0).float().mean(0), rates, atol=0.01, rtol=0)
    torch.testing.assert_close(factors.mean(0), torch.ones(BLOCKS), atol=0.01, rtol=0)


def test_dropped_blocks_do_nothing():
    """All paths dropped: blocks are ReLUs, so what the bottlenecks hold does not matter."""
    network = TaskDrivenNet(4, 2)
    with torch.no_grad():
        for module in network.modules():
            if isinstance(module, Block):
                module.gamma.fill_(1.0)
    features, dropped = torch.randn(9, 4), torch.zeros(9, BLOCKS)
    before = network(features, None, dropped)
    assert not torch.allclose(before, network(features))
    with torch.no_grad():
        for module in network.modules():
            if isinstance(module, Block):
                module.bottleneck[0].weight.normal_()
    torch.testing.assert_close(network(features, None, dropped), before)


def test_pooling_is_the_mean():
    logits = torch.arange(12.0).view(6, 2)
    faces = torch.tensor([[0, 1, 2], [5, 5, 5]])
    torch.testing.assert_close(pool_faces(logits, faces), torch.stack([logits[:3].mean(0), logits[5]]))
    mesh = torch.tensor([0, 0, 0, 0, 1, 1])
    used = torch.tensor([True, False, True, True, True, True])
    expected = torch.stack([logits[[0, 2, 3]].mean(0), logits[4:].mean(0)])
    torch.testing.assert_close(pool_meshes(logits, mesh, used, 2), expected)


@pytest.mark.parametrize("vertices", [1, 300, 5000])
def test_the_mean_of_a_mesh_is_not_rounded_to_bfloat16(vertices):
    """Which cannot count to 257."""
    logits, mesh = torch.full((vertices, 2), 0.5).bfloat16(), torch.zeros(vertices, dtype=torch.int64)
    pooled = pool_meshes(logits, mesh, torch.ones(vertices, dtype=torch.bool), 1)
    assert torch.equal(pooled, torch.full((1, 2), 0.5))
