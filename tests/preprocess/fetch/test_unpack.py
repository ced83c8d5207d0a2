"""Archives unpacked as they are, and hostile ones refused; nothing is ever written outside of the folder."""

import random
import shutil
import struct
import tarfile
import zipfile
from types import SimpleNamespace

import pytest
from archives import files_below, placed, tar_link, tar_of, zip_link, zip_of

from meshshard.errors import UsageError
from meshshard_prep.fetch import members, unpack

PLAIN = [("top/train/a.obj", b"v 0 0 0\n" * 900), ("top/seg/a.eseg", b"1\n" * 500), ("top/empty", b"")]
KINDS = {"zip": zip_of, "tar": lambda items: tar_of(items, mode="w:"), "tar.gz": tar_of}


@pytest.fixture
def place(tmp_path):
    """Unpack bytes in a folder of its own; whatever happens, nothing else in that folder has changed."""
    place = tmp_path / "here"
    place.mkdir()
    (place / "other").write_bytes(b"untouched")

    def put(data):
        archive = placed(data, place / "archive")
        shutil.rmtree(place / "out", ignore_errors=True)
        try:
            unpack.unpack(archive, place / "out")
            return files_below(place / "out")
        finally:
            assert sorted(path.name for path in place.iterdir()) == ["archive", "other", "out"]
            assert (place / "other").read_bytes() == b"untouched"
            assert sorted(path.name for path in tmp_path.iterdir()) == ["here"]
            assert not [path for path in (place / "out").rglob("*") if path.is_symlink()]

    return put


def refused(place, data, message):
    with pytest.raises(UsageError, match=message) as caught:
        place(data)
    assert str(caught.value).startswith("archive is not unpacked: ")


@pytest.mark.parametrize("kind", KINDS)
def test_files_come_out_as_they_went_in(place, kind):
    assert place(KINDS[kind](PLAIN)) == dict(PLAIN)


@pytest.mark.parametrize("kind", KINDS)
def test_names_may_be_of_any_language_and_begin_with_a_dot(place, kind):
    items = [("./Stühle/椅子.off", b"OFF"), ("a//b", b"1"), (".hidden", b"2")]
    assert place(KINDS[kind](items)) == {"Stühle/椅子.off": b"OFF", "a/b": b"1", ".hidden": b"2"}


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_finder_adds_is_left_out(place, kind):
    extra = [("__MACOSX/top/._a.obj", b"x"), ("top/._a.obj", b"x"), ("top/.DS_Store", b"x")]
    assert place(KINDS[kind](PLAIN + extra)) == dict(PLAIN)


def test_empty_folders_are_kept(place, tmp_path):
    folder = tarfile.TarInfo("top/none")
    folder.type = tarfile.DIRTYPE
    place(tar_of([(folder, b"")]))
    assert (tmp_path / "here/out/top/none").is_dir()
    place(zip_of([("top/none/", b"")]))
    assert (tmp_path / "here/out/top/none").is_dir()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "name",
    [
        "../other",
        "top/../../other",
        "/etc/evil",
        "//host/x",
        "..",
        "C:evil",
        "C:/evil",
        "..\\other",
        "a\\b",
        "a\nb",
        "x" * 256,
    ],
)
def test_names_that_lead_outside(place, kind, name):
    refused(place, KINDS[kind]([*PLAIN, (name, b"evil")]), "leads outside, or is none for a file")


def test_a_zero_byte_does_not_hide_the_end_of_a_name(place):
    data = zip_of([("train/aXX/../../../other", b"evil")])
    refused(place, data.replace(b"aXX/", b"a\0X/"), "leads outside")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "items",
    [
        [("a", b"1"), ("a", b"2")],
        [("a", b"1"), ("./a", b"2")],
        [("a", b"1"), ("a/b", b"2")],
        [("a/b", b"1"), ("a", b"2")],
        [(".", b"1")],
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_name_twice(place, kind, items):
    refused(place, KINDS[kind](items), "twice|as a file and as a folder")


def test_a_folder_named_like_a_file(place):
    folder = tarfile.TarInfo("a")
    folder.type = tarfile.DIRTYPE
    refused(place, tar_of([("a", b"1"), (folder, b"")]), "as a file and as a folder")
    refused(place, zip_of([("a", b"1"), ("a/", b"")]), "as a file and as a folder")


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE], ids=["symbolic", "hard"])
@pytest.mark.parametrize("target", ["/etc/passwd", "../other", "../../here/other", "top", "nowhere", "", "l"])
def test_links_that_name_no_file_of_the_archive(place, kind, target):
    refused(place, tar_of([*PLAIN, (tar_link("l", target, kind), b"")]), "'l' is a link to .*, which is no file of")


def test_links_in_zip_that_name_no_file_of_the_archive(place):
    refused(place, zip_of([*PLAIN, (zip_link("l"), b"../other")]), "'l' is a link to '../other'")


def test_a_link_to_a_file_of_the_archive_becomes_a_copy(place):
    mesh = dict(PLAIN)["top/train/a.obj"]
    links = [
        (tar_link("top/l", "train/../train/a.obj"), b""),
        (tar_link("top/h", "top/train/a.obj", tarfile.LNKTYPE), b""),
    ]
    assert place(tar_of(links + PLAIN)) == dict(PLAIN) | {"top/l": mesh, "top/h": mesh}
    assert place(zip_of([(zip_link("top/l"), b"train/a.obj"), *PLAIN])) == dict(PLAIN) | {"top/l": mesh}


def test_nothing_is_written_through_a_link(place):
    refused(place, tar_of([(tar_link("l", ".."), b""), ("l/other", b"evil")]), "as a file and as a folder")
    refused(place, tar_of([("top/x", b""), (tar_link("l", "top"), b""), ("l/other", b"evil")]), "as a file and as a")
    refused(place, zip_of([(zip_link("l"), b".."), ("l/other", b"evil")]), "as a file and as a folder")


@pytest.mark.parametrize("kind", [tarfile.CHRTYPE, tarfile.BLKTYPE, tarfile.FIFOTYPE, b"Z"])
def test_devices(place, kind):
    refused(place, tar_of([*PLAIN, (tar_link("d", "", kind), b"")]), "'d' in it is a device or the like")


def test_a_device_in_zip(place):
    info = zipfile.ZipInfo("d")
    info.create_system, info.external_attr = 3, 0o010644 << 16
    refused(place, zip_of([(info, b"")]), "is a device or the like")


@pytest.mark.parametrize("kind", ["zip", "tar.gz"])
def test_a_bomb_is_refused_before_it_is_unpacked(place, kind, monkeypatch, tmp_path):
    monkeypatch.setattr(members, "FLOOR", 1 << 20)
    data = KINDS[kind]([("small", b"1"), ("large", bytes(20 << 20))])
    assert len(data) < 40_000
    refused(place, data, "bytes would become more than 20,971,521, over 100 times as many")
    assert set(files_below(tmp_path / "here/out")) == {"small"}


def test_what_the_disk_cannot_hold(place, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: SimpleNamespace(free=unpack.RESERVE + 1000))
    refused(place, zip_of(PLAIN), "needs more than 7,200 bytes, and the disk has 1,000 free")


def test_copies_by_links_are_weighed_too(place, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: SimpleNamespace(free=unpack.RESERVE + 15_000))
    links = [(tar_link(f"l{n}", "top/train/a.obj"), b"") for n in range(3)]
    refused(place, tar_of(PLAIN + links), "needs more than 15,400 bytes")


def test_too_many_members(place, monkeypatch):
    monkeypatch.setattr(members, "MOST", 2)
    refused(place, zip_of(PLAIN), "it has more than 2 members")


def test_a_header_that_would_fill_the_memory(place):
    huge = tarfile.TarInfo("x")
    huge.type, huge.size = tarfile.XHDTYPE, 8 << 30
    refused(place, huge.tobuf(tarfile.GNU_FORMAT) + bytes(1024), "a header of 8,589,934,592 bytes")


def test_headers_of_headers_without_end(place):
    one = tarfile.TarInfo("x")
    one.type, one.size = tarfile.XHDTYPE, 0
    refused(place, one.tobuf() * 5000 + bytes(1024), "it is damaged or cut short")


def test_a_negative_size(place):
    plain = tarfile.TarInfo("a").tobuf(tarfile.GNU_FORMAT)
    size = b"\xff" * 4 + struct.pack(">q", -512)
    block = plain[:124] + size + plain[136:148] + b" " * 8 + plain[156:]
    block = block[:148] + b"%06o\0 " % sum(block) + block[156:]
    refused(place, block + bytes(1024), "damaged")


def test_encrypted(place):
    data = bytearray(zip_of([("a", b"1")]))
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    refused(place, bytes(data), "'a' in it is encrypted; unpack it with the password")


def test_an_unknown_compression(place):
    data = bytearray(zip_of([("a", b"1")]))
    data[8] = data[data.index(b"PK\x01\x02") + 10] = 99
    refused(place, bytes(data), "it is packed in a way that is not read here .That comp")


def test_names_that_are_not_utf_8(place):
    refused(place, zip_of([("aé", b"1")]).replace("é".encode(), b"\xe9\xe9"), "a name in it is not UTF-8")
    refused(place, tar_of([("aé", b"1")], mode="w:").replace("é".encode(), b"\xe9\xe9"), "not UTF-8|damaged")


def test_utf_8_without_its_mark_is_read_as_utf_8(place):
    data = bytearray(zip_of([("é", b"1")]))
    data[7] &= 0xF7
    data[data.index(b"PK\x01\x02") + 9] &= 0xF7
    assert place(bytes(data)) == {"é": b"1"}


@pytest.mark.parametrize(
    ("head", "message"),
    [
        (b"7z\xbc\xaf\x27\x1c" + bytes(900), "7z is not read here; unpack it with the program of that name"),
        (b"Rar!\x1a\x07" + bytes(900), "rar is not read here"),
        (b"<html><title>Sign in</title></html>", "it is a web page .titled 'Sign in'."),
        (b"", "it is neither a zip nor a tar archive"),
        (b"PK\x03\x04 and no more", "it is damaged or cut short"),
        (b"\x1f\x8b\x08" + bytes(900), "it is damaged or cut short"),
    ],
)
def test_what_is_no_archive(place, head, message):
    refused(place, head, message)


@pytest.mark.parametrize("kind", KINDS)
def test_a_cut_archive_is_refused_wherever_it_was_cut(place, kind):
    data = KINDS[kind]([(f"{n}", random.Random(n).randbytes(700)) for n in range(5)])
    end = 5 * 1536 if kind == "tar" else len(data)  # what follows in a tar archive is padding
    for length in range(0, end, 97):
        refused(place, data[:length], "damaged|neither a zip")


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_archives_are_unpacked_or_refused_and_never_anything_else(place, kind):
    whole = KINDS[kind](PLAIN[:2])
    chance = random.Random(5)
    refusals = 0
    for _ in range(80):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 1, 3, 20))):
            data[chance.randrange(len(data))] = chance.choice((0, 0xFF, chance.randrange(256)))
        try:
            place(bytes(data))
        except UsageError:
            refusals += 1
    assert refusals > 10
