"""Where the research data is: MESHSHARD_DATA, or a folder beside the repository. Tests marked `data` need it."""

import os
from pathlib import Path

DATA = Path(os.environ.get("MESHSHARD_DATA", Path(__file__).parents[2] / "shared" / "data"))
