"""How training tells where it is."""

from meshshard_train.commands import progress as told
from meshshard_train.commands.progress import progress_bar
from meshshard_train.config import PUBLISHED_PROTOCOL
from meshshard_train.loop import Progress

BAR = told.Bar
ROW = {"epoch": 0, "loss": 1.5, "learning_rate": 2e-3, "test_accuracy": 0.25, "test_voted_accuracy": 0.5}
ROW |= {
    "score": 0.5,
    "judged_by": "test_voted_accuracy",
    "protocol": PUBLISHED_PROTOCOL,
    "seconds": 3.0,
    "waited": 0.01,
}
JUDGED = "test accuracy, voted 50.00 % (published protocol: epoch chosen on TEST)"


def at(epoch, meshes, history):
    return Progress(epoch=epoch, meshes=meshes, loss=0.25, learning_rate=1e-3, history=history)


def test_lines_are_of_the_epochs_done_now(capsys):
    with progress_bar(3, 10) as tell:
        for where in (at(1, 0, [ROW]), at(1, 5, [ROW]), at(2, 0, [ROW, ROW | {"epoch": 1}])):
            tell(where)
    line = "epoch 1  loss 1.5000  rate 2.00e-03  " + JUDGED + "  3.0 s\n"
    assert capsys.readouterr() == ("", line)


def test_a_terminal_gets_a_bar_that_starts_where_the_run_goes_on(monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    bars = []
    monkeypatch.setattr(told, "Bar", lambda *a, **k: bars.append(BAR(*a, **k)) or bars[0])
    with progress_bar(3, 10) as tell:
        tell(at(1, 0, [ROW]))
        assert bars[0].tasks[0].completed == 10
        assert bars[0].tasks[0].speed is None  # what was done before is not done in no time
        tell(at(1, 5, [ROW]))
        tell(at(3, 0, [ROW] * 3))
    (task,) = bars[0].tasks
    assert (task.completed, task.total) == (30, 30)
    start, end = "epoch 3/3, loss 0.250, rate 1.0e-03, ", " meshes/s, " + JUDGED
    assert task.description.startswith(start)
    assert task.description.endswith(end)
    assert capsys.readouterr().out == ""
