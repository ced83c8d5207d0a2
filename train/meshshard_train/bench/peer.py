"""The published training loop, written out plainly: the peer that speed is measured against.

One mesh at a time in fp32, gradients of three accumulated, AdamW as torch has it by default. The features are in
memory, as there. For each mesh they are scaled to 0..1 in each channel, turned, and put side by side; then come the
network, the loss, its gradient, and the mesh file is read again: labels of the training pass take one vote among the
faces across edges, those of the test pass several among the faces that share a vertex, the file read for each round.

The network is ours, so that the loops alone differ: in fp32 and for one mesh it is some 3 % faster than one that
multiplies by gamma and by the drop-path factor separately and pads no rows.
"""

from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float64, Int, Int64
from torch import Tensor
from torch.nn import functional

from meshshard import Sample
from meshshard_train.bench.shapes import CLASSES, write_obj
from meshshard_train.data import quarter_turn
from meshshard_train.model import BLOCKS, TaskDrivenNet, drop_path_factors, pool_faces

ACCUMULATED = 3


class Peer:
    """A training that goes on for as long as it is asked. `folder` gets the meshes as OBJ files."""

    def __init__(self, samples: list[Sample], folder: Path) -> None:
        torch.manual_seed(0)
        self.paths = [write_obj(folder, mesh) for mesh in samples]
        self.meshes = [
            [torch.tensor(array) for array in (m.vertices, m.vertex_normals, m.dihedral[:, None], m.hks, m.faces)]
            for m in samples
        ]
        self.labels = [torch.tensor(mesh.face_labels, dtype=torch.int64) for mesh in samples]
        self.network = TaskDrivenNet(sum(array.shape[1] for array in self.meshes[0][:4]), len(CLASSES))
        self.optimizer = torch.optim.AdamW(self.network.parameters(), lr=3e-4, weight_decay=0.3)
        self.rng = np.random.default_rng(0)
        self.done, self.correct, self.loss = 0, 0, 0.0

    def train(self, voting: bool) -> None:
        """One step of the optimiser: three meshes."""
        self.network.train()
        for _ in range(ACCUMULATED):
            number = self.done % len(self.meshes)
            *features, faces_F3 = self.meshes[number]
            vertices, normals, dihedral, hks = features
            turn = torch.from_numpy(quarter_turn(self.rng, "y")).T
            inputs_VC = torch.cat([vertices @ turn, normals @ turn, to_unit(dihedral), to_unit(hks)], dim=1)
            drop_1L = drop_path_factors(torch.rand(1, BLOCKS), 0.1)
            logits_FK = pool_faces(self.network(inputs_VC, None, drop_1L.expand(len(inputs_VC), -1)), faces_F3)
            loss = functional.cross_entropy(logits_FK, self.labels[number], label_smoothing=0.1) / ACCUMULATED
            loss.backward()
            self.loss += loss.item()
            labels = logits_FK.argmax(1).numpy()
            if voting:
                labels = vote_across_edges(self.paths[number], labels)
            self.correct += int((labels == self.labels[number].numpy()).sum())
            self.done += 1
        self.optimizer.step()
        self.optimizer.zero_grad()


def to_unit(values_VC: Float[Tensor, "V C"]) -> Float[Tensor, "V C"]:
    """Each channel to 0..1."""
    low, high = values_VC.amin(0), values_VC.amax(0)
    return (values_VC - low) / (high - low)


def vote_across_edges(path: Path, labels: Int[np.ndarray, " F"]) -> Int64[np.ndarray, " F"]:
    """The commonest label of the faces across a face's edges; the lowest of equals."""
    _, faces = read_obj(path)
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    order = np.lexsort(ends.T)
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    first, second = order[:-1][same] // 3, order[1:][same] // 3
    votes = np.zeros((len(faces), len(CLASSES)))
    np.add.at(votes, (first, labels[second]), 1)
    np.add.at(votes, (second, labels[first]), 1)
    return votes.argmax(axis=1)


def vote_around_vertices(path: Path, labels: Int[np.ndarray, " F"]) -> Int64[np.ndarray, " F"]:
    """The commonest label of the other faces that share a vertex with a face; the lowest of equals."""
    _, faces = read_obj(path)
    at_vertex: dict[int, list[int]] = {}
    for face, corners in enumerate(faces.tolist()):
        for vertex in corners:
            at_vertex.setdefault(vertex, []).append(face)
    voted = np.zeros(len(faces), dtype=np.int64)
    for face, (a, b, c) in enumerate(faces.tolist()):
        near = list({*at_vertex[a], *at_vertex[b], *at_vertex[c]} - {face})
        voted[face] = np.bincount(labels[near], minlength=len(CLASSES)).argmax()
    return voted


def read_obj(path: Path) -> tuple[Float64[np.ndarray, "V 3"], Int64[np.ndarray, "F 3"]]:
    """Vertices and triangles of an OBJ file."""
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words and words[0] == "v":
            vertices.append([float(word) for word in words[1:4]])
        elif words and words[0] == "f":
            faces.append([int(word.split("/")[0]) - 1 for word in words[1:4]])
    return np.array(vertices), np.array(faces)
