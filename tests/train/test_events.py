"""What TensorBoard reads of a run."""

import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.backend.event_processing.event_file_loader import EventFileLoader

from meshshard_train.events import Events
from meshshard_train.loop import Progress


def row(epoch, loss):
    figures = {
        "val_accuracy": 0.1 * epoch,
        "val_mean_iou": 0.5,
        "score": 0.1 * epoch,
        "judged_by": "val_accuracy",
        "protocol": "honest",
    }
    return {"epoch": epoch, "loss": loss, "learning_rate": 1e-3, **figures, "seconds": 2.0, "waited": 0.25}


def tell(events, history):
    events(Progress(epoch=len(history), meshes=0, loss=1.0, learning_rate=1e-3, history=history))


def stored(run):
    """(tag, epoch, value) of all event files, as they are."""
    events = [e for path in sorted((run / "tensorboard").iterdir()) for e in EventFileLoader(str(path)).Load()]
    values = [(event.step, value) for event in events for value in event.summary.value]
    return [(v.tag, step, round(v.tensor.float_val[0], 5)) for step, v in values if v.tensor.float_val]


def test_every_epoch_is_there_once_whatever_was_killed(tmp_path):
    """The first process was killed after epoch 2, and the second goes on from epoch 1; another writes nothing new."""
    killed = Events(tmp_path)
    history = []
    for epoch in range(3):
        tell(killed, history)
        history = [*history, row(epoch, 5 - epoch)]
        tell(killed, history)
    resumed = Events(tmp_path)
    for loss in (1.0, 0.5):
        tell(resumed, history[:2])
        history[2:] = [row(2, loss)]
    tell(resumed, history)
    resumed.close()
    again = Events(tmp_path)
    tell(again, history)
    again.close()
    losses = [(step, value) for tag, step, value in stored(tmp_path) if tag == "loss"]
    assert losses == [(0, 5.0), (1, 4.0), (2, 0.5)]
    killed.close()


def test_tensorboard_finds_all_figures_at_the_time_of_their_epoch(tmp_path):
    events = Events(tmp_path)
    tell(events, [row(0, 3.0), row(1, 2.0)])
    events.close()
    reader = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    found = {tag: reader.Scalars(tag) for tag in reader.Tags()["scalars"]}
    assert set(found) == {"loss", "learning_rate", "waited", "val/accuracy", "val/mean_iou"}
    (said,) = reader.Tensors("protocol/text_summary")
    assert said.tensor_proto.string_val == [b"honest"]
    first, second = found["val/accuracy"]
    assert (second.step, second.value) == (1, pytest.approx(0.1))
    assert second.wall_time - first.wall_time == pytest.approx(2.0, abs=1e-3)
