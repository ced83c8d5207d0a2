"""PLY files of any types, and what the package plyfile reads from them: the road that is independent of ours."""

import io
import struct
import warnings

import numpy as np
from plyfile import PlyData, PlyParseError

LETTERS = {
    "char": "b",
    "uchar": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "uint": "I",
    "float": "f",
    "double": "d",
}
LETTERS |= {
    f"{sign}int{8 << n}": letter
    for sign, letters in {"": "bhi", "u": "BHI"}.items()
    for n, letter in enumerate(letters)
} | {"float32": "f", "float64": "d"}
INTEGERS = [name for name, letter in LETTERS.items() if letter not in "fd"]
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": "="}


def ply_file(form, elements, newline="\n", blank=" "):
    """`elements`: (name, properties, rows) each; a property is (type of its length or "", type, name), a row has a
    number for each property, or a list of them."""
    head, lines, body = ["ply", f"format {form} 1.0"], [], b""
    for name, properties, rows in elements:
        head.append(f"element {name} {len(rows)}")
        head += [
            f"property {f'list {length} ' if length else ''}{kind} {called}" for length, kind, called in properties
        ]
        for row in rows:
            words = []
            for (length, kind, _), value in zip(properties, row, strict=True):
                values = value if length else [value]
                if length:
                    body += struct.pack(ORDERS[form] + LETTERS[length], len(values))
                    words.append(len(values))
                body += struct.pack(f"{ORDERS[form]}{len(values)}{LETTERS[kind]}", *values)
                words += values
            lines.append(blank.join(map(repr, words)))
    header = newline.join([*head, "end_header", ""]).encode()
    return header + (newline.join([*lines, ""]).encode() if form == "ascii" else body)


def any_value(rng, kind):
    """A number of a type, its limits among them."""
    letter = LETTERS[kind]
    if letter in "fd":
        return rng.choice([0.5, -1.25, 3.0, 1e-3, 0.1, 123456.789, -0.0, 1e30, float("inf")])
    bits = 8 * struct.calcsize("=" + letter)
    low, high = (0, 2**bits - 1) if letter.isupper() else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return rng.choice([low, high, 0, 1, rng.randint(low, high)])


def any_file(rng):
    """A mesh of few vertices and faces, with further properties, lists and elements anywhere."""
    uneven, count = rng.random() < 0.6, rng.randint(3, 6)

    def further(number):
        return [
            (rng.choice(["", "", rng.choice(INTEGERS)]), rng.choice([*LETTERS]), rng.choice("abcd"))
            for _ in range(number)
        ]

    def value(length, kind, called):
        if called in "xyz":
            return rng.randint(0, 100)
        if called.startswith("vertex"):
            return [rng.randrange(count) for _ in range(rng.randint(3, 5) if uneven else 3)]
        if length:
            return [any_value(rng, kind) for _ in range(rng.randint(0, 2) if uneven else 2)]
        return any_value(rng, kind)

    def element(name, geometry, rows, more):
        properties = further(more)
        at = 0
        for column in geometry:
            at = rng.randint(at, len(properties))
            properties.insert(at, column)
            at += 1
        return name, properties, [[value(*column) for column in properties] for _ in range(rows)]

    corners = (rng.choice(INTEGERS), rng.choice(INTEGERS), rng.choice(["vertex_indices", "vertex_index"]))
    elements = [
        element("vertex", [("", rng.choice([*LETTERS]), axis) for axis in "xyz"], count, rng.choice([0, 0, 2])),
        element("face", [corners], rng.randint(1, 5), rng.choice([0, 0, 1, 2])),
    ]
    for number in range(rng.choice([0, 0, 1, 2])):
        elements.append(element(f"other{number}", [], rng.randint(0, 3), rng.randint(1, 3)))
    rng.shuffle(elements)
    blank = rng.choice([" ", "  ", "\t"])
    return ply_file(rng.choice([*ORDERS]), elements, rng.choice(["\n", "\r\n", "\r"]), blank)


def plyfile_columns(data, header):
    """Element -> what plyfile reads of each property, lists as (lengths, values); None where it refuses, or bytes are
    left. It is given a header of its own: with lengths without a sign, of a list of length -1 it would read the rest
    of the file, and with names that are there once."""
    lines = ["ply", f"format {header.format} 1.0"]
    for name, element in header.elements.items():
        lines.append(f"element {name} {element.rows}")
        for number, column in enumerate(element.properties):
            length = f"list {'u' + column.length_type.removeprefix('u')} " if column.length_type else ""
            lines.append(f"property {length}{column.type} p{number}")
    body = data[header.end :]
    if header.is_text:
        body = body.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    stream = io.BytesIO("\n".join([*lines, "end_header", ""]).encode() + body)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # from np.loadtxt, for an empty list
            warnings.simplefilter("error", DeprecationWarning)  # from np.loadtxt, for an integer with a fraction
            content = PlyData.read(stream, mmap=False)
    except (PlyParseError, ValueError, OverflowError, DeprecationWarning):
        return None
    if not header.is_text and stream.read():
        return None
    return {
        name: [_column(content[name][f"p{number}"], column) for number, column in enumerate(element.properties)]
        for name, element in header.elements.items()
    }


def _column(read, column):
    if not column.length_type:
        return native(read)
    empty = np.empty(0, LETTERS[column.type])
    return [len(row) for row in read], native(np.concatenate([empty, *read]).astype(LETTERS[column.type]))


def native(values):
    """Type and bytes of an array, whatever its byte order was."""
    values = values.astype(values.dtype.newbyteorder("="))
    return values.dtype.str, values.tobytes()
