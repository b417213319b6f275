"""The workflow leads from a study's description to its report; its command line is `inelastic`.

In Python it gives `pack`, a packing in one call, with the names of its shapes and containers. They
are imported when they are asked for: `inelastic` needs none of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .packing import (
        Ball,
        Box,
        Cluster,
        Cylinder,
        Dimer,
        NotAtRestError,
        Packing,
        Sphere,
        pack,
    )

__all__ = [
    "Ball",
    "Box",
    "Cluster",
    "Cylinder",
    "Dimer",
    "NotAtRestError",
    "Packing",
    "Sphere",
    "pack",
]


def __getattr__(name: str) -> Any:
    """Return one of these names."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import packing

    return getattr(packing, name)
