"""`meshshard report`: a run, runs of several seeds, or a data set as one page."""

import json
import math
import re
import shutil
from dataclasses import replace

import pytest
from finished import finished_run
from html_pages import HOSTILE, TAGS, Page
from matched import matched_dataset
from samples import sample, toy_dataset, write_dataset
from training import CPU

from meshshard import UsageError, open_dataset
from meshshard.files import sha256_of_file
from meshshard.index import read_index
from meshshard_train import checkpoint
from meshshard_train.commands.report import report
from meshshard_train.recipes import official, paper
from meshshard_train.report.meshes import worst_and_best
from meshshard_train.seeds import folder_of, write_seeds
from meshshard_train.state import BEST, publish_config
from meshshard_train.tables import class_table, main_table

CONFIG = paper("segmentation", width=16, epochs=2, batch_vertices=100, precision="fp32")
TAGS = TAGS | {"section", "nav", "a", "h3", "line", "text", "path"}
PUBLISHED = "published protocol: epoch chosen on TEST"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A data set and a run; tests copy what they change."""
    root = tmp_path_factory.mktemp("report")
    finished_run(toy_dataset(root / "shards"), root / "run", CONFIG)
    return root


@pytest.fixture
def world(made, tmp_path, monkeypatch):
    """A folder with a run, whose data set may be moved away."""
    shutil.copytree(made, tmp_path / "world")
    monkeypatch.chdir(tmp_path / "world")
    best = checkpoint.load(tmp_path / "world" / "run" / BEST)
    state = best.state | {"folder": str(tmp_path / "world" / "shards")}
    path = tmp_path / "world" / "run" / BEST
    checkpoint.save(path, replace(best, state=state))
    results = tmp_path / "world" / "run" / "results.json"
    found = json.loads(results.read_text())
    results.write_text(json.dumps(found | {"checkpoint_sha256": sha256_of_file(path)}))
    return tmp_path / "world"


def page_of(what, **options):
    """The page, and its text."""
    report(str(what), out=(path := what.parent / "report.html"), **options)
    text = path.read_text()
    return Page(text), text


def words(page):
    return " ".join(" ".join(page.text).split())


def charts(page):
    """What the charts of a page say to those who do not see them."""
    return [svg["aria-label"] for svg in page.named("svg") if svg.get("viewbox", "").startswith("0 0 400")]


def test_a_run_is_told_whole(made):
    page, text = page_of(made / "run")
    results = json.loads((made / "run" / "results.json").read_text())
    for rows in (main_table(results), class_table(results, "val"), class_table(results, "test")):
        assert [row for row in rows if row not in page.rows] == []
    for row in (
        ["sha256 of best.safetensors", results["checkpoint_sha256"]],
        ["content_sha256", results["content_sha256"]],
        ["splits_sha256", results["splits_sha256"]],
        ["finished on", results["finished_on"]],
        ["learning_rate", str(CONFIG.learning_rate)],
        ["hours", f"{results['seconds'] / 3600:.2f}"],
    ):
        assert row in page.rows, row
    (entry,) = read_index(made / "shards").shards
    assert [entry.file, "14", f"{entry.bytes:,}", entry.sha256] in page.rows
    assert words(page).count(results["protocol"]) > 8  # beside every table, matrix and picture
    assert "Not in this report" not in text
    assert [label.split(":")[0] for label in charts(page)] == [
        "Training loss",
        "Val accuracy, raw, per cent, val accuracy, raw",
        "Learning rate",
    ]


def test_matrices_say_how_many_of_a_row_were_predicted_as_what(made):
    page, _ = page_of(made / "run", meshes=0)
    counts = json.loads((made / "run" / "results.json").read_text())["confusion"]["test"]["voted"]
    for name, row in zip(("low", "middle", "high"), counts, strict=True):
        cells = next(cells for cells in reversed(page.rows) if cells[0] == name and cells[-1] == f"{sum(row):,}")
        for text, count in zip(cells[1:-1], row, strict=True):
            share = 100 * count / sum(row)
            assert text == ("" if not count else "<1" if share < 0.5 else f"{share:.0f}")


def test_the_worst_and_the_best_meshes_are_shown_with_label_and_prediction(made):
    dataset, best = open_dataset(made / "shards"), checkpoint.load(made / "run" / BEST)
    shown = worst_and_best(best, made / "run", dataset, range(14), 5, CPU)
    scores = [[float(figure["score"][:-2]) for figure in group["figures"]] for group in shown["groups"]]
    assert [group["title"] for group in shown["groups"]] == ["Worst 3", "Best 2"]
    assert scores == [sorted(scores[0]), sorted(scores[1], reverse=True)]
    assert max(scores[0]) <= min(scores[1])
    few = worst_and_best(best, made / "run", dataset, [3], 5, CPU)
    assert [group["title"] for group in few["groups"]] == ["Worst"]
    page, _ = page_of(made / "run", meshes=4)
    alts = [image["alt"] for image in page.named("img") if re.search(", (label|prediction|errors): ", image["alt"])]
    assert len(alts) == 9  # of three meshes in test
    shares, wrong = r"(label|prediction): (low|middle|high) \d+ %.*", r"errors: [\d.]+ % wrong"
    assert all(re.fullmatch(rf"mesh mesh\d{{3}}, ({shares}|{wrong})", alt) for alt in alts)


def test_meshes_without_labels_have_no_place(made, tmp_path):
    samples = [sample(n, level=1, labels=None if n else "faces") for n in range(3)]
    samples = [s if n == 0 else replace(s, face_labels=None) for n, s in enumerate(samples)]
    labelled = [
        replace(s, face_labels=sample(n, level=1).face_labels * (n == 0) - (n > 0)) for n, s in enumerate(samples)
    ]
    dataset = open_dataset(write_dataset(tmp_path, labelled, ["test"] * 3))
    shown = worst_and_best(checkpoint.load(made / "run" / BEST), made / "run", dataset, range(3), 4, CPU)
    assert (shown["judged"], shown["unlabelled"]) == (1, 2)


def test_it_needs_nothing_else_and_is_small(made):
    page, text = page_of(made / "run", meshes=14)
    for word in ("http:", "https:", "//", "url(", "@import", "<link", "<script"):
        assert word not in re.sub(r"base64,[^\"]+", "", text), word
    assert 100 * len(text) / len(page.named("img")) < 5e6
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text
    links = {link["href"][1:] for link in page.named("a")}
    assert links <= {attributes.get("id") for _, attributes in page.tags}


def test_names_are_hostile(tmp_path):
    classes = (HOSTILE, HOSTILE.upper(), "high")
    samples = [sample(n, id=f"{HOSTILE}{n}\x1b[2J") for n in range(6)]
    folder = write_dataset(
        tmp_path / "shards", samples, ["train", "train", "val", "val", "test", "test"], classes=classes
    )
    replace(read_index(folder), dataset=HOSTILE, licence=HOSTILE).write(folder)
    run = tmp_path / "<b>run"
    finished_run(folder, run, CONFIG)
    page, text = page_of(run)
    assert {tag for tag, _ in page.tags} <= TAGS
    assert not [name for _, attributes in page.tags for name in attributes if name.startswith("on")]
    assert all(image["src"].startswith("data:") for image in page.named("img"))
    assert "\x1b" not in text
    assert HOSTILE in [row[0] for row in page.rows]


def test_an_unfinished_run_says_so_and_leaves_the_test_split_alone(world, capsys):
    (world / "run" / "results.json").unlink()
    page, _ = page_of(world / "run")
    said = words(page)
    assert "not finished: 2 of 2 epochs done, the best is" in said
    assert "no figures, and pictures are of val; go on with meshshard train" in said
    assert "Meshes of val, worst and best" in said
    assert "raw, for the rounds of voting are not chosen yet" in said
    assert "not in it: run is not finished" in capsys.readouterr().err.replace(str(world) + "/", "")
    (world / "run" / "metrics.jsonl").unlink()
    assert "metrics.jsonl is not there: no curves" in words(page_of(world / "run")[0])


def test_a_data_set_that_was_moved_is_told_and_may_be_named(world, capsys):
    (world / "shards").rename(world / "moved")
    page, _ = page_of(world / "run", as_json=True)
    assert page.named("img") == []
    assert "no data card and no pictures; say where it is with --data" in words(page)
    assert len(json.loads(capsys.readouterr().out)["missing"]) == 1
    page, text = page_of(world / "run", data=str(world / "moved"))
    assert page.named("img")
    assert "Not in this report" not in text
    write_dataset(world / "other", [sample(n) for n in range(3)], ["train", "val", "test"])
    with pytest.raises(UsageError, match=r"--data: .* is not what the run was trained on: splits_sha256"):
        page_of(world / "run", data=str(world / "other"))
    (world / "other").rename(world / "shards")
    assert "say where that data is with --data" in words(page_of(world / "run")[0])


def test_damaged_files_of_a_run_are_refused_by_name(world):
    for name, content, what in (
        ("metrics.jsonl", '{"epoch": 0}\n', r"metrics.jsonl, line 1, cannot be read \(KeyError"),
        ("metrics.jsonl", "no\n", "metrics.jsonl, line 1, cannot be read"),
        ("metrics.jsonl", "[]\n", "metrics.jsonl, line 1, cannot be read"),
        ("results.json", "{", "results.json cannot be read"),
        ("best.safetensors", "", "is no checkpoint"),
    ):
        path = world / "run" / name
        before = path.read_bytes()
        path.write_text(content)
        with pytest.raises(UsageError, match=what):
            report(str(world / "run"), out=world / "a.html")
        path.write_bytes(before)
    results = json.loads((world / "run" / "results.json").read_text())
    del results["meshes_trained"]
    (world / "run" / "results.json").write_text(json.dumps(results))
    with pytest.raises(UsageError, match=r"not as this version writes it \(KeyError\('meshes_trained'\)\)"):
        report(str(world / "run"), out=world / "a.html")
    (world / "run" / BEST).unlink()
    with pytest.raises(UsageError, match="is not there; train first"):
        report(str(world / "run"), out=world / "a.html")
    assert not (world / "a.html").exists()


def test_a_run_of_before_hardware_was_recorded(world):
    results = json.loads((world / "run" / "results.json").read_text())
    del results["finished_on"]
    (world / "run" / "results.json").write_text(json.dumps(results))
    page, _ = page_of(world / "run", meshes=0)
    assert ["finished on", "not recorded: the run is of an earlier version"] in page.rows


def test_the_published_protocol_stands_beside_every_figure(made, tmp_path):
    config = official("segmentation", width=16, epochs=1, features=("vertices", "hks"))
    finished_run(made / "shards", tmp_path / "run", config)
    page, _ = page_of(tmp_path / "run")
    titles = re.findall(r"(?:All figures|each class|raw;|voted;|Of 3 meshes)", words(page))
    assert words(page).count(PUBLISHED) >= len(titles)


def test_whole_meshes(tmp_path):
    samples = [sample(n, labels=None, mesh_label=n % 2) for n in range(10)]
    splits = ["train"] * 4 + ["val"] * 3 + ["test"] * 3
    folder = write_dataset(tmp_path / "shards", samples, splits, task="classification", classes=("odd", "even"))
    finished_run(
        folder, tmp_path / "run", paper("classification", width=16, epochs=1, batch_vertices=100, precision="fp32")
    )
    page, _ = page_of(tmp_path / "run")
    assert "By probability of its class, raw" in words(page)
    alts = [image["alt"] for image in page.named("img")]
    assert any(re.fullmatch(r"mesh mesh\d{3}, prediction: (odd|even)", alt) for alt in alts)
    assert "errors" not in " ".join(alts)


def test_correspondence(tmp_path):
    config = paper("correspondence", width=16, epochs=1, eigenfunctions=10, coordinates=8, precision="fp32")
    results = finished_run(matched_dataset(tmp_path / "shards"), tmp_path / "run", config)
    page, _ = page_of(tmp_path / "run")
    row = next(row for row in page.rows if row[0] == "test")
    assert row[1] == f"{100 * results['rows']['test']['geodesic_error']:.2f}"
    assert "correspondence has no classes: no pictures of meshes with labels beside predictions" in words(page)
    labels = charts(page)
    assert labels[0].startswith("Points within an error, per cent; epoch chosen on validation, val:")
    assert any(label.startswith("Val geodesic error, hundredths of the square root of the area") for label in labels)


@pytest.fixture(scope="module")
def several(made, tmp_path_factory):
    root = tmp_path_factory.mktemp("several") / "runs"
    shards = made / "shards"
    write_seeds(root, [finished_run(shards, folder_of(root, seed), replace(CONFIG, seed=seed)) for seed in (3, 4)])
    return root


def test_several_seeds(several, tmp_path):
    page, _ = page_of(several)
    summary = json.loads((several / "seeds.json").read_text())
    found = summary["figures"]["test"]["voted_accuracy"]
    row = [
        "test",
        "voted accuracy",
        *(f"{100 * value:.2f}" for value in (found["mean"], found["deviation"], *found["values"])),
    ]
    assert row in page.rows
    assert ["seed", "3, 4"] in page.rows
    assert [row[0] for row in page.rows if row[-1] in {run["checkpoint_sha256"] for run in summary["runs"]}] == [
        "3",
        "4",
    ]
    assert f"meshshard report {several / 'seed-3'} --out FILE.html" in words(page)
    assert page.named("img")  # the data card's

    shutil.copytree(several, tmp_path / "runs")
    (tmp_path / "runs" / "seed-4" / "metrics.jsonl").unlink()
    (tmp_path / "runs" / "seed-3" / BEST).unlink()
    said = words(page_of(tmp_path / "runs")[0])
    assert "no curves of seed 4" in said
    assert "is not the checkpoint that the figures of seed 3 are of" in said
    assert "no data card" in said
    (tmp_path / "runs" / "seeds.json").write_text(json.dumps(summary | {"runs": []}))
    with pytest.raises(UsageError, match=r"seeds\.json is not as this version writes it"):
        page_of(tmp_path / "runs")
    (tmp_path / "runs" / "seeds.json").write_text("[")
    with pytest.raises(UsageError, match=r"seeds\.json cannot be read"):
        page_of(tmp_path / "runs")


def test_a_data_set_is_its_card(made, capsys):
    _, text = page_of(made / "shards")
    assert "toy: data card" in text
    assert math.isclose(
        len(text.encode()), int(re.search(r"([\d,]+) bytes", capsys.readouterr().out)[1].replace(",", ""))
    )


def test_what_is_none_of_these_is_refused(made, tmp_path):
    (tmp_path / "folder").mkdir()
    publish_config(tmp_path / "folder", CONFIG)
    for what, options, message in (
        (tmp_path, {}, "is no run .* no runs of several seeds .* and no data set"),
        (tmp_path / "gone", {}, "no features of"),
        (made / "shards", {"data": "a"}, "--data is for the folder of a run"),
        (made / "run" / BEST, {}, f"name the folder of its run, as meshshard report {made / 'run'}"),
        (tmp_path / "folder", {}, "is not there; train first"),
    ):
        with pytest.raises(UsageError, match=message):
            report(str(what), out=tmp_path / "a.html", **options)
    with pytest.raises(UsageError, match="--out is the HTML file to write"):
        report(str(made / "shards"), out=tmp_path)
