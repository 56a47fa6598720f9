"""Rigid-body dynamics of unsupported objects: falling, sliding, rolling, coming to rest."""
