"""glTF extensions: those that may be required, and those that change the meaning of arrays."""

from __future__ import annotations

import re
from typing import Any

from warpjld.errors import InputError

__all__ = ["check_extensions", "packed_view"]

_HARMLESS = re.compile(
    r"KHR_materials_\w+|KHR_texture_\w+|EXT_texture_\w+|MSFT_texture_dds|MSFT_packing_\w+|MSFT_lod"  # appearance
    r"|KHR_lights_\w+|EXT_lights_\w+|KHR_xmp\w*|KHR_audio\w*|FB_ngon_encoding|CESIUM_\w+"
    r"|KHR_mesh_quantization|KHR_animation_pointer"  # plain integer accessors; channels of other targets than joints
    r"|VRM|VRMC_\w+"  # avatars: bone names, appearance and spring bones
)
"""Extensions that need not be supported to read joints, skins, surfaces and joint animations correctly."""

_COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression")
_UNPACK = "export it without compression"


def check_extensions(gltf: Any) -> None:
    """Reject a file that cannot be read correctly without an extension.

    Raises:
        InputError: It requires, or is compressed with, an unsupported extension.
    """
    for name in gltf.extensionsRequired or ():
        if name in _COMPRESSED:
            raise InputError(f"is compressed with {name}: {_UNPACK}")
        if not _HARMLESS.fullmatch(str(name)):
            raise InputError(f"requires the extension {name}, which is not read: export it without")
    for i, mesh in enumerate(gltf.meshes or ()):
        for primitive in mesh.primitives:
            if "KHR_draco_mesh_compression" not in (primitive.extensions or {}):
                continue
            used = [n for n in vars(primitive.attributes).values() if isinstance(n, int)]
            if any(gltf.accessors[n].bufferView is None for n in used if 0 <= n < len(gltf.accessors)):
                raise InputError(f"mesh {i} is compressed with KHR_draco_mesh_compression: {_UNPACK}")


def packed_view(gltf: Any, accessor: int) -> str | None:
    """Name of the extension that compresses an accessor's data, if there is no uncompressed fallback; else None."""
    if not 0 <= accessor < len(gltf.accessors) or gltf.accessors[accessor].bufferView is None:
        return None
    number = gltf.accessors[accessor].bufferView
    if not 0 <= number < len(gltf.bufferViews):
        return None
    view = gltf.bufferViews[number]
    for name in _COMPRESSED:
        if name in (view.extensions or {}) and 0 <= view.buffer < len(gltf.buffers):
            buffer = gltf.buffers[view.buffer]
            placeholder = (buffer.extensions or {}).get(name, {}).get("fallback")
            if placeholder and buffer.uri is None:
                return name
    return None
