"""Finite-element studies: a deformable body and load steps from a TOML file, results in a folder."""
