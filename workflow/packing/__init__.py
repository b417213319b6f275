"""A packing in one call: particles, a container, and back come positions, contacts and numbers.

LAMMPS runs beside Python, in a folder of its own, with the shipped deck `pack`: whatever stops it
leaves the user's process, and an interrupt stops it; several ranks are `mpiexec` as ever.
"""

from .containers import Ball, Box, Container, Cylinder
from .one_call import pack
from .result import NotAtRestError, Packing
from .shapes import Cluster, Dimer, Shape, Sphere

__all__ = [
    "Ball",
    "Box",
    "Cluster",
    "Container",
    "Cylinder",
    "Dimer",
    "NotAtRestError",
    "Packing",
    "Shape",
    "Sphere",
    "pack",
]
