"""Archives in the layouts that are published, made of generated shapes; and hostile ones."""

import io
import tarfile
import zipfile

import numpy as np
from shapes import box, bumpy, write_labels, write_obj


def zip_of(members, path=None):
    """A zip archive of name -> bytes, or name -> ZipInfo-changing function and bytes; as bytes, or at `path`."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(name, data)
    return placed(stream.getvalue(), path)


def tar_of(members, path=None, mode="w:gz"):
    """A tar archive of name -> bytes, or of TarInfo -> bytes; as bytes, or at `path`."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode=mode) as archive:
        for name, data in members:
            info = name if isinstance(name, tarfile.TarInfo) else tarfile.TarInfo(name)
            if info.isreg() and info.size == 0:
                info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return placed(stream.getvalue(), path)


def placed(data, path):
    if path is None:
        return data
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def tar_link(name, target, kind=tarfile.SYMTYPE):
    """A link as a member of a tar archive."""
    info = tarfile.TarInfo(name)
    info.type, info.linkname = kind, target
    return info


def zip_link(name):
    """A symbolic link as a member of a zip archive; its content is the target."""
    info = zipfile.ZipInfo(name)
    info.create_system, info.external_attr = 3, 0o120777 << 16
    return info


def files_below(folder):
    """Path below a folder -> bytes, of every file."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def human_seg(root, train=3, test=1):
    """MeshCNN's layout of human_seg in a folder: one label an edge, from 1."""
    for number in range(train + test):
        vertices, faces = bumpy(number, 1)
        name = f"shrec__{number}" if number >= train else f"scape__mesh{number:03}"
        write_obj(root / ("test" if number >= train else "train") / f"{name}.obj", vertices, faces)
        write_labels(root / "seg" / f"{name}.eseg", 1 + np.arange(len(faces) * 3 // 2) % 8)
    return members_of(root)


def shrec_16(root):
    """MeshCNN's layout of shrec_16 in a folder: two classes of two."""
    for label in ("ants", "bird1"):
        for split in ("train", "test"):
            write_obj(root / label / split / "T1.obj", *box())
    return members_of(root)


def coseg(root):
    """PD-MeshNet's layout of COSEG in a folder: one label a face, from 0."""
    for kind in ("aliens", "chairs", "vases"):
        for split in ("train", "test"):
            write_obj(root / f"coseg_{kind}" / split / f"{split}1.obj", *box())
            write_labels(root / f"coseg_{kind}" / "seg" / f"{split}1.eseg", [0, 1, 2] * 4)
    return members_of(root)


def members_of(root, below=""):
    """Name -> bytes of the files of a folder, sorted; `below`: a folder to put in front."""
    return [(f"{below}{name}", data) for name, data in sorted(files_below(root).items())]
