"""How right a network is on a split: raw, and after voting."""

from collections.abc import Sequence
from dataclasses import dataclass

from meshshard_train.config import VOTED
from meshshard_train.loading import Meshes
from meshshard_train.metrics import FIGURES, Confusion
from meshshard_train.model import TaskDrivenNet
from meshshard_train.predict import predictions
from meshshard_train.tasks import areas_of, labels_of
from meshshard_train.team import Team
from meshshard_train.voting import elected

VOTING_ROUNDS = (0, 1, 2, 3, 5, 8, 12, 20)
"""Rounds among which the validation split chooses."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Results of one split: raw, and voted by rounds. Classification has no faces to vote and only `raw`."""

    task: str
    raw: Confusion
    voted: dict[int, Confusion]

    def best_rounds(self) -> int:
        """Rounds with the highest accuracy, the fewest of equals; 0 when raw is best."""
        return max(self.voted, key=lambda rounds: (self.voted[rounds].accuracy(), -rounds), default=0)

    def kinds(self, rounds: int) -> dict[str, Confusion]:
        """What was counted: "raw", and "voted" where there is voting."""
        return {"raw": self.raw} | ({"voted": self.voted[rounds]} if self.voted else {})

    def row(self, rounds: int) -> dict[str, float]:
        """The task's FIGURES: raw ones, and voted ones with the prefix `voted_`."""
        row: dict[str, float] = {}
        for kind, confusion in self.kinds(rounds).items():
            summary = confusion.summary()
            row |= {("voted_" if kind == "voted" else "") + name: summary[name] for name in FIGURES[self.task]}
        return row


def evaluate(
    network: TaskDrivenNet,
    meshes: Meshes,
    numbers: Sequence[int],
    rounds: Sequence[int] = VOTING_ROUNDS,
    team: Team = Team(),
) -> Evaluation:
    """Predict every sample of `numbers` and count; the processes of a team share the work, and all get the result."""
    dataset, task = meshes.dataset, meshes.config.task
    raw = Confusion(len(dataset.classes))
    voted = {count: Confusion(len(dataset.classes)) for count in rounds} if task in VOTED else {}
    for number, labels, probabilities in predictions(network, meshes, team.share(numbers)):
        sample = dataset[number]
        truth, areas = labels_of(sample, task), areas_of(sample, task)
        adjacency = sample.face_adjacency if task == "segmentation" else None
        raw.add(truth, labels, areas, adjacency)
        if voted:
            counts = sorted(voted)
            for count, chosen in zip(
                counts, elected(labels, probabilities, sample, meshes.config, counts), strict=True
            ):
                voted[count].add(truth, chosen, areas, adjacency)
    total, *others = team.gather(Evaluation(task=task, raw=raw, voted=voted))
    for other in others:
        total.raw.merge(other.raw)
        for count, confusion in total.voted.items():
            confusion.merge(other.voted[count])
    return total
