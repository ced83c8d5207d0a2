"""A data set described by a small TOML file: name, layout, raw folder, class names."""

import re
import tomllib
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.remote import is_url, listed, to_path
from meshshard_prep.datasets.folder import read_folder
from meshshard_prep.datasets.layout import DOMAINS, RawDataset
from meshshard_prep.datasets.meshcnn import read_classification, read_segmentation

LAYOUTS = ("folder", "meshcnn-segmentation", "meshcnn-classification")
KEYS = {"name": str, "layout": str, "raw": str, "classes": list, "label_domain": str}


def read_toml(path: Path, raw: Path | None = None) -> RawDataset:
    """The data set that a TOML file describes. `raw` replaces its raw folder, which is a URL or relative to the file.

    UsageError names the key: an unknown one, one of another type, an unknown layout or domain.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} is not a TOML file that can be read: {error}") from error
    for key, value in table.items():
        if key not in KEYS:
            raise UsageError(f"{path}: unknown key {key!r}; known are {', '.join(KEYS)}")
        if not isinstance(value, KEYS[key]):
            raise UsageError(f"{path}: {key} is a {KEYS[key].__name__}, not {value!r}")
    layout = table.get("layout", "folder")
    if layout not in LAYOUTS:
        raise UsageError(f"{path}: layout is one of {', '.join(LAYOUTS)}, not {layout!r}")
    if table.get("label_domain", "face") not in DOMAINS:
        raise UsageError(f"{path}: label_domain is one of {', '.join(DOMAINS)}, not {table['label_domain']!r}")
    named = table.get("raw", ".")
    root = listed(raw or (to_path(named) if is_url(named) else path.parent / named))
    if not root.is_dir():
        raise UsageError(f"{path}: the raw folder {root} is not there; set raw, or give --raw")
    name = table.get("name", path.stem)
    if not re.fullmatch(r"\w[\w. -]*", name):
        raise UsageError(f"{path}: name is letters, digits, '_', '-', '.' and blanks, not {name!r}")
    classes = tuple(map(str, table.get("classes", ())))
    if twice := sorted({label for label in classes if classes.count(label) > 1}):
        raise UsageError(f"{path}: classes names {twice[0]!r} twice")
    domains = (table["label_domain"],) if "label_domain" in table else DOMAINS
    if layout == "folder":
        return read_folder(root, name=name, classes=classes, domains=domains)
    if layout == "meshcnn-segmentation":
        return read_segmentation(root, name=name, classes=classes, domains=domains)
    if classes or "label_domain" in table:
        raise UsageError(f"{path}: in layout {layout} the folders are the classes; remove classes and label_domain")
    return read_classification(root, name=name)
