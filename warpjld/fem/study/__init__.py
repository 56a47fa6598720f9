"""Studies: a deformable body and load steps, read from TOML files, with their results in a folder."""
