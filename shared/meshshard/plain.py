"""Results as JSON that every reader takes."""

import json
import math
from typing import Any


def to_json(value: Any) -> str:
    """Indented JSON; what is not a finite number becomes null, for JSON has no NaN."""
    return json.dumps(_finite(value), indent=1, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
