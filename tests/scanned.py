"""`scan` as a test calls it."""

import json

from meshshard_prep.scan.command import scan


def scanned(folder, into, capsys, **options):
    """The TOML file that scan wrote to the folder `into`, and what it said as JSON."""
    file = into / "scanned.toml"
    scan(folder, **({"out": file, "name": "", "force": False, "as_json": True} | options))
    return file, json.loads(capsys.readouterr().out)
