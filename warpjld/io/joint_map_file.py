"""Joint map files (JSON): user-stated pairs of canonical joint and file joint, where recognition errs or is unsure.

::

    {
      "left.hip": "LeftLeg",
      "left.knee": "LeftShin",
      "left.index.tip": null,
      "ignore": ["Weapon_Socket", "LeftLegHelper"]
    }

Keys are canonical joints, values the file's own names (``name#2`` is the second of that name); null: the file has no
such joint. ``ignore`` lists joints of the file that are not to be kept as joints: their flesh follows the joint above.
Joints that are not stated are recognised as usual; stated ones override everything. ``warpjld inspect RIG --write-map
map.json`` writes the recognised joints, for editing.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.text_file import read_json
from warpjld.files.whole_file import whole_file
from warpjld.rig import Rig
from warpjld.skeleton.recognise.joint_map import check_stated, is_canonical

__all__ = ["read_joint_map", "write_joint_map"]


def read_joint_map(path: str | Path) -> dict[str, Any]:
    """Content of a joint map; whether the rig file has those joints is checked when it is loaded.

    Raises:
        InputError: The file cannot be read, or is not a joint map.
    """
    content = read_json(path)
    if not isinstance(content, dict):
        raise InputError('want a joint map: {"left.knee": "name in the file", …}', path=path)
    try:
        check_stated(content)
    except InputError as error:
        raise InputError(error.message, path=path) from None
    return content


def write_joint_map(path: str | Path, rig: Rig) -> None:
    """Write the joint map of a rig as recognised, with null for added joints.

    Raises:
        InputError: The rig is not from a file, or the map cannot be written.
    """
    tree = rig.source
    if tree is None:
        raise InputError("a generated rig has no joints of a file: there is nothing to map")
    content = {
        name: None if joint < 0 else tree.own_name(joint)
        for name, joint in zip(rig.skeleton.names, rig.sources, strict=True)
        if is_canonical(name)
    }
    try:
        with whole_file(Path(path)) as part:
            part.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", "utf-8")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror}", path=path) from None
