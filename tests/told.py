"""What commands tell on their error stream."""

import re


def but_progress(error):
    """What was told without the lines that come every ten seconds: a busy machine is no fault."""
    return re.sub(r"(?m)^.+: \d+ of \d+, .* not stored\n", "", error)
