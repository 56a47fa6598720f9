"""Tables of results: their columns with units, and the files they are written to."""

from warpjld.tables.columns import Column, checked_values

__all__ = ["Column", "checked_values"]
