"""What the pages that are read first say is so."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from program import meshshard

from meshshard_prep.datasets import read_dataset

DOCS = Path(__file__).parents[1] / "docs"
INSTALLED = os.environ | {"PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))}
"""Where a shell finds `meshshard`."""


def blocks(page):
    """Language and text of each block of code that names its language."""
    return re.findall(r"```(\w+)\n(.*?)```", (DOCS / f"{page}.md").read_text(), flags=re.S)


def shown(text):
    """Its lines, with single blanks, without those that are empty."""
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


def occurs(line, output):
    """Whether a line of the output is this one, where ... stands for anything."""
    pattern = ".*".join(map(re.escape, line.split("...")))
    return any(re.fullmatch(pattern, found) for found in output)


def called(language, step, folder):
    """Exit status, standard output and standard error of a line for a shell, or of a program in Python."""
    if re.fullmatch(r"meshshard [\w ./=-]+(#.*)?", step):
        return meshshard(*shlex.split(step, comments=True)[1:], cwd=folder)
    call = ["bash", "-c", step] if language == "bash" else [sys.executable, "-c", step]
    done = subprocess.run(call, cwd=folder, env=INSTALLED, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("page", ["tutorial", "own_data"])
def test_blocks_do_what_the_page_says(tmp_path, page):
    output = []
    for language, block in blocks(page):
        block = block.replace("--epochs 12", "--epochs 2")  # the same lines, sooner
        if language == "text":
            assert [line for line in shown(block) if not occurs(line, output)] == [], "\n".join(output)
            continue
        output = []
        for step in block.splitlines() if language == "bash" else [block]:
            status, out, error = called(language, step, tmp_path)
            expected = int((re.findall(r"# exit status (\d)", step) or ["0"])[0])
            assert status == expected, f"{step}\n{out}\n{error}"
            output += shown(out)


def test_python_block_of_the_questions():
    (block,) = [block for language, block in blocks("faq") if language == "python"]
    done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, check=True)
    assert ", 16) " in done.stdout


def test_toml_block_of_the_questions(tmp_path):
    (block,) = [block for language, block in blocks("faq") if language == "toml"]
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
    (tmp_path / "painted").mkdir()
    (tmp_path / "painted" / "a.obj").write_text(
        f"{corners}usemtl seat\nf 1 3 2\nusemtl leg\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    (tmp_path / "chairs.toml").write_text(block)
    assert read_dataset(str(tmp_path / "chairs.toml")).classes == ("leg", "seat")


def test_home_page_says_what_the_readme_says():
    first = (DOCS / "index.md").read_text().split("\n\n")[1]
    assert first in (DOCS.parent / "README.md").read_text()
