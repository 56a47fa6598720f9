"""Reader of FBX files, by ufbx.

:mod:`extract` is the program that calls ufbx, :mod:`scene` runs it and holds its result, :mod:`skeleton` finds the
joints and their rest pose, :mod:`rig` binds meshes to them.
"""
