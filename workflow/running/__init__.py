"""Cases run and measured, on one machine or in an MPI job, and the folder that holds them."""
