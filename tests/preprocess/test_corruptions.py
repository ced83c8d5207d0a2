"""A broken mesh file gives a finite sample or a refusal with a code, in bounded time and memory: goal R9."""

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from corruptions import corrupted
from effort import times

TESTS = Path(__file__).parents[1]
FILES = times(400, 20_000)
BATCH = times(200, 2_000)
SECONDS, MEGABYTES = 10.0, 1024
"""For one file, of at most half a million bytes: typical are 3 ms."""


def held(first: int, count: int) -> tuple[Counter[str], float]:
    """How often each outcome came, and the longest time, of files tried in a process of their own."""
    words = [sys.executable, "corruptions.py", *map(str, (first, count, MEGABYTES))]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONWARNINGS": "error"}
    try:
        done = subprocess.run(
            words, cwd=TESTS, env=environment, capture_output=True, text=True, timeout=60 + count, check=False
        )
    except subprocess.TimeoutExpired as error:
        pytest.fail(f"an endless loop? {(error.stdout or b'').decode().splitlines()[-1]}")
    last = done.stdout.splitlines()[-1] if done.stdout else "nothing was tried"
    assert done.returncode == 0, f"status {done.returncode} at file {last}\n{done.stderr[-2000:]}"
    found = re.findall(r"^= (\S+) (\S+)$", done.stdout, flags=re.MULTILINE)
    assert len(found) == count
    return Counter("stored" if len(code) == 64 else code for code, _ in found), max(float(s) for _, s in found)


@pytest.mark.soak
def test_every_broken_file_is_stored_finite_or_refused(measured):
    batches = [held(first, BATCH) for first in range(0, FILES, BATCH)]
    outcomes = sum((counts for counts, _ in batches), Counter())
    longest = max(seconds for _, seconds in batches)
    stored, codes = outcomes["stored"], len(outcomes) - 1
    assert longest < SECONDS
    assert stored > FILES / 10
    assert codes >= 12  # many rules are met, not one that hides the others
    measured(
        "R9",
        f"{FILES:,} mutated meshes, {stored:,} stored and finite, {FILES - stored:,} refused with {codes} codes, "
        f"no crash, at most {longest:.1f} s and {MEGABYTES} MiB each",
    )


def test_a_file_is_a_function_of_its_number():
    assert [corrupted(seed) for seed in range(50)] == [corrupted(seed) for seed in range(50)]
    assert len({data for _, data in map(corrupted, range(300))}) > 280


@pytest.mark.parametrize(
    ("statement", "status"),
    [("os._exit(3)", 3), ("ctypes.string_at(0)", -11), ("bytearray(2 * 2**30)", 1), ("1 / 0", 1)],
)
def test_a_death_or_a_large_allocation_would_be_seen(statement, status):
    code = (
        f"import corruptions, ctypes, os\n"
        f"def poisoned(data, recipe):\n"
        f"    {statement}\n"
        f"corruptions.outcome = poisoned\n"
        f"corruptions.hold(7, 1, {MEGABYTES})"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=TESTS, capture_output=True, text=True, check=False)
    assert done.returncode == status
    assert done.stdout.startswith("7 paper: ")
    assert "=" not in done.stdout
