"""The programs as people call them."""

import contextlib
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData
from program import meshshard
from samples import toy_dataset
from shapes import bumpy, joined, sphere, write_labels, write_obj
from told import but_progress
from typer.testing import CliRunner

from meshshard import UsageError, open_dataset
from meshshard.cli import VERBS, app
from meshshard_train.commands.predict import predict

SETTINGS = ("--set", "width=16", "--batch-vertices", 128, "--rotation-axes", "none", "--precision", "fp32")
"""Of a network that trains in no time."""


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """A folder with a small labelled data set, its features, and a run."""
    root = tmp_path_factory.mktemp("world")
    for number in range(12):
        vertices, faces = bumpy(number, 1 + number % 2)
        path = root / "raw" / ("test" if number > 8 else "train") / f"m{number}.obj"
        write_obj(path, vertices, faces)
        write_labels(path.with_suffix(".seg"), (vertices[faces].mean(axis=1)[:, 1] > 0).astype(int))
    status, out, error = meshshard("features", "raw", "--out", "shards", "--val-fraction", 0.3, cwd=root)
    assert (status, but_progress(error)) == (0, "")
    assert out.startswith("raw: 12 stored (12 new), 0 refused, 0 failed")
    status, out, error = meshshard("train", "shards", "--run", "run", "--epochs", 3, *SETTINGS, cwd=root)
    assert status == 0, error
    assert "run/val.png" in out
    return root


def test_help_names_every_verb():
    status, out, _ = meshshard("--help")
    assert status == 0
    for verb in ("datasets", "features", "info", "status", "verify", "train", "evaluate", "predict", "export"):
        assert f" {verb} " in out


def test_help_does_not_import_what_is_heavy():
    code = (
        "import sys\n"
        "from meshshard.cli import VERBS, main\n"
        "for verb in sorted(set(VERBS) - {'generate'}):\n"  # which lists its families
        "    sys.argv = ['meshshard', verb, '--help']\n"
        "    try: main()\n"
        "    except SystemExit: pass\n"
        "    heavy = {'torch', 'igl', 'scipy', 'skimage', 'joblib', 'matplotlib', 'numpy', 'h5py'}\n"
        "    assert not heavy & set(sys.modules), (verb, heavy & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("Usage: ") == len(VERBS) - 1


def test_importing_the_packages_imports_nothing_heavy_before_it_is_asked_for():
    code = (
        "import sys, meshshard, meshshard_prep, meshshard_train\n"
        "assert not {'torch', 'scipy', 'numpy', 'h5py', 'igl'} & set(sys.modules)\n"
        "from meshshard import *\n"
        "assert Sample.__module__ == 'meshshard.sample' and callable(open_dataset)\n"
        "assert not hasattr(meshshard, 'no_such_name')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_info_imports_neither_half(tmp_path):
    toy_dataset(tmp_path)
    code = (
        "import sys; sys.argv = ['meshshard', 'info', sys.argv[1]]\n"
        "from meshshard.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'torch', 'igl', 'scipy', 'embreex', 'jinja2', 'PIL', 'matplotlib'} & set(sys.modules)\n"
        "heavy |= {'meshshard_prep', 'meshshard_train'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True, capture_output=True)


def test_status_info_verify(world):
    status, out, _ = meshshard("status", "shards", "--json", cwd=world)
    found = json.loads(out)
    assert (status, found["stored"], found["refused"], found["failed"]) == (0, 12, 0, 0)
    status, out, _ = meshshard("info", "shards", "--json", cwd=world)
    card = json.loads(out)
    assert {name: row["meshes"] for name, row in card["splits"].items()} == {"test": 3, "train": 6, "val": 3}
    assert sum(row["area_share"] for row in card["splits"]["train"]["classes"]) == pytest.approx(1)
    assert card["all"]["diagnostics"]["components"] == {"sum": 0, "meshes": 0}
    assert 0 < card["all"]["hks_error_bound"]["largest"] < 1e-5
    assert meshshard("verify", "shards", "--full", cwd=world)[:2] == (0, "shards: whole\n")
    assert json.loads(meshshard("verify", "shards", "--json", cwd=world)[1])["ok"] is True
    assert "stored    12" in meshshard("status", "shards", cwd=world)[1]


def test_info_as_text_json_and_page(world):
    status, text, error = meshshard("info", "shards", cwd=world)
    assert (status, error) == (0, "")
    lines = text.splitlines()
    card = json.loads(meshshard("info", "shards", "--json", cwd=world)[1])
    faces = [part["faces"]["sum"] for part in (*card["splits"].values(), card["all"])]
    assert lines[:3] == ["raw", "task\tsegmentation", "meshes\t12"]
    assert "\ttrain\tval\ttest\tall" in lines
    assert "\t".join(["faces", *map("{:,}".format, faces)]) in lines
    status, out, error = meshshard("info", "shards", "--page", "card.html", cwd=world)
    page = (world / "card.html").read_text()
    assert (status, out, error) == (0, f"card.html: {len(page.encode()):,} bytes\n", "")
    assert all(f"<td>{number:,}</td>" in page for number in faces)
    status, out, _ = meshshard("info", "shards", "--page", "other.html", "--json", cwd=world)
    assert (status, json.loads(out), (world / "other.html").read_text()) == (0, card, page)
    assert meshshard("info", "shards", "--page", "new/card.html", cwd=world)[0] == 0
    status, _, error = meshshard("info", "shards", "--page", ".", cwd=world)
    assert (status, "--page is the HTML file to write" in error) == (2, True)


def test_evaluate_says_what_training_said(world):
    status, out, error = meshshard("evaluate", "run", "--split", "test", "--json", cwd=world)
    assert status == 0, error
    found, told = json.loads(out), json.loads((world / "run" / "results.json").read_text())
    assert found["rows"]["test"] == pytest.approx(told["rows"]["test"])
    assert set(found["per_class"]["test"]["voted"]) == {"0", "1"}
    assert "test" in meshshard("evaluate", "run", cwd=world)[1]
    status, _, error = meshshard("evaluate", "run", "--split", "tset", cwd=world)
    assert status == 2
    assert "no meshes in the split 'tset'; there are: --split test, --split train" in " ".join(error.split())


def test_training_again_does_nothing_and_other_settings_are_refused(world):
    start = time.perf_counter()
    status, _, error = meshshard("train", "shards", "--run", "run", "--epochs", 3, *SETTINGS, cwd=world)
    assert (status, "epoch 2" in error) == (0, False), time.perf_counter() - start
    status, _, error = meshshard("train", "shards", "--run", "run", "--epochs", 4, *SETTINGS, cwd=world)
    assert status == 2
    assert "epochs: 3 against 4" in " ".join(error.split())


def test_predict_labels_meshes_that_were_never_in_a_data_set(world):
    vertices, _ = sphere(1)
    polygons = "f 1 3 5 4\nf 1 5 3\nf 2 3 5\n"  # one among triangles
    lines = "".join(f"v {x} {y} {z}\n" for x, y, z in (50 * vertices + 7).tolist())
    (world / "new.obj").write_text(lines + polygons)
    (world / "bad.obj").write_text("v 0 0 0\n")
    (world / "labelled").mkdir()
    (world / "labelled" / "other.seg").write_text("0\n")
    chosen = json.loads((world / "run" / "results.json").read_text())["voting_rounds"]
    status, out, error = meshshard(
        "predict", "run", "new.obj", "bad.obj", "raw", "--out", "labelled", "--json", cwd=world
    )
    assert status == 1, error
    assert "refused  bad.obj: " in error
    meshes = {mesh["source"]: mesh for mesh in json.loads(out)}
    assert set(meshes) == {"new.obj", "bad.obj", *(f"raw/{part}/m{n}.obj" for part, n in parts())}
    assert meshes["bad.obj"]["refused"]["code"] == "no-faces"
    assert meshes["bad.obj"]["files"] == []
    for part, number in parts():
        mesh = meshes[f"raw/{part}/m{number}.obj"]
        assert mesh["files"] == [
            f"labelled/{part}/m{number}.{end}" for end in ("ply", "seg", "confidence", "png", "json")
        ]
        assert (sum(mesh["counts"].values()), mesh["voting_rounds"]) == (32 * 4 ** (number % 2), chosen)
    new = world / "labelled" / "new.obj"
    ply = PlyData.read(new.with_suffix(".ply"))
    np.testing.assert_allclose(ply["vertex"]["x"], 50 * vertices[:, 0] + 7, atol=1e-3)
    assert len(ply["face"].data) == 4
    assert len(new.with_suffix(".seg").read_text().splitlines()) == 3
    assert len(new.with_suffix(".confidence").read_text().splitlines()) == 3
    assert new.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    assert (world / "labelled" / "other.seg").read_text() == "0\n"


def parts():
    return [("test" if number > 8 else "train", number) for number in range(12)]


def test_predict_from_a_checkpoint_alone_says_that_nothing_votes(world):
    vertices, faces = bumpy(5, 1)
    for folder in ("a", "b"):
        write_obj(world / folder / "deep" / "m.obj", vertices, faces)
    (world / "moved.safetensors").write_bytes((world / "run" / "best.safetensors").read_bytes())
    words = ["predict", "moved.safetensors", "a", "b", "--no-pictures", "--out", "from"]
    status, out, error = meshshard(*words, cwd=world)
    assert (status, error) == (
        0,
        "moved.safetensors does not say how many rounds of voting to take: none; or say --vote N\n",
    )
    assert [line.split(": ")[0] for line in out.splitlines()] == ["a/deep/m.obj", "b/deep/m.obj"]
    assert "from/a/deep/m.ply, .seg, .confidence, .json" in out.splitlines()[0]
    for ending in ("ply", "seg", "confidence"):
        first, second = ((world / "from" / folder / "deep" / f"m.{ending}").read_bytes() for folder in "ab")
        assert first == second


@pytest.mark.parametrize(
    ("run", "options", "message"),
    [
        ("run", {"mesh": [Path("raw"), Path("absent")]}, "absent: no such mesh file or folder"),
        ("run", {"out": Path("raw")}, "results would be written beside the mesh raw/test/m10.obj"),
        ("run", {"jobs": 0}, "--jobs is the number of processes"),
        ("nowhere", {}, "train first"),
        ("run/val.png", {}, "run/val.png is no checkpoint that can be used"),
        ("short", {}, "short is no checkpoint that can be used: its content does not have the sha256"),
        ("shards/index.json", {}, "is no checkpoint that can be used"),
    ],
)
def test_predict_refuses_by_name(world, monkeypatch, run, options, message):
    monkeypatch.chdir(world)
    Path("short").write_bytes(Path("run/best.safetensors").read_bytes()[:-1])
    with pytest.raises(UsageError, match=re.escape(message)):
        predict(Path(run), **({"mesh": [Path("raw")]} | options))


def test_a_dry_run_writes_nothing_and_status_knows_the_raw_files(world, tmp_path):
    for name in ("raw", "minicoseg"):
        words = ["features", name, "--dry-run", "--json"]
        status, out, error = meshshard(*words, cwd=world if name == "raw" else tmp_path)
        if name == "minicoseg":  # would have to be generated first
            assert (status, "not in data/raw/minicoseg: they are made by `meshshard" in error) == (2, True)
            assert not list(tmp_path.iterdir())
            continue
        found = json.loads(out)
        assert (status, found["stale_or_missing"], found["trials"]) == (0, 12, 5)
        assert not (world / "data").exists()
    status, out, _ = meshshard("status", "shards", "--raw", "raw", "--json", cwd=world)
    assert (status, json.loads(out)["plan"]["fresh"]) == (0, 12)
    status, out, _ = meshshard("status", "raw", "--out", "shards", cwd=world)
    assert "12 meshes: 12 fresh, 0 to compute" in out


def test_limits_on_the_command_line(tmp_path):
    write_obj(tmp_path / "raw" / "a.obj", *sphere(5))
    words = ["features", "raw", "--out", "out", "--jobs", 1]
    status, out, _ = meshshard(*words, "--time-limit", 0.001, "--json", cwd=tmp_path)
    assert status == 1
    assert {entry["code"] for entry in json.loads(out)["rejected"]} == {"time-limit"}
    assert meshshard(*words, "--time-limit", 0, "--memory-limit", 0, cwd=tmp_path)[0] == 0


def test_a_refused_mesh_shows_in_the_exit_status(tmp_path):
    write_obj(tmp_path / "raw" / "good.obj", *sphere(1))
    (tmp_path / "raw" / "bad.obj").write_text("v 0 0 x\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    status, out, _ = meshshard("features", "raw", "--out", "shards", "--jobs", 1, cwd=tmp_path)
    assert status == 1
    assert "refused  bad.obj:1: " in out
    assert "1 stored (1 new), 1 refused, 0 failed" in out
    assert "bad-number" in meshshard("status", "shards", cwd=tmp_path)[1]
    (tmp_path / "shards" / "index.json").write_text("{}")
    assert meshshard("verify", "shards", cwd=tmp_path)[0] == 1


def test_unlabelled_data_cannot_be_trained_on(tmp_path):
    write_obj(tmp_path / "raw" / "a.obj", *sphere(1))
    assert meshshard("features", "raw", cwd=tmp_path)[0] == 0  # data/features/raw/paper
    for option, message in (
        (("--train-fraction", 0.1), "raw has no such split"),
        (("--fold", 2), "raw has no folds"),
    ):
        status, _, error = meshshard("features", "raw", *option, cwd=tmp_path)
        assert (status, message in " ".join(error.split())) == (2, True)
    status, _, error = meshshard("train", "raw", cwd=tmp_path)
    assert status == 2
    assert "has no labels, and training needs them" in " ".join(error.split())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("features", "nothing"), "is no known data set"),
        (("features", ""), "a data set is a known name"),
        (("features", "human_seg"), "make features DATASET=human_seg RAW=<folder>"),
        (("features", "minicoseg", "--recipe", "x"), "no recipe is called 'x'"),
        (("features", "minicoseg", "--jobs", "0"), "it cannot be 0"),
        (("features", "minicoseg", "--val-fraction", "1"), "--val-fraction is at least 0 and below 1"),
        (("info", "nothing"), "compute them with: meshshard features nothing"),
        (("train", "nothing"), "compute them with: meshshard features nothing"),
    ],
)
def test_mistakes_say_what_to_type(tmp_path, words, message):
    status, out, error = meshshard(*words, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in " ".join(error.split())


def test_bad_options_of_training(world):
    for words, message in (
        (("--recipe", "x"), "there are paper, official"),
        (("--device", "tpu"), "--device is auto, cpu or cuda"),
        (
            ("--features", "colour"),
            "dihedral_signed, dihedral_official, each once, not ('colour',)",
        ),
    ):
        status, _, error = meshshard("train", "shards", *words, cwd=world)
        assert status == 2
        assert message in " ".join(error.split())


@pytest.mark.parametrize(
    ("words", "module", "extra"),
    [(("train",), "torch", "train"), (("info", "--page", "card.html"), "embreex", "pictures")],
)
def test_a_missing_extra_says_what_to_install(tmp_path, words, module, extra):
    toy_dataset(tmp_path)
    code = (
        "import sys; module, *sys.argv = sys.argv[1:]\n"
        "sys.modules[module] = None\n"
        "from meshshard.cli import main\n"
        "main()"
    )
    call = [sys.executable, "-c", code, module, "meshshard", *words, str(tmp_path)]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"this command needs {module}, which comes with: pip install 'meshshard[{extra}]'" in done.stderr


def test_features_with_options_of_the_recipe(tmp_path):
    write_obj(tmp_path / "raw" / "a.obj", *joined(bumpy(1), bumpy(2, 1)))
    write_obj(tmp_path / "raw" / "b.obj", *bumpy(3))
    options = ("--components", "bridged", "--spectrum", 5)
    status, out, error = meshshard("features", "raw", *options, cwd=tmp_path)
    assert (status, but_progress(error)) == (0, "")
    assert out.strip().endswith("data/features/raw/paper-bridged-spectrum5")
    dataset = open_dataset(tmp_path / "data/features/raw/paper-bridged-spectrum5")
    assert (dataset.recipe.components, dataset.recipe.spectrum) == ("bridged", 5)
    assert [sample.diagnostics["bridges"] for sample in dataset] == [1, 0]
    assert all(sample.eigenvectors.shape == (len(sample.vertices), 5) for sample in dataset)
    assert all((np.abs(sample.eigenvalues) < 1e-8).sum() == 1 for sample in dataset)  # bridged: one zero
    assert meshshard("verify", dataset.folder, "--full")[0] == 0
    status, _, error = meshshard("features", "raw", "--components", "glued", cwd=tmp_path)
    assert status == 2
    assert "components is 'separate' or 'bridged', not 'glued'" in error


@pytest.mark.parametrize(
    ("form", "suffix", "options"),
    [
        ("npz", ".npz", ()),
        ("ply", ".ply", ("--colour", "hks:3")),
        ("vtkhdf", ".vtkhdf", ()),
        ("pyg", ".safetensors", ()),
    ],
)
def test_export_writes_a_file_for_each_mesh_of_a_split(world, form, suffix, options):
    call = ("export", "shards", "--to", form, "--out", f"out-{form}", "--split", "test", *options)
    status, out, error = meshshard(*call, cwd=world)
    assert (status, error) == (0, "")
    assert out.startswith("raw: 3 files, ")
    assert out.endswith(f" bytes -> out-{form}\n")
    names = {path.name for path in (world / f"out-{form}").rglob(f"*{suffix}")}
    assert names == {f"m{number}{suffix}" for number in (9, 10, 11)}
    status, out, _ = meshshard(*call, "--json", cwd=world)
    report = json.loads(out)
    assert status == 0
    assert report["bytes"] == sum((world / f"out-{form}" / name).stat().st_size for name in report["files"])


def test_export_to_diffusionnet_needs_eigenvectors_and_says_so(world):
    status, _, error = meshshard("export", "shards", "--to", "diffusionnet", "--out", "operators", cwd=world)
    assert status == 2
    assert "the command that made it again, with --spectrum 128, then export raw/paper-spectrum128" in " ".join(
        error.split()
    )
    assert not (world / "operators").exists()
    meshshard("features", "raw", "--out", "spectral", "--spectrum", 5, cwd=world)
    call = ("export", "spectral", "--to", "diffusionnet", "--out", "operators", "--id", "*m0", "--id", "*m1")
    assert meshshard(*call, cwd=world)[0] == 0
    with np.load(world / "operators" / "train" / "m0.npz", allow_pickle=False) as found:
        assert found["evecs"].shape == (18, 5)


@pytest.mark.parametrize(("typed", "offered"), [("rep", ["report", "reproduce"]), ("view --no", ["--no-open"])])
def test_a_shell_completes_commands_and_options(typed, offered):
    asked = {"_MESHSHARD_COMPLETE": "complete_bash", "COMP_WORDS": f"meshshard {typed}"}
    number = str(len(typed.split()))
    found = CliRunner().invoke(app, [], prog_name="meshshard", env=asked | {"COMP_CWORD": number}).output
    assert found.split() == offered


@pytest.mark.parametrize("quiet", [True, False])
def test_help_has_colours_on_a_terminal_unless_they_are_not_wanted(tmp_path, quiet):
    environment = os.environ | {"TERM": "xterm-256color"} | ({"NO_COLOR": "1"} if quiet else {})
    leader, follower = os.openpty()
    call = [sys.executable, "-m", "meshshard", "info", "--help"]
    done = subprocess.Popen(call, cwd=tmp_path, env=environment, stdout=follower, stderr=follower)
    os.close(follower)
    said = b""
    with contextlib.suppress(OSError):  # how Linux says that nobody writes any more
        while part := os.read(leader, 4096):
            said += part
    os.close(leader)
    assert done.wait() == 0
    assert bool(re.search(rb"\x1b\[[\d;]*3\dm", said)) is not quiet
