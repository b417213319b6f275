"""What a page to turn holds of its packing."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np

TYPES = {"f4": "<f4", "f8": "<f8", "u1": "<u1", "u2": "<u2", "u4": "<u4"}


def packing_in(path: Path) -> dict[str, Any]:
    """Return what a page is told of its packing."""
    (text,) = re.findall(
        r'<script type="application/json" id="packing">(.*?)</script>', path.read_text(), re.S
    )
    packing: dict[str, Any] = json.loads(text)
    return packing


def array_of(encoded: dict[str, str]) -> Any:
    return np.frombuffer(base64.b64decode(encoded["data"]), dtype=TYPES[encoded["type"]])
