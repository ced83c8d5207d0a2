"""Figures of recorded trainings, put together by line: every run, mean and deviation, in %."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from meshshard_train.reproduce.experiments import Line, Table
from meshshard_train.reproduce.trials import PROTOCOLS, RUNS, record_of, trials_of

PROTOCOL_FIGURES = {"honest": ("accuracy", "voted_accuracy"), "published": ("voted_accuracy",)}
"""Protocol -> what is shown of it; classification has no voting, and its accuracy is shown."""


@dataclass(frozen=True, kw_only=True)
class Runs:
    """The recorded runs of a line under one protocol, by seed."""

    line: Line
    protocol: str
    records: tuple[dict[str, Any], ...]

    def values(self, figure: str, split: str = "test") -> list[float]:
        """One figure of every run, in %; none where it is not there."""
        rows = [record["results"]["rows"].get(split, {}) for record in self.records]
        return [100 * row[figure] for row in rows if row.get(figure) is not None]

    @property
    def goal(self) -> float | None:
        """What was wanted."""
        return self.line.published_goal if self.protocol == "published" else self.line.honest_goal

    @property
    def figure(self) -> str:
        """The one that the goal is of: voted where there is voting."""
        return "voted_accuracy" if self.values("voted_accuracy") else "accuracy"


def runs_of(folder: Path, table: Table) -> list[dict[str, Runs]]:
    """For each line its recorded runs by protocol."""
    seeds = dict.fromkeys(PROTOCOLS, _seeds_in(folder))

    def runs(line: Line, protocol: str) -> Runs:
        records = (record_of(folder, trial) for trial in trials_of(line, (protocol,), seeds))
        return Runs(line=line, protocol=protocol, records=tuple(filter(None, records)))

    return [{protocol: runs(line, protocol) for protocol in PROTOCOLS} for line in table.lines]


def _seeds_in(folder: Path) -> int:
    """Seeds are looked for from 0 on up to the highest of any record."""
    names = [re.search(r"seed=(\d+)$", path.stem) for path in (folder / RUNS).glob("*.json")]
    return max((int(name[1]) + 1 for name in names if name), default=0)


def mean_and_deviation(values: Sequence[float]) -> str:
    """As 90.12 ± 0.34 (3); the deviation is that of the sample, and a dash stands for no run."""
    if not values:
        return "-"
    if len(values) == 1:
        return f"{values[0]:.2f} (1)"
    return f"{fmean(values):.2f} ± {stdev(values):.2f} ({len(values)})"
