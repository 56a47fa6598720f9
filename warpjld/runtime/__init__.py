"""Worker processes, threads, and lazily imported libraries."""
