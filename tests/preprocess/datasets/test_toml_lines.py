"""Every value of a generated TOML text is the number of its own line: tomllib says it, and the scan must too."""

import random
import tomllib

import pytest

from meshshard_prep.datasets.own.lines import lines_of_keys

TRAPS = [
    '"[labels] # no comment"',
    "'a = 1'",
    '"""\nfiles = 3\n[splits]\n"""',
    "'''\n'quoted' = 1\n'''",
    '"\\"]"',
    "1979-05-27 07:32:00",
]


def written(rng: random.Random) -> str:
    """A valid TOML text of tables, dotted keys, inline tables, lists over several lines, comments and traps."""
    text, names = "", iter(f"key{number}" for number in range(10**6))

    def line() -> int:
        return text.count("\n") + 1

    for table in range(rng.randint(1, 5)):
        if table:
            text += rng.choice(["[{}]", "[ {} . deep ] # x = 1", '["{} with = blank"]', "[['{}']]"]).format(
                next(names)
            )
            text += "\n" * rng.randint(1, 3)
        for _ in range(rng.randint(1, 6)):
            key = rng.choice(["{}", '"{} [x]"', "'{} = #'", "{} . inner", "{}.a.'b.c'"]).format(next(names))
            kind = rng.choice(["number", "list", "inline", "nested", "trap"])
            text += f"{key} = "
            if kind == "trap":
                text += rng.choice(TRAPS)
            elif kind == "number":
                text += f"{line()} # {next(names)} = [1,"
            elif kind == "inline":
                text += f"{{ {next(names)} = {line()}, '{next(names)}' = [ {line()}, {line()} ] }}"
            else:
                text += "["
                for _ in range(rng.randint(0, 4)):
                    text += rng.choice(["\n", "", " # ], no end\n"])
                    text += f"[{line()}, '],'], " if kind == "nested" else f"{line()}, "
                text += rng.choice(["\n]", "]"])
            text += rng.choice(["\n", "\n\n", " # end\r\n"])
    return text


def leaves(value, path=()):
    """Path and number of every integer below; lists of tables are one table, as the scan sees them."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*path, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        yield from leaves(value[0], path)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from leaves(inner, (*path, number))
    elif isinstance(value, int):
        yield path, value


@pytest.mark.parametrize("seed", range(200))
def test_lines_are_those_that_the_values_name(seed):
    text = written(random.Random(seed))
    lines = lines_of_keys(text)
    found = dict(leaves(tomllib.loads(text)))
    assert {path: lines[path] for path in found} == found, text


def test_a_table_is_found_where_it_is_opened():
    lines = lines_of_keys("name = 'x'\n\n[a.b]\nc = 1\n[a]\nd = 2\n")
    assert lines == {("name",): 1, ("a",): 3, ("a", "b"): 3, ("a", "b", "c"): 4, ("a", "d"): 6}


def test_an_empty_text_has_no_keys():
    assert lines_of_keys("") == lines_of_keys("# name = 1\n\n") == {}
