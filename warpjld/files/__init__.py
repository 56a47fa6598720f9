"""Files that are read and written: whole or not at all, checked before work, kept between processes."""
