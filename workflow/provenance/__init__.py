"""How a run was made, by which code, and whether its files are still those that it left."""
