"""Reader of FBX files, by ufbx.

:mod:`extract` calls ufbx in a process of its own, :mod:`scene` starts it and holds its result, :mod:`skeleton` finds
the joints and their rest pose, :mod:`rig` binds meshes to them.
"""
