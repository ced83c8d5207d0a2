from math import isnan, nan

import numpy as np
import pytest
from shapes import FAMILY

from meshshard_train.config import PUBLISHED_PROTOCOL
from meshshard_train.metrics import CLASS_FIGURES, FIGURES, Confusion, judged

FACES = 120


def meshes(seed, classes=4, count=5):
    """Truth (some of it -1, one mesh without any), prediction, areas and neighbours of each."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        truth = rng.integers(-1, classes, FACES) if number else np.full(FACES, -1)
        predicted = np.where(rng.random(FACES) < 0.4, rng.integers(0, classes, FACES), truth.clip(0))
        yield truth, predicted, rng.random(FACES), rng.integers(-1, FACES, (FACES, 3))


def counted(examples, classes=4):
    found = Confusion(classes)
    for example in examples:
        found.add(*example)
    return found


def flat(summary, of_classes):
    """All figures by name, those of classes with a number."""
    return summary | {f"{name} {k}": value for name, values in of_classes.items() for k, value in enumerate(values)}


def figures(found):
    return flat(found.summary(), found.of_classes())


def same(expected):
    return pytest.approx(expected, nan_ok=True)


def mean(values):
    values = [value for value in values if not isnan(value)]
    return sum(values) / len(values) if values else nan


def ratio(part, whole):
    return part / whole if whole else nan


def by_loops(examples, classes):
    """The same figures, counted by hand: sets of places instead of matrices."""
    faces = [
        (mesh, face, int(t), int(p), float(a))
        for mesh, (truth, predicted, areas, _) in enumerate(examples)
        for face, (t, p, a) in enumerate(zip(truth, predicted, areas, strict=True))
        if t >= 0
    ]
    of_mesh = {mesh: [f for f in faces if f[0] == mesh] for mesh in range(len(examples))}

    def overlap(part, k):
        true, told = ({f[:2] for f in part if f[place] == k} for place in (2, 3))
        return ratio(len(true & told), len(true | told)), ratio(2 * len(true & told), len(true) + len(told))

    found = {"accuracy": [], "iou": [], "dice": [], "mesh_iou": [], "mesh_dice": []}
    for k in range(classes):
        true = [f for f in faces if f[2] == k]
        found["accuracy"].append(ratio(sum(f[3] == k for f in true), len(true)))
        pooled, each = overlap(faces, k), [overlap(part, k) for part in of_mesh.values()]
        for place, name in enumerate(("iou", "dice")):
            found[name].append(pooled[place])
            found[f"mesh_{name}"].append(mean([pair[place] for pair in each]))
    return {
        "accuracy": ratio(sum(f[2] == f[3] for f in faces), len(faces)),
        "area_accuracy": ratio(sum(f[4] for f in faces if f[2] == f[3]), sum(f[4] for f in faces)),
        "mesh_accuracy": mean([ratio(sum(f[2] == f[3] for f in part), len(part)) for part in of_mesh.values()]),
        "class_accuracy": mean(found["accuracy"]),
        "mean_iou": mean(found["iou"]),
        "mean_dice": mean(found["dice"]),
    }, found


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("classes", [1, 2, 6])
def test_against_plain_loops(seed, classes):
    examples = list(meshes(seed, classes))
    found = counted(examples, classes + 1)  # one class is neither there nor predicted
    expected = flat(*by_loops(examples, classes + 1))
    assert figures(found) == same(expected | {"edge_accuracy": found.summary()["edge_accuracy"]})
    assert all(isnan(values[-1]) for values in found.of_classes().values())
    assert set(found.of_classes()) == set(CLASS_FIGURES)
    assert all(set(names) <= set(found.summary()) for names in FIGURES.values())


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_closed_form_of_two_classes(share):
    """Class 1 is that share of the faces, and half of it is taken for class 0."""
    right = round(share * 500)
    truth = np.repeat([0, 1, 1], [1000 - 2 * right, right, right])
    predicted = np.repeat([0, 0, 1], [1000 - 2 * right, right, right])
    found = counted([(truth, predicted)], 2)
    assert found.accuracy() == pytest.approx(1 - share / 2)
    expected = {"accuracy": [1, 1 / 2], "iou": [(1 - share) / (1 - share / 2), 1 / 2]}
    expected["dice"] = [2 * iou / (1 + iou) for iou in expected["iou"]]
    for name, values in expected.items():
        assert found.of_classes()[name] == pytest.approx(values)
    for name in ("iou", "dice"):
        assert found.of_classes()[f"mesh_{name}"] == found.of_classes()[name]
    assert found.counts.tolist() == [[1000 - 2 * right, 0], [right, right]]


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_faces_and_the_names_of_classes_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    found, renumbered, renamed = counted(meshes(seed)), Confusion(4), Confusion(4)
    order, classes = rng.permutation(FACES), rng.permutation(4)
    new_number = np.append(np.argsort(order), -1)
    for truth, predicted, areas, adjacency in meshes(seed):
        renumbered.add(truth[order], predicted[order], areas[order], new_number[adjacency][order])
        renamed.add(np.where(truth < 0, -1, classes[truth]), classes[predicted], areas, adjacency)
    assert renumbered.summary() == pytest.approx(found.summary())
    assert renamed.summary() == pytest.approx(found.summary())
    for name, values in found.of_classes().items():
        assert np.array(renamed.of_classes()[name])[classes] == pytest.approx(values)


@pytest.mark.parametrize("size", [1, 2, 4])
def test_parts_merged_are_the_whole(size):
    examples = list(meshes(7, count=9))
    parts = [counted(examples[start : start + size]) for start in range(0, 9, size)]
    total = parts[-1]
    for part in parts[:-1]:
        total.merge(part)
    assert total.summary()["mesh_accuracy"] == counted(examples).summary()["mesh_accuracy"]  # whatever the order
    assert figures(total) == same(figures(counted(examples)))


def test_unlabelled_faces_change_nothing():
    with_them, without = list(meshes(3)), Confusion(4)
    for truth, predicted, areas, adjacency in with_them:
        known = truth >= 0
        number = np.append(np.where(known, np.cumsum(known) - 1, -1), -1)
        without.add(truth[known], predicted[known], areas[known], number[adjacency][known])
    assert figures(counted(with_them)) == same(figures(without))
    other = [(truth, np.where(truth < 0, 3 - predicted, predicted), a, n) for truth, predicted, a, n in with_them]
    assert counted(other).summary() == counted(with_them).summary()


def test_mesh_accuracy_is_the_mean_over_meshes():
    found = counted([(np.zeros(10, int), np.zeros(10, int)), (np.zeros(2, int), np.array([0, 1]))], 2)
    assert found.summary()["mesh_accuracy"] == 0.75
    assert found.accuracy() == pytest.approx(11 / 12)


def test_nothing_counted_is_not_a_number():
    assert all(isnan(value) for value in Confusion(3).summary().values())
    assert all(isnan(value) for values in Confusion(3).of_classes().values() for value in values)


def edges_of(faces):
    """Edge -> the faces that have it."""
    found = {}
    for number, face in enumerate(faces.tolist()):
        for i in range(3):
            found.setdefault(frozenset((face[i], face[(i + 1) % 3])), []).append(number)
    return found


def adjacency_of(faces):
    """As a shard has it: the face across each edge, -1 unless there is exactly one."""
    edges, across = edges_of(faces), np.full(faces.shape, -1)
    for number, face in enumerate(faces.tolist()):
        for i in range(3):
            others = [other for other in edges[frozenset((face[i], face[(i + 1) % 3]))] if other != number]
            across[number, i] = others[0] if len(others) == 1 else -1
    return across


MANIFOLD = [name for name in FAMILY if max(map(len, edges_of(FAMILY[name][1]).values())) <= 2]


@pytest.mark.parametrize("name", MANIFOLD)
def test_edge_accuracy_is_meshcnns_over_its_own_edges(name):
    """MeshCNN's edges, areas and soft labels by plain loops; an edge between two predictions takes each in proportion
    to the area of its face."""
    _, faces = FAMILY[name]
    rng = np.random.default_rng(0)
    truth, predicted, areas = rng.integers(0, 3, len(faces)), rng.integers(0, 3, len(faces)), rng.random(len(faces))
    right = weight = 0.0
    for of_edge in edges_of(faces).values():
        edge_area = sum(areas[face] / 3 for face in of_edge)
        soft_labels = {int(truth[face]) for face in of_edge}
        chance = {face: areas[face] / 3 / edge_area for face in of_edge}
        right += edge_area * sum(chance[face] for face in of_edge if int(predicted[face]) in soft_labels)
        weight += edge_area
    found = counted([(truth, predicted, areas, adjacency_of(faces))], 3).summary()
    assert weight == pytest.approx(areas.sum())
    assert found["edge_accuracy"] == pytest.approx(right / weight)
    assert found["edge_accuracy"] > found["area_accuracy"]


@pytest.mark.parametrize("name", FAMILY)
def test_edges_forgive_a_border_that_is_off_by_a_face(name):
    _, faces = FAMILY[name]
    across, truth, areas = adjacency_of(faces), np.zeros(len(faces), dtype=int), np.ones(len(faces))
    truth[0] = 1
    for predicted, wrong in ((truth, 0), (1 - truth, 3 * len(faces) - 2 * (across[0] >= 0).sum())):
        found = counted([(truth, predicted, areas, across)], 2).summary()["edge_accuracy"]
        assert found == pytest.approx(1 - wrong / (3 * len(faces)))
    grown = np.where(np.isin(np.arange(len(faces)), across[0]), 1, truth)
    wrong = sum((across[face] >= 0).sum() - 1 + (across[face] < 0).sum() for face in across[0] if face >= 0)
    found = counted([(truth, grown, areas, across)], 2).summary()["edge_accuracy"]
    assert found == pytest.approx(1 - wrong / (3 * len(faces)))


def test_edges_are_averaged_over_meshes_that_have_labels():
    alone = np.full((1, 3), -1)
    examples = [(np.array([0]), np.array([p]), np.array([a]), alone) for p, a in ((0, 1.0), (1, 100.0), (0, 1.0))]
    examples.append((np.array([-1]), np.array([0]), np.array([5.0]), alone))
    assert counted(examples, 2).summary()["edge_accuracy"] == pytest.approx(2 / 3)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({"epoch": 3, "val_accuracy": 0.5, "val_mean_iou": 0.4, "judged_by": "val_accuracy"}, "val accuracy, raw"),
        (
            {
                "test_accuracy": 0.4,
                "test_mean_iou": 0.3,
                "test_voted_accuracy": 0.5,
                "judged_by": "test_voted_accuracy",
            },
            "test accuracy, voted (published protocol: epoch chosen on TEST)",
        ),
        ({"loss": 1.0, "val_mean_error": 0.1, "judged_by": "val_mean_error"}, "val mean error"),
        (
            {"test_accuracy": 0.5, "judged_by": "test_accuracy"},
            "test accuracy, raw (published protocol: epoch chosen on TEST)",
        ),
    ],
)
def test_what_an_epoch_is_judged_by_is_named_with_its_split(row, words):
    protocol = PUBLISHED_PROTOCOL if PUBLISHED_PROTOCOL in words else "epoch chosen on validation"
    assert judged(row | {"protocol": protocol}) == (words, row[row["judged_by"]])
