"""Human bodies as Maron et al. publish them: shared label files, two tests that never were, one that is renamed."""

from collections import Counter

import pytest
from light import LIGHT
from shapes import box, write_labels, write_off

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_prep.datasets import read_dataset
from meshshard_prep.run import run

BOX = box()
FRAMES = {"bouncing": 22, "crane": 20, "handstand": 21, "jumping": 22, "march1": 20, "march2": 22} | {
    "squat1": 21,
    "squat2": 21,
}


@pytest.fixture
def bodies(tmp_path):
    """The published folders and counts; what a label file says tells which file it is."""
    meshes, segs = tmp_path / "meshes", tmp_path / "segs"
    for number in range(41):
        write_off(meshes / "train" / "adobe" / f"body{number}_tri_fixed.off", *BOX)
        write_labels(segs / "train" / "adobe" / f"body{number}_tri_fixed.txt", [1] * 12)
    for number in range(100):
        write_off(meshes / "train" / "faust" / f"tr_reg_{number:03}.off", *BOX)
    write_labels(segs / "train" / "faust" / "faust_corrected.txt", [2] * 12)
    for pose, frames in FRAMES.items():
        for frame in range(frames):
            write_off(meshes / f"train/MIT_animation/meshes_{pose}/meshes/mesh_{frame:04}.off", *BOX)
        write_labels(segs / "train" / "mit" / f"mit_{pose}_corrected.txt", [3] * 12)
    for number in range(71):
        write_off(meshes / "train" / "scape" / f"mesh{number:03}.off", *BOX)
    write_labels(segs / "train" / "scape" / "scape_corrected.txt", ["4.0000000e+00"] * 12)  # as some tools write 4
    for number in range(1, 21):
        if number not in (16, 18):
            name = "12_fix_orientation" if number == 12 else f"{number}"
            write_off(meshes / "test" / "shrec" / f"{name}.off", *BOX)
            write_labels(segs / "test" / "shrec" / f"shrec_{number}_full.txt", [8] * 12)
    return tmp_path


def test_the_whole_of_it(bodies):
    dataset = read_dataset("human_seg_original", bodies)
    assert dataset.notes == ()
    assert Counter(entry.split for entry in dataset.entries) == {"train": 381, "test": 18}
    assert len({entry.group for entry in dataset.entries if entry.split == "train"}) == 8 + 10 + 1 + 41
    named = {entry.id: entry for entry in dataset.entries}
    # as in human_seg
    assert "train/MIT_animation__meshes_march1__meshes__mesh_0010" in named
    assert "train/faust__tr_reg_042" in named
    assert named["test/shrec__12"].source == "meshes/test/shrec/12_fix_orientation.off"


def test_every_source_gets_its_own_label_file(bodies, tmp_path):
    dataset = read_dataset("human_seg_original", bodies)
    kept = [entry for entry in dataset.entries if entry.id.endswith(("body0_tri_fixed", "_000", "h_0000", "mesh000"))]
    kept += [entry for entry in dataset.entries if entry.split == "test"]
    small = type(dataset)(
        name="small", task="segmentation", classes=dataset.classes, entries=tuple(kept), notes=dataset.notes
    )
    assert run(small, tmp_path / "out", LIGHT, jobs=1).ok
    labels = {sample.id: set(sample.face_labels.tolist()) for sample in open_dataset(tmp_path / "out")}
    assert labels["train/adobe__body0_tri_fixed"] == {0}
    assert labels["train/faust__tr_reg_000"] == {1}
    assert labels["train/MIT_animation__meshes_crane__meshes__mesh_0000"] == {2}
    assert labels["train/scape__mesh000"] == {3}
    assert labels["test/shrec__12"] == {7}
    assert len(labels) == 1 + 1 + 8 + 1 + 18


def test_what_is_missing_or_too_much_is_told(bodies):
    (bodies / "meshes" / "test" / "shrec" / "12_fix_orientation.off").rename(bodies / "meshes/test/shrec/12.off")
    (bodies / "meshes" / "train" / "scape").rename(bodies / "elsewhere")
    assert read_dataset("human_seg_original", bodies).notes == (
        "missing folders of meshes: train/scape",
        "missing test bodies: 12_fix_orientation",
        "meshes that are not part of the layout, and were not read: 1 in test/shrec",
        "human_seg_original has 381 train meshes, and 310 were found",
        "human_seg_original has 18 test meshes, and 17 were found",
    )


def test_another_layout_is_refused(tmp_path):
    write_off(tmp_path / "train" / "1.off", *BOX)
    with pytest.raises(UsageError, match="not in the layout of the human bodies"):
        read_dataset("human_seg_original", tmp_path)
