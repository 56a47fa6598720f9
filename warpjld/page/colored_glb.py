"""A surface with colours of its vertices as glTF, matt and smooth: what browsers draw it from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.normals import vertex_normals
from warpjld.page.visible_side import visible_side

__all__ = ["colored_glb"]


def colored_glb(vertices: NDArray[np.float32], faces: NDArray[np.int32], colors: NDArray[np.uint8]) -> bytes:
    """The bytes of a GLB of vertices (V, 3), triangles (T, 3) and sRGB colours (V, 3)."""
    import pygltflib as g

    places = np.ascontiguousarray(vertices, np.float32)
    arrays = [
        (places, g.ARRAY_BUFFER, g.FLOAT, g.VEC3),
        (vertex_normals(places, faces), g.ARRAY_BUFFER, g.FLOAT, g.VEC3),
        (_linear(colors), g.ARRAY_BUFFER, g.FLOAT, g.VEC3),
        (np.ascontiguousarray(faces, np.uint32).ravel(), g.ELEMENT_ARRAY_BUFFER, g.UNSIGNED_INT, g.SCALAR),
    ]
    model = g.GLTF2(scene=0, scenes=[g.Scene(nodes=[0])], nodes=[g.Node(mesh=0)])
    double = visible_side(places, faces) == "double"
    matt = g.PbrMetallicRoughness(metallicFactor=0.0, roughnessFactor=0.9)
    model.materials.append(g.Material(pbrMetallicRoughness=matt, doubleSided=double))
    attributes = g.Attributes(POSITION=0, NORMAL=1, COLOR_0=2)
    model.meshes.append(g.Mesh(primitives=[g.Primitive(attributes=attributes, indices=3, material=0)]))
    data = b""
    for k, (array, target, kind, shape) in enumerate(arrays):
        model.bufferViews.append(g.BufferView(buffer=0, byteOffset=len(data), byteLength=array.nbytes, target=target))
        model.accessors.append(g.Accessor(bufferView=k, componentType=kind, count=len(array), type=shape))
        data += array.tobytes()
    model.accessors[0].min, model.accessors[0].max = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    model.buffers.append(g.Buffer(byteLength=len(data)))
    model.set_binary_blob(data)
    return b"".join(model.save_to_bytes())


def _linear(colors: NDArray[np.uint8]) -> NDArray[np.float32]:
    """sRGB → linear, as glTF has the colours of vertices."""
    share = colors.astype(np.float64) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.ascontiguousarray(linear, np.float32)
