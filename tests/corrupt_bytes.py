"""Meshes as the bytes of OBJ, OFF and PLY files, and what may be wrong with bytes: functions of them and a source of
random numbers."""

import struct

import numpy as np

ODD_NUMBERS = [
    *["nan", "NaN", "-inf", "1e400", "-1e400", "1e-400", "1e308", "1e-308", "1e200", "1e39", "1e999999999", "1#IND"],
    *["0x10", "1_0", "1,5", "-0", "+1", "1.", ".5", "1e", "e5", "-", "\u0663", "9" * 30, "9" * 5000, "1" + "0" * 400],
]
ODD_COUNTS = ["0", "1", "-1", "3", "255", "256", "65536", "2147483648", "4294967295", "9" * 18, "9" * 40, "1e3", "x"]
ODD_TYPES = [b"char", b"uchar", b"short", b"int", b"uint", b"float", b"double", b"int128", b"list uchar int"]


def _text(value: float) -> str:
    return repr(float(value))


def obj(v, f, rng) -> bytes:
    corner = rng.choice(["{}", "{}/1", "{}//2", "{}/1/2"])
    lines = ["v " + " ".join(map(_text, row)) for row in v]
    return "\n".join([*lines, *("f " + " ".join(corner.format(i + 1) for i in face) for face in f), ""]).encode()


def off(v, f, _rng) -> bytes:
    lines = ["OFF", f"{len(v)} {len(f)} 0", *(" ".join(map(_text, row)) for row in v)]
    return "\n".join([*lines, *(" ".join(map(str, [len(face), *face])) for face in f), ""]).encode()


def _ply(v, f, rng, form: str) -> bytes:
    real = rng.choice(["float", "double"])
    header = (
        f"ply\nformat {form} 1.0\ncomment made up\nelement vertex {len(v)}\n"
        + "".join(f"property {real} {axis}\n" for axis in "xyz")
        + f"element face {len(f)}\nproperty list uint int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        return header + off(v, f, rng).split(b"\n", 2)[2]
    order = "<" if "little" in form else ">"
    with np.errstate(over="ignore"):
        body = np.asarray(v).astype(order + {"float": "f4", "double": "f8"}[real]).tobytes()
    faces = [struct.pack(order + "I", len(face)) + b"".join(_int(i, order) for i in face) for face in f]
    return header + body + b"".join(faces)


def _int(value: int, order: str) -> bytes:
    return struct.pack(order + "I", value % 2**32)


def ply_text(v, f, rng) -> bytes:
    return _ply(v, f, rng, "ascii")


def ply_little(v, f, rng) -> bytes:
    return _ply(v, f, rng, "binary_little_endian")


def ply_big(v, f, rng) -> bytes:
    return _ply(v, f, rng, "binary_big_endian")


WRITERS = [obj, off, ply_text, ply_little, ply_big]


def flips(data, rng):
    found = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8, 64])):
        found[rng.randrange(len(found))] ^= 1 << rng.randrange(8)
    return bytes(found)


def cut(data, rng):
    return data[: rng.randrange(len(data))]


def headless(data, rng):
    return data[rng.randrange(len(data)) :]


def _span(data, rng) -> tuple[int, int]:
    start = rng.randrange(len(data))
    return start, min(len(data), start + int(10 ** rng.uniform(0, 3)))


def doubled_span(data, rng):
    start, stop = _span(data, rng)
    return data[:stop] + data[start:stop] * rng.choice([1, 1, 3]) + data[stop:]


def deleted_span(data, rng):
    start, stop = _span(data, rng)
    return data[:start] + data[stop:]


def filled_span(data, rng):
    start, stop = _span(data, rng)
    fill = rng.choice([b"\0", b"\xff", b" ", b"\n", b"9", b"/", b"-", b"#", b"\\\n", b"\x1a"])
    return data[:start] + (fill * (stop - start))[: stop - start] + data[stop:]


def moved_span(data, rng):
    start, stop = _span(data, rng)
    at = rng.randrange(len(data))
    rest = data[:start] + data[stop:]
    return rest[:at] + data[start:stop] + rest[at:]


def other_order(data, _rng):
    little, big = b"binary_little_endian", b"binary_big_endian"
    return data.replace(little, big) if little in data else data.replace(big, little).replace(b"ascii", little)


def other_line_ends(data, rng):
    return data.replace(b"\n", rng.choice([b"\r\n", b"\r", b"\n\n", b"\n\r", b"\x0b", b"\x85", b"\\\n"]))


def marked(data, rng):
    return rng.choice([b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff", b"\0", b"\x1a"]) + data


def other_encoding(data, rng):
    return data.decode("latin-1").encode(rng.choice(["utf-16", "utf-16-le", "utf-16-be", "utf-8", "utf-32"]))


def _words(data: bytes) -> list[bytes]:
    return data.split(b" ")


def odd_number(data, rng):
    words = _words(data)
    words[rng.randrange(len(words))] = rng.choice(ODD_NUMBERS).encode()
    return b" ".join(words)


def odd_count(data, rng):
    """Another count where a header has one."""
    lines = data.split(b"\n")
    headers = [
        n for n, line in enumerate(lines[:12]) if line.startswith(b"element") or (n == 1 and line[:1].isdigit())
    ]
    if not headers:
        return odd_number(data, rng)
    at = rng.choice(headers)
    words = lines[at].split(b" ")
    words[2 if words[0] == b"element" else rng.randrange(len(words))] = rng.choice(ODD_COUNTS).encode()
    lines[at] = b" ".join(words)
    return b"\n".join(lines)


def odd_type(data, rng):
    """Another type of a column of a PLY; so lengths of lists lie, too."""
    old = rng.choice([b"uint int", b"uint", b"int", b"float", b"double"])
    return data.replace(old, rng.choice(ODD_TYPES), 1)


def odd_length(data, rng):
    """The last list of a PLY has another length, or the last line another first number."""
    start = data.rstrip().rfind(b"\n") + 1
    if b"binary" in data:
        start = max(0, len(data) - 16)
        return data[:start] + rng.randbytes(4) + data[start + 4 :]
    return data[:start] + rng.choice(ODD_COUNTS).encode() + b" " + data[start:]


def comments(data, rng):
    line = rng.choice([b"comment x\n", b"# x\n", b"#" * 5000 + b"\n", b"# " + b"x" * 20000 + b"\n", b"obj_info x\n"])
    at = data.find(b"\n", rng.randrange(len(data))) + 1
    return data[:at] + line * rng.choice([1, 2, 500]) + data[at:]


def long_line(data, rng):
    at = rng.randrange(len(data))
    return data[:at] + rng.choice([b" ", b"0", b"1 ", b"/", b"\\", b"\t"]) * rng.choice([300, 30000]) + data[at:]


def shuffled_lines(data, rng):
    lines = data.split(b"\n")
    rng.shuffle(lines)
    return b"\n".join(lines)


def noise(_data, rng):
    return rng.randbytes(rng.choice([1, 84, 1000]))


BYTES = [
    flips, flips, cut, headless, doubled_span, deleted_span, filled_span, moved_span, other_order, other_line_ends,
    marked, other_encoding, odd_number, odd_number, odd_count, odd_type, odd_length, comments, long_line,
    shuffled_lines, noise,
]  # fmt: skip
