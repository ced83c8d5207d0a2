"""How right a network is on a split: raw, and after voting."""

from collections.abc import Sequence
from dataclasses import dataclass

from meshshard import UsageError
from meshshard_train.loading import Meshes
from meshshard_train.metrics import Confusion
from meshshard_train.model import TaskDrivenNet
from meshshard_train.predict import predictions
from meshshard_train.tasks import areas_of, labels_of
from meshshard_train.team import Team
from meshshard_train.voting import vote

VOTING_ROUNDS = (0, 1, 2, 3, 5, 8, 12, 20)
"""Rounds among which the validation split chooses."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Results of one split: raw, and voted by rounds. Classification has no faces to vote and only `raw`."""

    raw: Confusion
    voted: dict[int, Confusion]

    def best_rounds(self) -> int:
        """Rounds with the highest accuracy, the fewest of equals; 0 when raw is best."""
        return max(self.voted, key=lambda rounds: (self.voted[rounds].accuracy(), -rounds), default=0)

    def row(self, rounds: int) -> dict[str, float]:
        """One row of the results table: raw figures, and voted ones with the prefix; accuracy alone where there are
        no faces to weigh or to vote."""
        if not self.voted:
            return {"accuracy": self.raw.accuracy()}
        voted = self.voted[rounds]
        return self.raw.summary() | {f"voted_{name}": value for name, value in voted.summary().items()}


def evaluate(
    network: TaskDrivenNet,
    meshes: Meshes,
    numbers: Sequence[int],
    rounds: Sequence[int] = VOTING_ROUNDS,
    team: Team = Team(),
) -> Evaluation:
    """Predict every sample of `numbers` and count; the processes of a team share the work, and all get the result.
    UsageError for an empty split."""
    dataset, task = meshes.dataset, meshes.config.task
    if not numbers:
        raise UsageError(f"{dataset.folder}: the split to evaluate is empty; there are {', '.join(dataset.splits)}")
    raw = Confusion(len(dataset.classes))
    voted = {count: Confusion(len(dataset.classes)) for count in rounds} if task != "classification" else {}
    for number, labels, _ in predictions(network, meshes, team.share(numbers)):
        sample = dataset[number]
        truth, areas = labels_of(sample, task), areas_of(sample, task)
        raw.add(truth, labels, areas)
        done = 0
        for count in sorted(voted):
            labels, done = vote(labels, sample.faces, count - done), count
            voted[count].add(truth, labels, areas)
    total, *others = team.gather(Evaluation(raw=raw, voted=voted))
    for other in others:
        total.raw.merge(other.raw)
        for count, confusion in total.voted.items():
            confusion.merge(other.voted[count])
    return total
