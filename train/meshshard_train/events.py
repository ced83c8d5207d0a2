"""The history of a run as events that TensorBoard shows."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from torch.utils.tensorboard import SummaryWriter

from meshshard_train.loop import Progress

FOLDER = "tensorboard"
OF_TRAINING = ("loss", "learning_rate", "waited")


class Events:
    """Keeps RUN/tensorboard equal to the history: called with where training is, it writes the epochs that are new.

    The first call replaces the events that are there, for a killed run may have written fewer epochs than it ended,
    or more than it goes on from; the history has them all. Figures of a split get its name as a group: val/accuracy.
    """

    def __init__(self, run: Path) -> None:
        self.folder, self.written = run / FOLDER, 0
        self.writer: SummaryWriter | None = None

    def __call__(self, progress: Progress) -> None:
        """Write what is new of the history, and have it in the file when this returns."""
        if self.writer is None:
            for old in self.folder.glob("events.out.tfevents.*"):
                old.unlink()
            self.writer = SummaryWriter(str(self.folder), purge_step=0)  # a TensorBoard that is open forgets the old
        self._write(self.writer, progress.history[self.written :])
        self.written = len(progress.history)

    def _write(self, writer: SummaryWriter, rows: Sequence[dict[str, Any]]) -> None:
        ended = time.time() - sum(row["seconds"] for row in rows)
        if rows and not self.written:
            writer.add_text("protocol", rows[0]["protocol"])
        for row in rows:
            ended += row["seconds"]
            values = {name: row[name] for name in OF_TRAINING}
            of_split = [name for name in row if name.startswith(("val_", "test_"))]
            values |= {name.replace("_", "/", 1): row[name] for name in of_split}
            for name, value in values.items():
                writer.add_scalar(name, value, row["epoch"], ended)
        if rows:
            writer.flush()

    def close(self) -> None:
        """End the file."""
        if self.writer is not None:
            self.writer.close()
