"""Mesh files in, RawMesh out: OBJ, OFF and PLY, told apart by their content and only then by their name."""

import codecs
import contextlib
import errno
import hashlib
import io
import re
import stat
from collections.abc import Iterator
from pathlib import Path

from meshshard.errors import InvalidMesh, UsageError
from meshshard_prep.formats.obj import STATEMENTS, parse_obj
from meshshard_prep.formats.off import is_off, parse_off
from meshshard_prep.formats.ply import parse_ply
from meshshard_prep.formats.ply_header import is_ply
from meshshard_prep.formats.text import CONTROL_BYTES, refusal, shown
from meshshard_prep.mesh import RawMesh

_NOT_MESHES = {
    b"\x1f\x8b": "a gzip archive",
    b"PK\x03\x04": "a zip archive",
    b"BZh": "a bzip2 archive",
    b"\xfd7zXZ": "an xz archive",
    b"7z\xbc\xaf": "a 7z archive",
    b"Rar!": "a rar archive",
    b"\x28\xb5\x2f\xfd": "a zstd archive",
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"GIF8": "a GIF image",
    b"II*\0": "a TIFF image",
    b"MM\0*": "a TIFF image",
    b"%PDF": "a PDF document",
    b"\x7fELF": "an ELF program",
    b"MZ": "a Windows program",
    b"\x4c\x01": "a COFF object file, which compilers name .obj too",
    b"\x64\x86": "a COFF object file, which compilers name .obj too",
    b"\0\0\xff\xff": "a COFF object file, which compilers name .obj too",
    b"\xcf\xfa\xed\xfe": "a Mach-O program",
    b"\x89HDF": "an HDF5 file",
    b"\x93NUMPY": "a NumPy array",
    b"bplist00": "a Safari web archive",
}
"""First bytes -> what has them."""

_OTHER_FORMATS = {
    b"glTF": "a binary glTF",
    b"#VRML": "a VRML",
    b"# vtk": "a VTK",
    b"Kaydara FBX": "an FBX",
    b"; FBX": "an FBX",
    b"BLENDER": "a Blender",
    b"PXR-USDC": "a USD",
    b"#usda": "a USD",
    b"ISO-10303-21": "a STEP",
    b"MeshVersionFormatted": "a Medit mesh",
    b"$MeshFormat": "a Gmsh mesh",
}
"""First bytes of mesh formats that are not read -> their name."""

_PARSERS = {"OBJ": parse_obj, "OFF": parse_off, "PLY": parse_ply}

_FIRST_WORD = re.compile(rb"(?:\s|#[^\r\n]*+)*+(\S{0,100})")


def read_mesh(path: Path) -> RawMesh:
    """Read a mesh file; InvalidMesh says why not, with the place in the file."""
    return parse_mesh(read_file(path, str(path)), str(path), path.suffix)


def read_file(path: Path, place: str) -> bytes:
    """The bytes of a regular file; `place` names it in the refusal where they cannot be had."""
    with _opened(path, place) as file:
        return file.read()


def sha256_of_input(path: Path, place: str) -> str:
    """The sha256 of a file's bytes, which are not held all at once; refusals are those of `read_file`."""
    with _opened(path, place) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextlib.contextmanager
def _opened(path: Path, place: str) -> Iterator[io.BufferedReader]:
    rule, advice = "the file can be read", "Check its name and permissions."
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise refusal("unreadable", rule, "it is no regular file", place, advice)
        with path.open("rb") as file:
            yield file
    except OSError as error:
        if error.errno in (errno.EMFILE, errno.ENFILE):  # no fault of the file
            raise UsageError(f"{place}: {error.strerror}; raise the limit: ulimit -n 65536") from error
        raise refusal("unreadable", rule, f"the system says {error.strerror!r}", place, advice) from error


def parse_mesh(data: bytes, place: str, suffix: str = "") -> RawMesh:
    """Read the bytes of a mesh file; `place` names it in refusals, `suffix` only helps to word one."""
    return _PARSERS[format_of(data, place, suffix)](data.removeprefix(codecs.BOM_UTF8), place)


def format_of(data: bytes, place: str, suffix: str = "") -> str:
    """ "OBJ", "OFF" or "PLY", by what the bytes are; InvalidMesh where they are something else."""
    data = data.removeprefix(codecs.BOM_UTF8)
    if not data.strip():
        found = f"it has {len(data)} bytes, all white space" if data else "it has no bytes"
        raise refusal("empty-file", "a mesh file has content", found, place)
    _refuse_other_content(data, place)
    if is_ply(data):
        return "PLY"
    if is_off(data):
        return "OFF"
    _refuse_other_encoding(data, place)
    keyword = {".off": "OFF", ".ply": "ply"}.get(suffix.lower())
    first = _first_word(data)
    if keyword and first not in STATEMENTS:
        rule, found = f"a file named {suffix} starts with the word {keyword}", f"this one starts with {shown(first)}"
        raise refusal("bad-line", rule, found, place)
    return "OBJ"


def _first_word(data: bytes) -> str:
    """The first word that is in no comment, or as much of it as is needed to know it."""
    match = _FIRST_WORD.match(data)
    return match[1].decode("latin-1") if match else ""


def _refuse_other_content(data: bytes, place: str) -> None:
    def not_a_mesh(what: str, advice: str) -> InvalidMesh:
        return refusal("not-a-mesh", "the file is a mesh", f"it is {what}", place, advice)

    def unsupported(what: str) -> InvalidMesh:
        rule, advice = "OBJ, OFF and PLY are read", "Convert it to one of these."
        return refusal("unsupported-format", rule, f"this is {what} file", place, advice)

    if data.startswith(b"version https://git-lfs"):
        raise not_a_mesh("a Git-LFS pointer", "Fetch the file itself with git lfs pull.")
    if len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        raise unsupported("a binary STL")
    if data.startswith(b"MM") and int.from_bytes(data[2:6], "little") == len(data):
        raise unsupported("a 3DS")
    if _first_word(data) == "solid":
        raise unsupported("an STL")
    for start, what in _OTHER_FORMATS.items():
        if data.startswith(start):
            raise unsupported(what)
    for start, what in _NOT_MESHES.items():
        if data.startswith(start):
            raise not_a_mesh(what, "Put the mesh itself in its place.")
    markup = data[:4096].lstrip().lower()
    if markup.startswith(b"<"):
        if b"<collada" in markup or b"<x3d" in markup:
            raise unsupported("a COLLADA or X3D")
        raise not_a_mesh("a web page or other XML", "Download the file itself, not the page that shows it.")
    if markup.startswith(b"{"):
        if b'"asset"' in data:
            raise unsupported("a glTF")
        raise not_a_mesh("JSON", "Put the mesh itself in its place.")


def _refuse_other_encoding(data: bytes, place: str) -> None:
    """Text in UTF-16, and what is no text at all; single bytes that are wrong are found with their line later."""
    head = data[:4096]
    zeros = sorted((head[0::2].count(0), head[1::2].count(0)))
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or (zeros[0] == 0 and zeros[1] * 3 > len(head)):
        advice = "Save the file as UTF-8, or export it again."
        raise refusal("bad-encoding", "the text is UTF-8", "it is UTF-16", place, advice)
    controls = len(head) - len(head.translate(None, CONTROL_BYTES))
    if controls * 20 > len(head):
        found, advice = "it is binary data of an unknown kind", "Put the mesh itself in its place."
        raise refusal("not-a-mesh", "the file is a mesh", found, place, advice)
