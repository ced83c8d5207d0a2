"""Draws the pictures of the tutorial and of view.md again, into docs/images: `make pictures`, a minute and a
Chromium. minicoseg-val.png is runs/minicoseg/val.png of `make train`."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from playwright.sync_api import sync_playwright

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
    here = os.environ | {"PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))}
    with TemporaryDirectory() as folder:
        subprocess.run(["bash", "-e", "-c", "\n".join(commands)], cwd=folder, env=here, check=True)
        shutil.copy(Path(folder) / "runs" / "vases" / "test.png", images / "tutorial-test.png")
        shutil.copy(Path(folder) / "labelled" / "vase_000.png", images / "tutorial-predict.png")
        viewed(Path(folder), images / "view.png")


def viewed(folder: Path, picture: Path) -> None:
    """The page of `meshshard view` on the tutorial's run, as soon as all meshes are judged."""
    call = [sys.executable, "-m", "meshshard", "view", "runs/vases", "--no-open", "--port", "0"]
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    graphics = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")
    server = subprocess.Popen(call, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        address = re.findall(r"http://\S+", server.stdout.readline())[0]
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=chromium, args=graphics)
            page = browser.new_page(viewport={"width": 1280, "height": 920})
            page.goto(address)
            scored = page.get_by_role("button", name="%")
            scored.nth(5).wait_for()
            scored.first.click()
            page.get_by_role("alert").get_by_role("button").click()  # it says that there is no GPU
            page.wait_for_timeout(3000)
            page.mouse.click(430, 460)
            page.locator(".uplot canvas").wait_for()
            page.mouse.move(620, 700)
            page.wait_for_timeout(1000)
            page.screenshot(path=picture)
            browser.close()
    finally:
        server.terminate()


if __name__ == "__main__":
    heat(DOCS / "images" / "hks.png")
    tutorial(DOCS / "images")
