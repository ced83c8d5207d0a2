import pytest
import torch

from meshshard_train.backbone import MeshConv
from meshshard_train.rows import Rows

SIZES = (4, 1, 7)
MESH = torch.repeat_interleave(torch.tensor(SIZES))
USED = torch.arange(12) % 5 != 2
PADDING = 3


def with_padding(x):
    return torch.cat([x, torch.full((PADDING, x.shape[1]), 1e6, dtype=x.dtype)])


def test_sums_and_means_are_those_of_each_mesh_without_padding_and_unused_vertices():
    x = torch.randn(12, 5, dtype=torch.float64)
    rows = Rows(with_padding(x), 12, MESH, USED)
    for number in range(3):
        mine = x[(number == MESH) & USED]
        torch.testing.assert_close(rows.sums(with_padding(x))[number], mine.sum(0))
        torch.testing.assert_close(rows.means(with_padding(x))[number], mine.sum(0) / max(len(mine), 1))
    assert torch.equal(rows.spread(torch.arange(3.0)[:, None])[:12, 0], MESH.float())


@pytest.mark.parametrize("size", [1, 2, 9])
def test_convolution_of_one_mesh_is_that_of_torch(size):
    torch.manual_seed(size)
    ours, theirs = MeshConv(4, 6).double(), torch.nn.Conv1d(4, 6, 3, padding=1).double()
    with torch.no_grad():  # (outputs, 3 * inputs) against (outputs, inputs, 3)
        ours.weight.copy_(theirs.weight.permute(0, 2, 1).reshape(6, 12))
        ours.bias.copy_(theirs.bias)
    x = torch.randn(size, 4, dtype=torch.float64)
    torch.testing.assert_close(ours(x, Rows(x)), theirs(x.T[None])[0].T)


def test_convolution_sees_no_other_mesh_no_unused_vertex_and_no_padding():
    conv, x = MeshConv(4, 6).double(), torch.randn(12, 4, dtype=torch.float64)
    packed = conv(with_padding(x), Rows(with_padding(x), 12, MESH, USED))[:12]
    for number in range(3):
        part, used = x[number == MESH], USED[number == MESH]
        alone = conv(part * used[:, None], Rows(part))
        torch.testing.assert_close(packed[number == MESH][used], alone[used])


def test_area_means_weigh_each_row_by_its_area():
    x, areas = torch.randn(12, 5, dtype=torch.float64), torch.rand(12, dtype=torch.float64)
    rows = Rows(with_padding(x), 12, MESH, USED, areas)
    for number in (0, 2):
        mine = (number == MESH) & USED
        expected = (x[mine] * areas[mine, None]).sum(0) / areas[mine].sum()
        torch.testing.assert_close(rows.area_means(with_padding(x))[number], expected)


def test_one_mesh_needs_no_numbers():
    x = torch.randn(6, 2)
    assert torch.equal(Rows(x).means(x), Rows(x, 6, torch.zeros(6, dtype=torch.int64)).means(x))
    torch.testing.assert_close(Rows(x).means(x), x.mean(0, keepdim=True))
