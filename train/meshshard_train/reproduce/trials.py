"""The trainings that a table is made of: each is done once, recorded in a JSON file, and not done again."""

import json
import platform
import shlex
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from meshshard import Dataset, UsageError, __version__, open_dataset
from meshshard.files import publish
from meshshard.machine import processor
from meshshard.plain import to_json
from meshshard_train.config import VOTED, TrainConfig
from meshshard_train.recipes import RECIPES
from meshshard_train.reproduce.experiments import Data, Line

PROTOCOLS = ("honest", "published")
"""Honest: epoch and rounds of voting are chosen on validation, and test is looked at once. Published: the best epoch
on TEST, after voting, of a training on train and validation together."""
PUBLISHED: dict[str, Any] = {"selection": "test", "voting_rounds": 3, "votes_itself": False}
"""Three rounds, in which a face's own class has no vote, as published for human bodies."""
RUNS = "runs"
"""Where records are, in the folder of results."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One training."""

    data: Data
    recipe: str
    settings: tuple[tuple[str, Any], ...]
    protocol: str
    seed: int

    @property
    def name(self) -> str:
        """Of its record and of its run: all that it depends on."""
        settings = [f"{name}={_word(value)}" for name, value in self.settings]
        return "-".join([self.data.label, self.recipe, *settings, self.protocol, f"seed={self.seed}"])

    @property
    def split_seed(self) -> int:
        """Of the splits that are drawn."""
        return self.seed if self.data.drawn else 0

    def config(self, task: str) -> TrainConfig:
        """The settings of its training."""
        return RECIPES[self.recipe](task, **self._own(task))

    def train_command(self, task: str, shards: Path) -> list[str]:
        """The arguments of `meshshard` that train alike."""
        texts = [f"{name}={_word(value, ',')}" for name, value in self._own(task).items()]
        return ["train", str(shards), "--recipe", self.recipe, *(word for text in texts for word in ("--set", text))]

    def _own(self, task: str) -> dict[str, Any]:
        own = dict(self.settings) | {"seed": self.seed}
        if self.protocol == "published":
            own |= PUBLISHED if task in VOTED else {"selection": "test"}
        return own

    def prepare_command(self, raw: Path, out: Path) -> list[str]:
        """The arguments of `meshshard` that make its shards."""
        drawn = ["--split-seed", str(self.split_seed)]
        where = ["--raw", str(raw / self.data.raw)] if self.data.raw else []
        copies = ["--deformed", str(self.data.deformed)] if self.data.deformed else []
        recipe = ["--recipe", self.data.features, *copies]
        return ["features", self.data.name, *where, *recipe, *drawn, "--out", str(out)]


def trials_of(line: Line, protocols: tuple[str, ...], seeds: dict[str, int]) -> Iterator[Trial]:
    """Of each protocol, so many seeds from 0 on."""
    settings = tuple(sorted(line.settings.items()))
    for protocol in protocols:
        for seed in range(seeds[protocol]):
            yield Trial(data=line.data, recipe=line.recipe, settings=settings, protocol=protocol, seed=seed)


def all_trials(lines: Sequence[Line], protocols: tuple[str, ...], seeds: dict[str, int]) -> list[Trial]:
    """Of some lines; the first seed of all, then the second, so that a stopped table has all of its lines."""
    found = [trial for line in lines for trial in trials_of(line, protocols, seeds)]
    return sorted(dict.fromkeys(found), key=lambda trial: trial.seed)


def shards_of(trial: Trial, raw: Path, folder: Path) -> Path:
    """Its shards, made or brought up to date by `meshshard features` in a process of its own. UsageError: it made
    none, or not of all meshes, or says that they are not those that were published."""
    out = folder / f"{trial.data.label}-split-{trial.split_seed}"
    command = trial.prepare_command(raw, out)
    done = subprocess.run(
        [sys.executable, "-m", "meshshard", *command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    if done.returncode:
        raise UsageError(f"meshshard {shlex.join(command)}: {done.stderr.strip()}")
    if notes := open_dataset(out).index.notes:
        raise UsageError(
            f"{trial.data.name} in {raw / trial.data.raw} is not the data that was published: {'; '.join(notes)}. "
            "Its figures would not be comparable: put the missing meshes there"
        )
    return out


def record_of(folder: Path, trial: Trial) -> dict[str, Any] | None:
    """What is recorded of a training, None if nothing. UsageError: it is no record of it, or of settings that the
    recipe had then and has no more."""
    path = folder / RUNS / f"{trial.name}.json"
    if not path.exists():
        return None
    try:
        record: dict[str, Any] = json.loads(path.read_bytes())
        if record["name"] != trial.name:
            raise UsageError(f"it is that of {record['name']}")
        config = TrainConfig.from_json(json.dumps(record["results"]["config"]))
        if changed := config.differences(trial.config(config.task)):
            raise UsageError(f"settings have changed since, {'; '.join(changed)}")
    except UsageError as error:
        why = str(error)
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        why = repr(error)
    else:
        return record
    raise UsageError(f"{path} is no record of this training ({why}): delete it, and the training is done again")


def write_record(
    folder: Path, trial: Trial, dataset: Dataset, results: dict[str, Any], commands: list[str], hardware: str
) -> None:
    """Publish the record of a training. `results`: its results.json."""
    record = {
        "name": trial.name,
        "protocol": trial.protocol,
        "seed": trial.seed,
        "split_seed": trial.split_seed,
        "commands": commands,
        "hours": results["seconds"] / 3600,
        "hardware": f"{hardware}; {processor()}",
        "versions": {"meshshard": __version__, "python": platform.python_version(), "torch": version("torch")},
        "meshes": {split: len(numbers) for split, numbers in dataset.splits.items()},
        "shards_sha256": [shard.sha256 for shard in dataset.index.shards],
        "results": results,
    }
    (folder / RUNS).mkdir(parents=True, exist_ok=True)
    publish(folder / RUNS / f"{trial.name}.json", to_json(record).encode() + b"\n")


def _word(value: object, between: str = "+") -> str:
    return between.join(map(str, value)) if isinstance(value, tuple) else str(value)
