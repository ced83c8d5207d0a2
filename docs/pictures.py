"""Draws the pictures of the documents again, into docs/images, by commands of the program: `make pictures`, a minute
and a Chromium. minicoseg-val.png is runs/minicoseg/val.png of `make train`."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import sync_playwright

DOCS = Path(__file__).parent
HEAT = """
meshshard generate chairs --family chair --count 1 --faces 4000
meshshard features chairs/dataset.toml --out shards
meshshard gallery shards --colour hks:0 --colour hks:8 --colour hks:15 --out heat.png
"""
GALLERY = "meshshard gallery runs/vases --out gallery.png --colour label --colour prediction --colour errors"


def run(commands: str, folder: str) -> None:
    """Lines of a shell in a folder, where `meshshard` is the one beside this Python."""
    here = os.environ | {"PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))}
    subprocess.run(["bash", "-e", "-c", commands], cwd=folder, env=here, check=True)


def heat(images: Path) -> None:
    """A chair coloured by the logarithm of its HKS; each time has colours of its own."""
    with TemporaryDirectory() as folder:
        run(HEAT, folder)
        shutil.copy(Path(folder) / "heat.png", images / "hks.png")


def tutorial(images: Path) -> None:
    """Run the tutorial's commands, and keep two of the pictures that they make; draw its run as a gallery."""
    commands = re.findall(r"```bash\n(.*?)```", (DOCS / "tutorial.md").read_text(encoding="utf-8"), flags=re.S)
    with TemporaryDirectory() as folder:
        run("\n".join(commands), folder)
        run(GALLERY, folder)
        shutil.copy(Path(folder) / "gallery.png", images / "gallery.png")
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
    heat(DOCS / "images")
    tutorial(DOCS / "images")
