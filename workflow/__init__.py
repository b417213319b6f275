"""The workflow leads from a study's description to its report; its command line is `inelastic`."""
