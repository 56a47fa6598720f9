"""The built-in commands, one subject per file; importing a file registers its commands."""
