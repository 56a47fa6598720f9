"""Processes, threads, and libraries that are imported when they are first wanted."""
