import json
from dataclasses import replace

import pytest
import typer
from samples import sample, toy_dataset, write_dataset

from meshshard import InvalidMesh, InvalidShard, UsageError, open_dataset
from meshshard.commands import export
from meshshard.export import Exporter
from meshshard.export.formats import find_exporter
from meshshard.export.select import select
from meshshard.export.write import write_export
from meshshard.files import LOCK_NAME

IDS = Exporter(".txt", lambda sample: sample.id.encode())


@pytest.fixture
def dataset(tmp_path):
    return open_dataset(toy_dataset(tmp_path / "shards"))


def files(out):
    return {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()} - {LOCK_NAME}


def test_a_file_for_each_mesh_and_a_list_of_them(dataset, tmp_path):
    report = write_export(dataset, [0, 5], "txt", IDS, tmp_path / "out")
    assert files(tmp_path / "out") == {"export.json", "mesh000.txt", "mesh005.txt"}
    assert (tmp_path / "out" / "mesh005.txt").read_text() == "mesh005"
    assert json.loads((tmp_path / "out" / "export.json").read_text()) == report
    assert report == {
        "format": "meshshard-export",
        "dataset": "toy",
        "to": "txt",
        "files": ["mesh000.txt", "mesh005.txt"],
        "bytes": 14,
        "refused": [],
    }


def test_ids_with_folders_become_folders(tmp_path):
    shards = write_dataset(tmp_path / "shards", [sample(0, id="train/chairs/a")], ["train"])
    write_export(open_dataset(shards), [0], "txt", IDS, tmp_path / "out")
    assert files(tmp_path / "out") == {"export.json", "train/chairs/a.txt"}


@pytest.mark.parametrize("name", ["../outside", "a/../../outside", "/outside", "", "a\0b", ".."])
def test_an_id_never_leaves_the_folder(tmp_path, name):
    shards = write_dataset(tmp_path / "shards", [sample(0), sample(1, id=name)], ["train"] * 2)
    dataset = open_dataset(shards)
    with pytest.raises(InvalidShard, match="is no name of a file inside a folder"):
        write_export(dataset, [0, 1], "txt", IDS, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_its_own_folder_is_brought_up_to_date(dataset, tmp_path):
    write_export(dataset, [0, 1], "txt", IDS, tmp_path / "out")
    (tmp_path / "out" / "notes").write_text("mine")
    write_export(dataset, [1, 2], "txt", IDS, tmp_path / "out")
    assert files(tmp_path / "out") == {"export.json", "mesh001.txt", "mesh002.txt", "notes"}


def test_an_export_that_was_stopped_goes_on(dataset, tmp_path):
    def stop(sample):
        if sample.id == "mesh001":
            raise KeyboardInterrupt
        return b"half"

    with pytest.raises(KeyboardInterrupt):
        write_export(dataset, [0, 1, 2], "txt", Exporter(".txt", stop), tmp_path / "out")
    write_export(dataset, [2], "txt", IDS, tmp_path / "out")
    assert files(tmp_path / "out") == {"export.json", "mesh002.txt"}


def test_anything_else_is_not_overwritten(dataset, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.txt").write_text("years of work")
    with pytest.raises(UsageError, match="no folder of exported meshes and not empty"):
        write_export(dataset, [0], "txt", IDS, out)
    (out / "export.json").write_text("[]")
    with pytest.raises(UsageError, match="no folder of exported meshes and not empty"):
        write_export(dataset, [0], "txt", IDS, out)
    assert files(out) == {"thesis.txt", "export.json"}
    with pytest.raises(UsageError, match="no folder of exported meshes"):
        write_export(dataset, [0], "txt", IDS, out / "thesis.txt")
    write_export(dataset, [0], "txt", IDS, tmp_path / "other")
    with pytest.raises(UsageError, match="holds an export of toy to txt, not of toy to npz"):
        write_export(dataset, [0], "npz", IDS, tmp_path / "other")


def test_a_hostile_list_removes_nothing_outside(dataset, tmp_path):
    write_export(dataset, [0], "txt", IDS, tmp_path / "out")
    path = tmp_path / "out" / "export.json"
    victims = [tmp_path / "victim", tmp_path / "other"]
    for victim in victims:
        victim.write_text("precious")
    table = json.loads(path.read_text()) | {"files": ["../victim", str(victims[1]), "mesh000.txt"]}
    path.write_text(json.dumps(table))
    write_export(dataset, [1], "txt", IDS, tmp_path / "out")
    assert [victim.read_text() for victim in victims] == ["precious"] * 2
    assert files(tmp_path / "out") == {"export.json", "mesh001.txt"}


def test_a_mesh_that_cannot_be_written_costs_itself(dataset, tmp_path):
    def encode(sample):
        if sample.id == "mesh001":
            raise InvalidMesh("no-faces", "a mesh has faces", "it has none", place=sample.id)
        return b""

    report = write_export(dataset, [0, 1, 2], "txt", Exporter(".txt", encode), tmp_path / "out")
    assert report["files"] == ["mesh000.txt", "mesh002.txt"]
    assert report["refused"] == ["mesh001: a mesh has faces, but it has none [no-faces]"]


def test_the_exit_status_says_that_a_mesh_is_missing(dataset, tmp_path, monkeypatch, capsys):
    def encode(sample):
        if sample.id == "mesh008":
            raise InvalidMesh("no-faces", "a mesh has faces", "it has none", place=sample.id)
        return b"."

    monkeypatch.setattr("meshshard.export.formats.find_exporter", lambda *_: Exporter(".txt", encode))
    for split, status, said in (("val", 1, "mesh008: a mesh has faces"), ("test", 0, "toy: 3 files, 3 bytes -> ")):
        with pytest.raises(typer.Exit) as stopped:
            export(str(dataset.folder), "txt", tmp_path / split, split=split)
        assert stopped.value.exit_code == status
        assert capsys.readouterr().out.startswith(said)


def test_meshes_are_chosen_by_split_and_id(dataset):
    assert select(dataset, None) == list(range(14))
    assert select(dataset, "val") == [8, 9, 10]
    assert select(dataset, None, ["mesh00[0-2]", "*13"]) == [0, 1, 2, 13]
    assert select(dataset, "test", ["*1", "*1[0-2]"]) == [11, 12]
    with pytest.raises(UsageError, match="no split 'dev'; there are 'test', 'train', 'val'"):
        select(dataset, "dev")
    with pytest.raises(UsageError, match=r"--id mesh005: no mesh .* the first of 3 are mesh008, mesh009, mesh010"):
        select(dataset, "val", ["mesh005"])


def test_formats_are_found_by_name(dataset):
    assert find_exporter("npz", dataset).suffix == ".npz"
    with pytest.raises(UsageError, match="'stl'; --to is one of diffusionnet, eseg, npz, ply, pyg, seg, vtkhdf"):
        find_exporter("stl", dataset)
    with pytest.raises(UsageError, match="format npz have no colours: leave --colour out, or try --to ply"):
        find_exporter("npz", dataset, "hks:3")


@pytest.mark.parametrize("form", ["npz", "ply", "vtkhdf", "pyg"])
def test_every_format_gives_the_same_bytes_again(dataset, form):
    mesh = dataset[3]
    assert find_exporter(form, dataset).encode(mesh) == find_exporter(form, dataset).encode(replace(mesh))
