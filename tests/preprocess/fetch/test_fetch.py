"""The verb, from a server on this machine or from files, to raw files that `features` reads."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from archives import coseg, files_below, human_seg, placed, shrec_16, tar_of, zip_of
from http_server import content, status

from meshshard import cli
from meshshard.errors import UsageError
from meshshard.files import lock_folder
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import ADAPTERS, read_dataset
from meshshard_prep.fetch import fetch as fetching
from meshshard_prep.fetch.record import RECORD_NAME
from meshshard_prep.fetch.source import Archive, Source
from meshshard_prep.fetch.sources import SOURCES
from meshshard_prep.run import run as compute

RAW = Path("data/raw/human_seg")
PAGE = "http://127.0.0.1/page"


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """Call the program in an empty folder: exit status, standard output, standard error."""
    (tmp_path / "cwd").mkdir()
    monkeypatch.chdir(tmp_path / "cwd")

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["meshshard", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        told = capsys.readouterr()
        return ended.value.code, told.out, told.err

    return call


@pytest.fixture
def members(tmp_path):
    return human_seg(tmp_path / "human_seg")


@pytest.fixture
def publish(server, monkeypatch):
    """Make answers of the server the source of a data set; gives the URL."""

    def put(*answers, name="human_seg", holds="train", **known):
        url = server.answer(f"/{name}.zip", *answers)
        archive = Archive(file=f"{name}.zip", url=url, holds=holds, **known)
        monkeypatch.setitem(SOURCES, name, Source(page=PAGE, read_in="a test", archives=(archive,)))
        return url

    return put


def nothing_is_left():
    return not RAW.exists() and list(RAW.parent.iterdir()) == []


def test_from_the_server_to_features(run, publish, members):
    url = publish(content(tar_of([(f"human_seg/{name}", data) for name, data in members])))
    code, out, error = run("fetch", "human_seg", "--yes")
    assert code == 0
    assert (
        out
        == "human_seg: 3 train, 1 test meshes, 8 classes -> data/raw/human_seg\nnext: meshshard features human_seg\n"
    )
    for words in (ADAPTERS["human_seg"].licence, ADAPTERS["human_seg"].citation, PAGE, f"from: {url}", f"to: {RAW}"):
        assert words in error
    assert "note: human_seg has 381 train meshes, and 3 were found\n" in error
    found = files_below(RAW)
    (record,) = json.loads(found.pop(RECORD_NAME))["archives"]
    assert found == dict(members)
    assert (record["url"], record["file"]) == (url, "human_seg.zip")
    assert list(RAW.parent.iterdir()) == [RAW]
    report = compute(read_dataset("human_seg"), Path("shards"), RECIPES["paper"], jobs=1)
    assert (len(report.index.ids), report.index.refused, report.index.failed) == (4, (), ())


def test_fetched_once_it_is_there(run, publish, server, members):
    publish(content(zip_of(members)))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    code, out, error = run("fetch", "human_seg")
    assert (code, error) == (0, "")
    assert out == "data/raw/human_seg is there already, and nothing was loaded; --force fetches it again\n"
    assert len(server.requests) == 1


def test_json(run, publish, members):
    publish(content(zip_of(members)), size=5)
    code, out, _ = run("fetch", "human_seg", "--yes", "--json")
    table = json.loads(out)
    assert code == 0
    assert table["meshes"] == {"train": 3, "test": 1}
    assert (table["name"], table["folder"], table["fetched"]) == ("human_seg", str(RAW), True)
    assert table["archives"][0]["bytes"] == len(zip_of(members))
    assert table["notes"][0].endswith("bytes, where 5 were published")
    table = json.loads(run("fetch", "human_seg", "--json")[1])
    assert table == {"name": "human_seg", "folder": str(RAW), "fetched": False}


def test_nothing_is_loaded_before_the_conditions_are_accepted(run, publish, server, members, monkeypatch):
    publish(content(zip_of(members)))
    code, _, error = run("fetch", "human_seg")
    assert code == 2
    assert "error: nobody is here to accept these conditions: type the same command with --yes\n" in error
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("typer.confirm", lambda *_arguments, **_options: False)
    assert run("fetch", "human_seg")[0::2] == (
        2,
        error.split("error:")[0] + "error: not accepted; nothing was loaded\n",
    )
    assert not Path("data").exists()
    assert server.requests == []
    monkeypatch.setattr("typer.confirm", lambda *_arguments, **_options: True)
    assert run("fetch", "human_seg")[0] == 0


def test_an_archive_that_was_downloaded_by_hand(run, members, tmp_path):
    file = zip_of(members, tmp_path / "human_seg (1).zip")
    code, out, _ = run("fetch", "human_seg", "--yes", "--archive", file, "--out", "elsewhere")
    assert code == 0
    assert out.endswith(f"next: meshshard features human_seg --raw {Path('elsewhere').resolve()}\n")
    (record,) = json.loads((Path("elsewhere") / RECORD_NAME).read_text())["archives"]
    assert record["url"] == ""
    assert len(read_dataset("human_seg", Path("elsewhere")).entries) == 4
    assert file.exists()


def test_archives_in_several_parts(run, members, tmp_path, monkeypatch):
    source = Source(
        page=PAGE, read_in="a test", archives=(Archive(file="a.zip", holds="train"),), by_hand="download it"
    )
    monkeypatch.setitem(SOURCES, "human_seg", source)
    parts = [zip_of(members[number::2], tmp_path / f"a-{number}.zip") for number in range(2)]
    assert run("fetch", "human_seg", "--yes", "--archive", parts[0], "--archive", parts[1])[0] == 0
    assert {name: data for name, data in files_below(RAW).items() if name != RECORD_NAME} == dict(members)
    code, _, error = run("fetch", "human_seg", "--yes", "--out", "b", "--archive", parts[0], "--archive", parts[0])
    assert code == 2
    assert "which another archive of the data set holds too" in error


def test_what_lies_elsewhere_is_put_beside(run, members, tmp_path, monkeypatch):
    archive = Archive(file="a.zip", holds="train", beside="seg")
    source = Source(page=PAGE, read_in="a test", archives=(archive,), by_hand="download both")
    monkeypatch.setitem(SOURCES, "human_seg", source)
    labels = [(f"repository/{name}", data) for name, data in members if name.startswith("seg/")]
    meshes = [(f"meshes/{name}", data) for name, data in members if not name.startswith("seg/")]
    files = [zip_of(meshes, tmp_path / "1.zip"), zip_of([*labels, ("repository/readme", b"")], tmp_path / "2.zip")]
    given = [word for file in files for word in ("--archive", file)]
    assert run("fetch", "human_seg", "--yes", *given)[0] == 0
    assert {name: data for name, data in files_below(RAW).items() if name != RECORD_NAME} == dict(members)
    error = run("fetch", "human_seg", "--yes", "--out", "b", *given[:2])[2]
    assert "a.zip is not what was published: no folder in it holds seg; found: nothing\n" in error
    assert run("fetch", "human_seg", "--yes", "--out", "c", "--archive", zip_of(members, tmp_path / "3.zip"))[0] == 0


def test_what_needs_a_browser_says_so(run, monkeypatch):
    archives = (Archive(file="a.zip", holds="train"), Archive(file="b.zip", holds="seg", into="seg"))
    source = Source(page=PAGE, read_in="a test", archives=archives, by_hand="mark both and download them")
    monkeypatch.setitem(SOURCES, "human_seg", source)
    code, _, error = run("fetch", "human_seg", "--yes")
    assert code == 2
    assert error == (
        f"error: a.zip and b.zip cannot be loaded by a program: open {PAGE}, mark both and download them, and type: "
        "meshshard fetch human_seg --archive a.zip --archive b.zip\n"
    )
    placed(b"", Path("b.zip"))
    error = run("fetch", "human_seg", "--archive", "b.zip")[2]
    assert error.endswith("and type: meshshard fetch human_seg --archive b.zip --archive a.zip\n")
    placed(b"", Path("c.zip"))
    assert "known by name: a.zip, b.zip" in run("fetch", "human_seg", "--archive", "c.zip")[2]
    assert "--archive d.zip is no file" in run("fetch", "human_seg", "--archive", "d.zip")[2]
    monkeypatch.setitem(SOURCES, "human_seg", Source(page=PAGE, read_in="a test", by_hand="type `7z x a.7z`"))
    assert f"has to be unpacked by hand: open {PAGE}, type `7z x a.7z`\n" in run("fetch", "human_seg")[2]


def test_two_archives_become_one_folder(run, server, members, monkeypatch, tmp_path):
    labels = [(f"labels/here/{name}", data) for name, data in members if name.startswith("seg/")]
    meshes = [(f"meshes/{name}", data) for name, data in members if not name.startswith("seg/")]
    archives = (
        Archive(
            file="m.zip", url=server.answer("/m.zip", content(zip_of([*meshes, ("readme", b"")]))), holds="train"
        ),
        Archive(file="s.zip", holds="*.eseg", into="seg"),
    )
    monkeypatch.setitem(SOURCES, "human_seg", Source(page=PAGE, read_in="a test", archives=archives, by_hand="go"))
    file = zip_of(labels, tmp_path / "s.zip")
    code, _, error = run("fetch", "human_seg", "--yes", "--archive", file)
    assert code == 0
    assert f"from: {archives[0].url}\n  from: {file}\n" in error
    assert "note: files of m.zip left out, for they lie beside the folder that is wanted: 1\n" in error
    assert {name: data for name, data in files_below(RAW).items() if name != RECORD_NAME} == dict(members)


@pytest.mark.parametrize(
    ("name", "make", "holds", "meshes"),
    [
        ("shrec_16", shrec_16, "*/train", 4),
        ("coseg", coseg, "coseg_*/train", 6),
        ("coseg_chairs", coseg, "coseg_*/train", 2),
    ],
)
def test_the_record_does_not_disturb_adapters(run, tmp_path, name, make, holds, meshes):
    assert SOURCES[name].archives[0].holds == holds
    items = make(tmp_path / name)
    file = zip_of([(f"outer/inner/{item}", data) for item, data in items], tmp_path / "x.zip")
    assert run("fetch", name, "--yes", "--archive", file)[0] == 0
    folder = Path("data/raw") / name
    assert (folder / RECORD_NAME).is_file()
    assert len(read_dataset(name).entries) == len(read_dataset(name, tmp_path / name).entries) == meshes
    assert read_dataset(name).classes == read_dataset(name, tmp_path / name).classes


def test_force_replaces_and_tells_what_changed(run, publish, members):
    old, new = zip_of(members), zip_of(members[1:])
    publish(content(old), content(old), content(new))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    (RAW / "note.txt").write_text("mine")
    assert "has changed" not in run("fetch", "human_seg", "--yes", "--force")[2]
    assert not (RAW / "note.txt").exists()
    error = run("fetch", "human_seg", "--yes", "--force")[2]
    assert f"note: human_seg.zip has changed since {time.strftime('%Y')}" in error
    assert not (RAW / members[0][0]).exists()


def test_force_deletes_nothing_that_fetch_did_not_make(run, publish, members):
    publish(content(zip_of(members)))
    RAW.mkdir(parents=True)
    (RAW / "mine.obj").write_text("v")
    assert "move it away" in run("fetch", "human_seg", "--yes", "--force")[2]
    (RAW / RECORD_NAME).write_text('{"archives": [{}]}')
    assert "is not what `meshshard fetch` writes" in run("fetch", "human_seg", "--yes", "--force")[2]
    assert (RAW / "mine.obj").exists()


def test_a_refused_replacement_leaves_the_old(run, publish, members):
    publish(content(zip_of(members)), content(zip_of([("../evil", b"")])))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    before = files_below(RAW)
    assert run("fetch", "human_seg", "--yes", "--force")[0] == 2
    assert files_below(RAW) == before
    assert list(RAW.parent.iterdir()) == [RAW]


@pytest.mark.parametrize(
    ("items", "message"),
    [
        ([("train/../../../evil", b"")], "leads outside"),
        (
            [("other/a.obj", b"")],
            "human_seg.zip is not what was published: no folder in it holds train; found: other",
        ),
        ([("train/readme", b"")], "what was unpacked is not human_seg: .* is not in MeshCNN's segmentation layout"),
        ([], "no folder in it holds train; found: nothing"),
    ],
)
def test_what_is_refused_leaves_nothing_and_is_loaded_anew(run, publish, server, members, items, message):
    publish(content(zip_of(items)), content(zip_of(members)))
    code, _, error = run("fetch", "human_seg", "--yes")
    assert code == 2
    assert re.search(message, error)
    assert nothing_is_left()
    assert run("fetch", "human_seg", "--yes")[0] == 0
    assert len(server.requests) == 2


def test_a_wrong_hash_is_refused_by_hand_too(run, publish, members, tmp_path):
    publish(content(zip_of(members)), sha256="0" * 64)
    assert "not what was published, whose sha256 is 000" in run("fetch", "human_seg", "--yes")[2]
    file = zip_of(members, tmp_path / "x.zip")
    assert "where 0000" in run("fetch", "human_seg", "--yes", "--archive", file)[2]
    assert not RAW.exists()


def test_a_dead_link_says_what_to_do(run, publish):
    url = publish(status(404))
    code, _, error = run("fetch", "human_seg", "--yes")
    assert code == 2
    assert error.endswith(
        f"error: {url} is not there for a program: the server says 404 Not Found. Try again later; or open {PAGE}, "
        "download the archive with a browser, save it as human_seg.zip, and type: "
        "meshshard fetch human_seg --archive human_seg.zip\n"
    )
    assert nothing_is_left()


def test_a_dead_link_costs_no_other_archive(run, server, members, monkeypatch):
    labels = [(name, data) for name, data in members if name.startswith("seg/")]
    meshes = [(name, data) for name, data in members if not name.startswith("seg/")]
    answers = {"m": [content(zip_of(meshes)), status(500)], "s": [status(404), content(zip_of(labels))]}
    archives = tuple(
        Archive(file=f"{name}.zip", url=server.answer(f"/{name}.zip", *answers[name]), holds=holds, into=into)
        for name, holds, into in (("m", "train", ""), ("s", "*.eseg", "seg"))
    )
    monkeypatch.setitem(SOURCES, "human_seg", Source(page=PAGE, read_in="a test", archives=archives))
    assert run("fetch", "human_seg", "--yes")[0] == 2
    assert run("fetch", "human_seg", "--yes")[0] == 0
    assert [path for path, _ in server.requests] == ["/m.zip", "/s.zip", "/s.zip"]


def test_a_break_is_gone_on_with_by_the_next_call(run, publish, server, members):
    data = zip_of(members)
    publish(content(data, cut=1000), status(404))
    assert run("fetch", "human_seg", "--yes")[0] == 2
    publish(content(data))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    assert server.requests[-1][1]["Range"] == "bytes=1000-"
    assert list(RAW.parent.iterdir()) == [RAW]


def test_a_full_disk_leaves_nothing_half(run, publish, members, monkeypatch):
    publish(content(zip_of(members)))
    original = Path.open

    def full(path, mode="r", *arguments, **options):
        if mode == "xb" and path.suffix == ".eseg":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return original(path, mode, *arguments, **options)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", full)
        code, _, error = run("fetch", "human_seg", "--yes")
    assert code == 2
    assert "No space left on device" in error
    assert not RAW.exists()
    assert run("fetch", "human_seg", "--yes")[0] == 0


def test_interrupted_it_goes_on(run, publish, members, server, monkeypatch):
    publish(content(zip_of(members)))

    def interrupted(*_arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(fetching, "unpack", interrupted)
        code, _, error = run("fetch", "human_seg", "--yes")
    assert code == 2
    assert "stopped; what was loaded is kept in data/raw/.fetch-human_seg: the same command goes on" in error
    assert run("fetch", "human_seg", "--yes")[0] == 0
    assert len(server.requests) == 1


def test_two_at_once(run, publish, members, server):
    publish(content(zip_of(members)))
    with lock_folder(fetching.working_folder(RAW)):
        code, _, error = run("fetch", "human_seg", "--yes")
    assert code == 2
    assert f"another run is writing to data/raw/.fetch-human_seg: process {os.getpid()}" in error
    assert server.requests == []


def test_the_one_that_waited_finds_it_there(run, publish, members, server, monkeypatch):
    publish(content(zip_of(members)))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    monkeypatch.setattr(fetching, "is_there", lambda _folder: True)
    done = fetching.fetch("human_seg", SOURCES["human_seg"], RAW, lambda *_words: None)
    assert done is None
    assert list(RAW.parent.iterdir()) == [RAW]
    assert len(server.requests) == 1


class Killed(BaseException):
    """The end of the process, as far as one process can play it."""


@pytest.mark.parametrize("replaced", [False, True], ids=["anew", "replacing"])
def test_ended_at_any_call_the_folder_is_old_or_new_and_whole(publish, members, monkeypatch, run, replaced):
    names = {name for name, _ in members}
    publish(content(zip_of(members)))
    if replaced:
        assert run("fetch", "human_seg", "--yes")[0] == 0
        publish(content(zip_of([*members, ("train/new.txt", b"")])))
    wholes = [names, names | {"train/new.txt"}] if replaced else [None, names]
    step = calls = 0

    def counted(original):
        def call(*arguments, **options):
            nonlocal calls
            calls += 1
            if calls == step:
                raise Killed
            return original(*arguments, **options)

        return call

    finished = False
    while not finished:
        step, calls = step + 1, 0
        with monkeypatch.context() as patched:
            for name in ("rename", "replace", "mkdir", "unlink", "rmdir"):
                patched.setattr(os, name, counted(getattr(os, name)))
            try:
                fetching.fetch("human_seg", SOURCES["human_seg"], RAW, lambda *_words: None, replace=True)
                finished = True
            except Killed:
                there = set(files_below(RAW)) - {RECORD_NAME} if RAW.exists() else None
                back = fetching.working_folder(RAW) / fetching.REPLACED
                if there is None and back.exists():  # between two renames; the next call puts it back
                    there = set(files_below(back)) - {RECORD_NAME}
                assert there in wholes
    assert step > 15
    assert set(files_below(RAW)) == wholes[1] | {RECORD_NAME}
    assert list(RAW.parent.iterdir()) == [RAW]


def test_killed_between_two_renames_the_old_folder_comes_back(run, publish, members):
    publish(content(zip_of(members)))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    work = fetching.working_folder(RAW)
    work.mkdir()
    RAW.rename(work / fetching.REPLACED)
    assert run("fetch", "human_seg", "--yes")[1].endswith("--force fetches it again\n")
    assert len(read_dataset("human_seg").entries) == 4
    assert list(RAW.parent.iterdir()) == [RAW]


SLOW = """
import sys
from meshshard import cli
from meshshard_prep.fetch.source import Archive, Source
from meshshard_prep.fetch.sources import SOURCES
archive = Archive(file="a.zip", url=sys.argv[1], holds="train")
SOURCES["human_seg"] = Source(page="x", read_in="x", archives=(archive,))
sys.argv = ["meshshard", "fetch", "human_seg", "--yes"]
cli.main()
"""


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_a_slow_download_that_is_ended(server, members, run, end, monkeypatch):
    data = zip_of([*members, ("seg/large", os.urandom(200_000))])
    url = server.answer("/a.zip", content(data, pause=0.01))
    process = subprocess.Popen([sys.executable, "-c", SLOW, url], stderr=subprocess.PIPE, text=True)
    part = fetching.working_folder(RAW) / "a.zip.part"
    while not (part.exists() and part.stat().st_size):
        time.sleep(0.02)
        assert process.poll() is None
    process.send_signal(end)
    _, error = process.communicate(timeout=20)
    assert process.returncode == (2 if end == signal.SIGINT else -signal.SIGKILL)
    assert ("stopped; what was loaded is kept" in error) == (end == signal.SIGINT)
    assert not RAW.exists()
    source = Source(page=PAGE, read_in="x", archives=(Archive(file="a.zip", url=url, holds="train"),))
    monkeypatch.setitem(SOURCES, "human_seg", source)
    server.answer("/a.zip", content(data))
    assert run("fetch", "human_seg", "--yes")[0] == 0
    assert server.requests[-1][1]["Range"].startswith("bytes=")
    assert set(files_below(RAW)) == {name for name, _ in members} | {"seg/large", RECORD_NAME}


def test_names_that_cannot_be_fetched(run):
    code, _, error = run("fetch", "minicoseg")
    assert code == 2
    assert "minicoseg cannot be fetched: made by `meshshard features minicoseg`" in error
    assert "'nothing' is no known data set; those that can be fetched are human_seg," in run("fetch", "nothing")[2]


def test_missing_raw_files_name_the_command(run):
    with pytest.raises(UsageError, match="Type: meshshard fetch human_seg, or say where they are"):
        read_dataset("human_seg")
    assert "meshshard fetch human_seg\n" in run("datasets")[1]
