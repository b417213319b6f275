"""Time against accuracy: hard contacts beside LAMMPS's soft ones, from the same starts."""
