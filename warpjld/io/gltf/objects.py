"""A glTF document's JSON as pygltflib's objects.

pygltflib's general decoder takes half a millisecond for each object: seconds for a scene of many nodes, and most of the
time of reading a small animated rig. What a file has many of, nodes, accessors, buffer views and the channels of
animations, is made directly.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

__all__ = ["gltf_objects"]

_NODE = (
    *("camera", "children", "extensions", "extras", "matrix", "mesh", "name"),
    *("rotation", "scale", "skin", "translation"),
)
_VIEW = ("buffer", "byteLength", "byteOffset", "byteStride", "extensions", "extras", "name", "target")
_ACCESSOR = (
    *("bufferView", "byteOffset", "componentType", "count", "extensions", "extras"),
    *("max", "min", "name", "normalized", "type"),
)
_SAMPLER = ("extensions", "extras", "input", "interpolation", "output")
_TARGET = ("extensions", "extras", "node", "path")


def gltf_objects(content: dict[str, Any]) -> Any:
    """pygltflib's tree of a document that ``check_schema`` has accepted.

    Raises:
        Exception: Of any type, where an object is not what its place requires.
    """
    from pygltflib import GLTF2, Accessor, BufferView, Node

    made = ("nodes", "accessors", "bufferViews", "animations")
    gltf = GLTF2.gltf_from_json(json.dumps({key: value for key, value in content.items() if key not in made}))
    gltf.nodes = [Node(**_given(row, _NODE)) for row in content.get("nodes") or ()]
    gltf.bufferViews = [BufferView(**_given(row, _VIEW)) for row in content.get("bufferViews") or ()]
    gltf.accessors = [
        Accessor(**_given(row, _ACCESSOR)) if row.get("sparse") is None else Accessor.from_dict(row)
        for row in content.get("accessors") or ()
    ]
    gltf.animations = [_animation(row) for row in content.get("animations") or ()]
    return gltf


def _animation(row: dict[str, Any]) -> Any:
    from pygltflib import Animation, AnimationChannel, AnimationChannelTarget, AnimationSampler

    channels = [
        AnimationChannel(
            sampler=_whole(one["sampler"]), target=AnimationChannelTarget(**_given(one["target"], _TARGET))
        )
        for one in row.get("channels") or ()
    ]
    samplers = [AnimationSampler(**_given(one, _SAMPLER)) for one in row.get("samplers") or ()]
    return Animation(name=row.get("name"), channels=channels, samplers=samplers)


def _given(row: dict[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    """What a JSON object states under these keys; others are not glTF's."""
    return {key: _whole(row[key]) for key in keys if row.get(key) is not None}


def _whole(value: Any) -> Any:
    """An index or a count, which JSON may write as 3.0: the only plain numbers in the objects made here."""
    return int(value) if isinstance(value, float) else value
