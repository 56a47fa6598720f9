"""Tables of results: columns with units and descriptions, and their files."""

from warpjld.tables.columns import Column, checked_values

__all__ = ["Column", "checked_values"]
