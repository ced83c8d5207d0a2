"""What disks, cables and memory do to files."""

import numpy as np


def damaged(whole: bytes, seed: int, within: int | None = None) -> bytes:
    """`whole` with a flipped bit, cut, or with a page of zeros, in its first `within` bytes; never as it was."""
    rng = np.random.default_rng(seed)
    place = int(rng.integers(min(within or len(whole), len(whole))))
    image = bytearray(whole)
    match seed % 3:
        case 0:
            image[place] ^= 1 << int(rng.integers(8))
        case 1:
            del image[place:]
        case _:
            page = slice(place // 4096 * 4096, place // 4096 * 4096 + 4096)
            image[page] = bytes(len(image[page]))
    if image == whole:  # the page was zeros before
        image[place] ^= 1
    return bytes(image)
