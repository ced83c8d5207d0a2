"""Damage that HDF5's own checksums do not betray: where a file's metadata blocks are, and their checksums anew."""

import re

SIGNATURES = re.compile(rb"OHDR|OCHK|FRHP|FHDB|FHIB|BTHD|BTLF|BTIN|\x89HDF")
LONGEST = 1024
WORD = 0xFFFFFFFF


def lookup3(data: bytes) -> int:
    """Jenkins' hash, which HDF5 stores behind each of its metadata blocks."""
    a = b = c = (0xDEADBEEF + len(data)) & WORD
    words = memoryview(data.ljust(-(-len(data) // 12) * 12, b"\0")).cast("I").tolist()
    for start in range(0, len(words), 3):
        a, b, c = (a + words[start]) & WORD, (b + words[start + 1]) & WORD, (c + words[start + 2]) & WORD
        if start + 3 < len(words):
            for shift in (4, 6, 8, 16, 19, 4):
                a, b, c = b, (c + b) & WORD, (a - c & WORD) ^ _turned(c, shift)
        else:
            for shift in (14, 11, 25, 16, 4, 14, 24):
                a, b, c = b, ((c ^ b) - _turned(b, shift)) & WORD, a
            return b
    return c


def _turned(value: int, by: int) -> int:
    return (value << by | value >> (32 - by)) & WORD


def metadata_blocks(image: bytes) -> list[tuple[int, int]]:
    """Start and end of every block of an undamaged file that is followed by its checksum."""
    found = []
    for match in SIGNATURES.finditer(image):
        start = match.start()
        for end in range(start + 8, min(start + LONGEST, len(image) - 3)):
            if lookup3(image[start:end]) == int.from_bytes(image[end : end + 4], "little"):
                found.append((start, end))
                break
    return found


def seal(image: bytearray, block: tuple[int, int]) -> None:
    """Give a block that was changed its checksum."""
    start, end = block
    image[end : end + 4] = lookup3(bytes(image[start:end])).to_bytes(4, "little")
