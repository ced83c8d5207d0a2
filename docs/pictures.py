"""Draws the pictures of the tutorial again, into docs/images: `make pictures`, a minute. minicoseg-val.png is
runs/minicoseg/val.png of `make train`."""

import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure

from meshshard.palette import colours_between
from meshshard.render import render
from meshshard_prep import compute_features
from meshshard_prep.minicoseg import make_mesh

DOCS = Path(__file__).parent
SHOWN = (0, 8, 15)
"""Which of the recipe's times."""

DPI = 110


def heat(path: Path) -> None:
    """A chair coloured by the logarithm of its HKS; each time has colours of its own."""
    mesh = make_mesh("chair", 1, faces=4000)
    sample = compute_features(mesh.vertices, mesh.faces)
    colours = ListedColormap(colours_between(np.linspace(0, 1, 256), 0, 1) / 255)
    figure = Figure(figsize=(3.1 * len(SHOWN), 3.4), dpi=DPI, layout="constrained")
    for axes, number in zip(figure.subplots(1, len(SHOWN)), SHOWN, strict=True):
        values = sample.hks[:, number]
        low, high = np.quantile(values, [0.02, 0.98])
        shades = colours_between(np.log(values), np.log(low), np.log(high))
        axes.imshow(render(sample.vertices, sample.faces, shades[sample.faces], size=3 * DPI))
        axes.set_axis_off()
        axes.set_title(f"HKS at t = {sample.times[number]:.3g} squared radii", fontsize="small")
        bar = figure.colorbar(ScalarMappable(LogNorm(low, high), colours), ax=axes, location="bottom", shrink=0.8)
        ticks = np.geomspace(low, high, 3)
        bar.set_ticks(ticks, labels=[f"{tick:.2g}" for tick in ticks])
        bar.ax.minorticks_off()
        bar.ax.tick_params(labelsize="small")
    figure.savefig(path)


def tutorial(images: Path) -> None:
    """Run the tutorial's commands, and keep two of the pictures that they make."""
    commands = re.findall(r"```bash\n(.*?)```", (DOCS / "tutorial.md").read_text(encoding="utf-8"), flags=re.S)
    with TemporaryDirectory() as folder:
        subprocess.run(["bash", "-e", "-c", "\n".join(commands)], cwd=folder, check=True)
        shutil.copy(Path(folder) / "runs" / "vases" / "test.png", images / "tutorial-test.png")
        shutil.copy(Path(folder) / "labelled" / "vase_000.png", images / "tutorial-predict.png")


if __name__ == "__main__":
    heat(DOCS / "images" / "hks.png")
    tutorial(DOCS / "images")
