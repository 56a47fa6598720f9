"""The built-in commands, one subject a file; importing a file adds its commands to the registry."""
