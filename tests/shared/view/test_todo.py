"""What is done first."""

import threading

import pytest

from meshshard.view.todo import Todo


def test_the_most_urgent_is_done_first_and_new_work_of_a_kind_replaces_the_old():
    done, todo = [], Todo("draw", "judge")

    def work(name, count):
        for number in range(count):
            done.append(f"{name}{number}")
            yield

    todo.want("judge", work("old", 5))
    todo.step()
    todo.want("judge", work("new", 2))
    todo.want("draw", work("draw", 1))
    for _ in range(5):  # two of them find their work finished
        todo.step()
    assert done == ["old0", "draw0", "new0", "new1"]


def test_what_fails_ends_its_work_and_others_go_on():
    done, todo = [], Todo("draw", "judge")

    def failing():
        yield
        raise OSError("gone")

    todo.want("draw", failing())
    todo.want("judge", iter([None]))
    todo.step()
    with pytest.raises(OSError, match="gone"):
        todo.step()
    todo.step()
    done.append("judge")
    assert done == ["judge"]


def test_a_step_waits_until_something_is_wanted():
    todo, done = Todo("draw"), threading.Event()

    def work():
        done.set()
        yield

    thread = threading.Thread(target=todo.step)
    thread.start()
    assert not done.wait(0.05)
    todo.want("draw", work())
    thread.join(5)
    assert done.is_set()
