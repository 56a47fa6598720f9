"""Reading FBX with ufbx.

:mod:`extract` is the program that calls ufbx, :mod:`scene` runs it and holds what it found, :mod:`skeleton` finds the
joints and their rest, :mod:`rig` puts meshes on them.
"""
