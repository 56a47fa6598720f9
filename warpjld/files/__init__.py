"""File access: checked reading, atomic writing, and a cache of computed values."""
