"""Raw files and shards that lie in an object store: the whole way, and what breaks on it."""

import json
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import fsspec
import numpy as np
import program
import pytest
import torch
from s3 import S3, cut_after, moto_server
from samples import toy_dataset
from shapes import box, bumpy, sphere, write_labels, write_obj
from typer.testing import CliRunner

from meshshard import open_dataset
from meshshard.cache import local_copy
from meshshard.cli import app
from meshshard.errors import InvalidMesh, InvalidShard, UsageError
from meshshard.recipe import RECIPES
from meshshard.remote import to_path
from meshshard_prep.datasets import read_dataset
from meshshard_prep.jobs import make_job, read_entry
from meshshard_prep.run import run
from meshshard_train import checkpoint
from meshshard_train.loop import train
from meshshard_train.recipes import paper
from meshshard_train.state import BEST

PAPER = RECIPES["paper"]


def meshshard(*arguments):
    """Exit status and output of one call, in this process."""
    done = CliRunner().invoke(app, list(map(str, arguments)), catch_exceptions=False)
    return done.exit_code, done.output


def published(folder):
    """Name -> content of a folder of shards."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != ".lock"}


@pytest.fixture(scope="module")
def server():
    with moto_server() as (address, requests):
        yield address, requests


@pytest.fixture
def s3(server, monkeypatch):
    return S3(*server, monkeypatch)


@pytest.fixture(scope="module")
def raw(tmp_path_factory):
    """A labelled folder with splits, a folder below one, a mesh that is refused, and one without its labels."""
    root = tmp_path_factory.mktemp("world") / "raw"
    for number, name in enumerate(("train/a", "train/deep/b", "train/deep-c", "train/d", "test/e")):
        vertices, faces = bumpy(number, 1)
        write_obj(root / f"{name}.obj", vertices, faces)
        write_labels(root / f"{name}.seg", (np.arange(len(faces)) + number) % 3)
    (root / "train" / "broken.obj").write_text("v 0 0 x\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    write_labels(root / "train" / "broken.seg", [0])
    write_obj(root / "test" / "bare.obj", *sphere(1))
    write_obj(root / ".hidden" / "f.obj", *sphere(1))
    return root


@pytest.fixture(scope="module")
def expected(raw, tmp_path_factory):
    """What the folder itself becomes."""
    out = tmp_path_factory.mktemp("expected")
    assert run(read_dataset(str(raw)), out, PAPER, jobs=1).computed == 5
    return published(out)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("MESHSHARD_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_features_of_a_bucket_are_those_of_a_folder(s3, raw, expected, tmp_path):
    """By two worker processes: the same shards, index, refusals and keys, byte for byte."""
    url = s3.put(raw, "raw")
    status, out, error = program.meshshard("features", url, "--out", "out", "--jobs", 2, cwd=tmp_path)
    assert status == 1, error
    assert "raw: 5 stored (5 new), 2 refused, 0 failed" in out
    assert published(tmp_path / "out") == expected
    assert len(open_dataset(tmp_path / "out")) == 5


@pytest.mark.parametrize("kind", ["file", "memory"])
def test_features_behind_other_urls_are_those_of_a_folder(raw, expected, tmp_path, kind):
    """Files of memory:// go to the worker processes with their content."""
    url = raw.as_uri()
    if kind == "memory":
        url = "memory://other/raw"
        fsspec.filesystem("memory").put(str(raw), "/other/raw", recursive=True)
    report = run(read_dataset(url), tmp_path, PAPER, jobs=2 if kind == "memory" else 1)
    assert (report.computed, len(report.index.refused)) == (5, 2)
    assert published(tmp_path) == expected


def described(dataset):
    """All that an adapter says, without where the files lie."""
    entries = [
        {name: value for name, value in vars(entry).items() if name not in ("path", "labels")}
        | {"path": entry.path.name, "labels": entry.labels and "/".join(entry.labels.path.parts[-2:])}
        for entry in dataset.entries
    ]
    return dataset.name, dataset.task, dataset.classes, entries


def test_every_layout_is_read_from_a_bucket(s3, tmp_path):
    for name in ("train/1", "train/2", "test/3"):
        write_obj(tmp_path / "coseg_vases" / f"{name}.obj", *box())
        write_labels(tmp_path / "coseg_vases" / "seg" / f"{name[-1]}.eseg", [0, 1, 2] * 4)
        write_obj(tmp_path / "shapes" / "cat" / f"{name}.obj", *box())
    (tmp_path / "shapes.toml").write_text('raw = "shapes"\nlayout = "meshcnn-classification"\n')
    (tmp_path / "vases.toml").write_text('raw = "coseg_vases"\nlayout = "meshcnn-segmentation"\n')
    url = s3.put(tmp_path, "layouts")
    for known, folder in (("coseg_vases", ""), ("human_seg", "/coseg_vases"), ("shrec_16", "/shapes")):
        here, there = read_dataset(known, Path(f"{tmp_path}{folder}")), read_dataset(known, to_path(url + folder))
        assert described(here) == described(there)
        assert len(there.entries) == 3
    for name in ("shapes.toml", "vases.toml"):  # a TOML file in the bucket, and one here that names the bucket
        assert described(read_dataset(f"{url}/{name}")) == described(read_dataset(str(tmp_path / name)))
    (tmp_path / "shapes.toml").write_text(f'raw = "{url}/shapes"\nlayout = "meshcnn-classification"\n')
    assert len(read_dataset(str(tmp_path / "shapes.toml")).entries) == 3
    one = read_dataset(f"{url}/shapes/cat/train/1.obj")
    assert [(entry.id, entry.source) for entry in one.entries] == [("1", "1.obj")]
    write_obj(tmp_path / "top" / "a.obj", *box())
    s3.files.mkdir("whole-bucket")
    s3.files.put(str(tmp_path / "top" / "a.obj"), "whole-bucket/a.obj")
    assert read_dataset("s3://whole-bucket").name == "whole-bucket"


def test_every_file_is_found_once(s3, tmp_path):
    """Also with names that sort before and after the slash; a bucket may hold a folder as an object of its own."""
    names = ("a", "a-b", "a.b", "a0", "b")
    folders = ["", *(f"{one}/" for one in names), *(f"{one}/{two}/" for one in names for two in names)]
    for folder in folders:
        for name in ("a", "b"):
            write_obj(tmp_path / f"tree/{folder}{name}.obj", *sphere(0))
    url = s3.put(tmp_path / "tree", "tree")
    s3.files.pipe({f"bucket/tree/{folder}": b"" for folder in folders[1:]})
    assert len(read_dataset(url).entries) == 2 * len(folders)
    assert described(read_dataset(url)) == described(read_dataset(str(tmp_path / "tree")))


def test_requests_do_not_grow_with_questions(s3, tmp_path):
    """One listing, whatever is asked about 100 meshes and their labels; then each file is read once to plan."""
    for number in range(100):
        write_obj(tmp_path / "train" / f"{number}.obj", *box())
        write_labels(tmp_path / "seg" / f"{number}.eseg", [1] * 18)
    url = s3.put(tmp_path, "many")
    s3.requests.clear()
    dataset = read_dataset("human_seg", to_path(url))
    assert (len(dataset.entries), len(s3.requests)) == (100, 1)
    for entry in dataset.entries:
        make_job(entry, PAPER)
    assert Counter(request.split()[0] for request in s3.requests) == {"GET": 201}
    s3.requests.clear()
    assert len(read_dataset(f"{url}/train").entries) == 100
    assert len(s3.requests) == 1


def test_a_folder_that_cannot_be_listed_says_why(s3, monkeypatch):
    for url, message in (
        ("s3://no-such-bucket/a", "No such file or directory .The specified bucket does not exist"),
        ("s3://bucket/no-such-folder", "is no known data set"),
    ):
        with pytest.raises(UsageError, match=message):
            read_dataset(url)
    with pytest.raises(UsageError, match="the raw files of human_seg are not in s3://bucket/no-such-folder"):
        read_dataset("human_seg", to_path("s3://bucket/no-such-folder"))
    with pytest.raises(UsageError, match="minicoseg is made on this machine only"):
        read_dataset("minicoseg", to_path("s3://bucket/no-such-folder"))
    with cut_after(s3.address, 0) as address:
        s3.point_to(address)
        with pytest.raises(UsageError, match=r"s3://bucket/raw cannot be read: Connection"):
            read_dataset("s3://bucket/raw")
    monkeypatch.delenv("AWS_ACCESS_KEY_ID")
    monkeypatch.delenv("AWS_SECRET_ACCESS_KEY")
    s3.point_to(s3.address)
    with pytest.raises(UsageError, match="cannot be read: NoCredentialsError: Unable to locate credentials"):
        read_dataset("s3://bucket/raw")


def test_a_mesh_that_cannot_be_had_is_refused_with_the_cause(s3, tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    (entry,) = read_dataset(s3.put(tmp_path, "one")).entries
    whole = read_entry(entry)
    for size, cause in ((0, "Connection"), (600, "Payload|Incomplete|Connection")):  # a head has some 400
        with cut_after(s3.address, size) as address:
            s3.point_to(address)
            with pytest.raises(InvalidMesh, match=rf"a\.obj: the file can be read, but .*({cause})") as caught:
                read_entry(entry)
            assert caught.value.code == "unreadable"
    s3.point_to(s3.address)
    assert read_entry(entry) == whole
    s3.files.rm("bucket/one/a.obj")
    with pytest.raises(InvalidMesh, match="No such file or directory"):
        read_entry(entry)


def test_a_network_that_fails_in_mid_run_costs_what_was_not_read_and_only_that_time(s3, tmp_path):
    for number in range(5):
        write_obj(tmp_path / "raw" / f"{number}.obj", *bumpy(number, 1))
    url = s3.put(tmp_path / "raw", "flaky")

    def go(**settings):
        return thread.submit(run, read_dataset(url), tmp_path / "out", PAPER, jobs=1, **settings).result()

    # a thread of its own: the process that computes for it starts now, and so knows where the server is
    with ThreadPoolExecutor(1) as thread, ExitStack() as servers:
        address, _ = servers.enter_context(moto_server())  # another one with the same files
        s3.point_to(address)
        report = go(progress=lambda done, *_: servers.close() if done == 2 else None)
        assert (report.computed, {entry.code for entry in report.index.refused}) == (2, {"unreadable"})
        assert len(report.index.refused) == 3
        assert all("Connection" in entry.message for entry in report.index.refused)
        servers.enter_context(moto_server(address[1]))
        report = go()
        assert (report.ok, report.computed) == (True, 3)


def test_shards_are_read_from_a_bucket(s3, tmp_path, cache):
    """By info, training, status and verify. Each shard is fetched once."""
    here = toy_dataset(tmp_path / "toy")
    (here / ".lock").touch()  # as it lies beside the shards that were copied
    url = s3.put(here, "toy")
    s3.requests.clear()
    card, local = json.loads(meshshard("info", url, "--json")[1]), json.loads(meshshard("info", here, "--json")[1])
    assert card == local | {"folder": url}
    train(
        open_dataset(url),
        paper("segmentation", width=16, epochs=1, precision="fp32"),
        tmp_path / "run",
        torch.device("cpu"),
    )
    assert checkpoint.load(tmp_path / "run" / BEST).state["folder"] == url  # where `evaluate` looks
    assert len(s3.asked_for("GET /bucket/toy/shard-0.h5")) == len(list(cache.iterdir())) == 1
    status, out = meshshard("status", url, "--json")
    assert (status, json.loads(out)["stored"], json.loads(out)["plan"]) == (0, 14, None)
    assert meshshard("verify", url, "--full") == (0, f"{url}: whole\n")
    s3.files.pipe("bucket/toy/shard-1.h5", b"old")
    status, out = meshshard("verify", url)
    assert (status, "shard-1.h5: no part of the data set" in out) == (1, True)
    with pytest.raises(UsageError, match=r"s3://bucket/nothing holds no index\.json"):
        meshshard("info", "s3://bucket/nothing")


def same(one, other):
    return len(one) == len(other) and all(a.digest == b.digest for a, b in zip(one, other, strict=True))


def test_shards_of_other_urls(tmp_path, cache):
    here = open_dataset(toy_dataset(tmp_path / "toy"))
    fsspec.filesystem("memory").put(str(here.folder), "/shards", recursive=True)
    assert same(open_dataset("memory://shards"), here)
    assert len(list(cache.iterdir())) == 1
    assert same(open_dataset(here.folder.as_uri()), here)


def test_the_cache_is_filled_once_and_mended(s3, tmp_path, cache):
    here = open_dataset(toy_dataset(tmp_path / "toy"))
    url = s3.put(here.folder, "cached")
    s3.requests.clear()
    for _ in range(2):
        assert same(open_dataset(url), here)
    shard = "GET /bucket/cached/shard-0.h5"
    assert len(s3.asked_for(shard)) == 1
    (copy,) = cache.iterdir()
    whole = copy.read_bytes()
    assert copy.stem == here.index.shards[0].sha256
    for damage in (whole[:-1], whole[:1000] + bytes([whole[1000] ^ 1]) + whole[1001:], b""):
        copy.write_bytes(damage)
        assert same(open_dataset(url), here)
        assert copy.read_bytes() == whole
    assert len(s3.asked_for(shard)) == 4
    with ThreadPoolExecutor(4) as pool:  # at once, and while it is mapped
        copy.unlink()
        assert all(pool.map(lambda _: same(open_dataset(url), here), range(4)))
    assert list(cache.iterdir()) == [copy]


def test_a_shard_that_is_cut_or_another_is_never_used(s3, tmp_path, cache):
    here = toy_dataset(tmp_path / "toy")
    dataset = open_dataset(s3.put(here, "damaged"))
    for size in (0, 600):  # of every answer: its head has some 400
        with cut_after(s3.address, size) as address:
            s3.point_to(address)
            with pytest.raises(
                InvalidShard, match=r"s3://bucket/damaged/shard-0\.h5: the shard cannot be had: .+try again"
            ):
                dataset[0]
    s3.point_to(s3.address)
    whole = (here / "shard-0.h5").read_bytes()
    s3.files.pipe("bucket/damaged/shard-0.h5", whole[:-1] + b"!")
    with pytest.raises(InvalidShard, match=r"shard-0.h5: its sha256 is .* the index says .* copy it there again"):
        dataset[0]
    s3.files.rm("bucket/damaged/shard-0.h5")
    with pytest.raises(InvalidShard, match="No such file or directory"):
        dataset[0]
    assert list(cache.iterdir()) == []
    s3.files.pipe("bucket/damaged/shard-0.h5", whole)
    assert same(dataset, open_dataset(here))


def test_an_index_cannot_name_files_outside_the_cache(tmp_path, cache):
    fsspec.filesystem("memory").pipe("/hostile/shard.h5", b"x")
    for name in ("../../outside", "", "A" * 64, "0" * 63):
        with pytest.raises(InvalidShard, match="where a sha256 should be"):
            local_copy(to_path("memory://hostile/shard.h5"), name)
    assert local_copy(tmp_path / "shard.h5", "../../outside") == tmp_path / "shard.h5"  # of this machine: not a copy
    assert not cache.exists()
