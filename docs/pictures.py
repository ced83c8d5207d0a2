"""Draws the pictures of the documents again, into docs/images, by commands of the program: `make pictures`, a minute.
minicoseg-val.png is runs/minicoseg/val.png of `make train`."""

import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

DOCS = Path(__file__).parent
HEAT = """
meshshard generate chairs --family chair --count 1 --faces 4000
meshshard features chairs/dataset.toml --out shards
meshshard gallery shards --colour hks:0 --colour hks:8 --colour hks:15 --out heat.png
"""
GALLERY = "meshshard gallery runs/vases --out gallery.png --colour label --colour prediction --colour errors"


def heat(images: Path) -> None:
    """A chair coloured by the logarithm of its HKS; each time has colours of its own."""
    with TemporaryDirectory() as folder:
        subprocess.run(["bash", "-e", "-c", HEAT], cwd=folder, check=True)
        shutil.copy(Path(folder) / "heat.png", images / "hks.png")


def tutorial(images: Path) -> None:
    """Run the tutorial's commands, and keep two of the pictures that they make; draw its run as a gallery."""
    commands = re.findall(r"```bash\n(.*?)```", (DOCS / "tutorial.md").read_text(encoding="utf-8"), flags=re.S)
    with TemporaryDirectory() as folder:
        subprocess.run(["bash", "-e", "-c", "\n".join(commands)], cwd=folder, check=True)
        subprocess.run(["bash", "-e", "-c", GALLERY], cwd=folder, check=True)
        shutil.copy(Path(folder) / "gallery.png", images / "gallery.png")
        shutil.copy(Path(folder) / "runs" / "vases" / "test.png", images / "tutorial-test.png")
        shutil.copy(Path(folder) / "labelled" / "vase_000.png", images / "tutorial-predict.png")


if __name__ == "__main__":
    heat(DOCS / "images")
    tutorial(DOCS / "images")
