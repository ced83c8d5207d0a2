"""Where the keys of a TOML text are: tomllib says what they are, and not on which line."""

import re
import tomllib

_TOKEN = re.compile(
    r"""(?P<blank>[ \t\r]+|\#[^\n]*)
    | (?P<newline>\n)
    | (?P<text>\"{3}(?:\\.|[^\\])*?\"{3,5} | '{3}.*?'{3,5} | "(?:\\.|[^"\\\n])*" | '[^'\n]*')
    | (?P<mark>[][{}=,.])
    | (?P<word>[^][{}=,."'\#\s]+)""",
    re.VERBOSE | re.DOTALL,
)

Key = tuple[str | int, ...]


def lines_of_keys(text: str) -> dict[Key, int]:
    """Key -> its line, from 1, in a text that tomllib takes. A key is a path: ("splits", "fractions", "train"), and
    ("meshes", 2) for the third value of a list. Of a table that is opened several times, the first line."""
    scan = _Scan(text)
    scan.document()
    return scan.found


class _Scan:
    """Reads tokens one after the other. The text is known to be valid, so nothing is checked."""

    def __init__(self, text: str) -> None:
        self.found: dict[Key, int] = {}
        self.tokens: list[tuple[str, int]] = []
        line = 1
        for match in _TOKEN.finditer(text):
            if match.lastgroup != "blank":
                self.tokens.append((match[0], line))
            line += match[0].count("\n")
        self.tokens.append(("\n", line))
        self.at = 0

    @property
    def token(self) -> str:
        return self.tokens[self.at][0]

    def skip(self, *tokens: str) -> None:
        while self.at < len(self.tokens) and self.token in tokens:
            self.at += 1

    def at_end(self, *tokens: str) -> bool:
        """Whether nothing follows but these."""
        self.skip(*tokens)
        return self.at == len(self.tokens)

    def document(self) -> None:
        header: Key = ()
        while not self.at_end("\n"):
            if self.token == "[":
                self.skip("[")
                header = self.key(())
                self.skip("]")
            else:
                self.pair(header)

    def key(self, above: Key) -> Key:
        """A dotted key; it and the tables it opens are found on its line."""
        while True:
            word, line = self.tokens[self.at]
            above = (*above, next(iter(tomllib.loads(f"{word} = 0"))))
            self.found.setdefault(above, line)
            self.at += 1
            if self.token != ".":
                return above
            self.at += 1

    def pair(self, above: Key) -> None:
        key = self.key(above)
        self.skip("=")
        self.value(key)

    def value(self, key: Key) -> None:
        opening = self.token
        if opening not in ("[", "{"):
            while self.token not in ("\n", ",", "]", "}"):  # 1.5 is two words, and so are a date and its time
                self.at += 1
            return
        self.at += 1
        number = 0
        while not self.at_end("\n", ",") and self.token not in ("]", "}"):
            if opening == "{":
                self.pair(key)
            else:
                self.found[(*key, number)] = self.tokens[self.at][1]
                self.value((*key, number))
                number += 1
        self.at += 1
