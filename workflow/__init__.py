"""From a study's description to its report, and the command line `inelastic`."""
