"""What is measured of a finished run, and the HDF5 files that hold it."""
