"""Writer of glTF binary caches: the rest mesh, a morph target per frame, and an animation of their weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib as gltf
from numpy.typing import NDArray

from warpjld import __version__
from warpjld.errors import InputError
from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.surface import Surface
from warpjld.io.caches.cache import Cache, CacheTiming

__all__ = ["MAX_BYTES", "MAX_FRAMES", "GlbCache"]

#: Largest number of frames: the weight animation holds frames² numbers, and viewers hold all targets in memory.
MAX_FRAMES = 300
#: Largest size of a file.
MAX_BYTES = 512 << 20

_BYTES_A_VERTEX = 24  # position and normal, float32


class GlbCache(Cache):
    """glTF binary: at time ``frame / rate`` target ``frame`` has weight 1 and all others 0; linear in between.

    Time starts at 0, whatever the first frame's number, as glTF requires; targets are named by frame number.
    """

    note = "rest mesh with a morph target a frame; time starts at 0"

    def __init__(self, path: Path, surface: Surface, clip: CacheTiming) -> None:
        super().__init__(path, surface, clip)
        self._origin, self._faces, self._uv = surface.split_at_seams()
        copies = len(self._origin) - len(surface.weld)
        if copies:
            self.note += f"; after the source's {len(surface.weld)} vertices {copies} copies, one more for each seam"
        size = len(self._origin) * _BYTES_A_VERTEX * (clip.frames + 1) + 4 * clip.frames**2
        if clip.frames > MAX_FRAMES or size > MAX_BYTES:
            raise InputError(
                f"{clip.frames} frames of {len(surface.weld)} vertices are {size / 2**20:.0f} MB of morph targets; "
                f".glb is for short clips, up to {MAX_FRAMES} frames and {MAX_BYTES >> 20} MB: "
                "write .usdc, .mdd or .npz",
                path=path,
            )

    def _begin(self) -> None:
        self._part(self.path).touch()
        self._blob = _Blob()
        rest = self.rest[self._origin]
        self._rest_normals = self._normals(self.rest)
        faces = self._faces.astype("<u4").reshape(-1)
        attributes = gltf.Attributes(
            POSITION=self._blob.add(rest, gltf.VEC3, target=gltf.ARRAY_BUFFER, bounds=True),
            NORMAL=self._blob.add(self._rest_normals, gltf.VEC3, target=gltf.ARRAY_BUFFER),
        )
        if self._uv is not None:
            # v runs downwards from the top of the image in glTF
            flipped = np.asarray(self._uv, np.float32) * [1, -1] + [0, 1]
            attributes.TEXCOORD_0 = self._blob.add(flipped.astype("<f4"), gltf.VEC2, target=gltf.ARRAY_BUFFER)
        indices = self._blob.add(faces, gltf.SCALAR, target=gltf.ELEMENT_ARRAY_BUFFER)
        self._primitive = gltf.Primitive(attributes=attributes, indices=indices, material=0, targets=[])

    def _append(self, vertices: NDArray[np.float32]) -> None:
        moved = (vertices - self.rest)[self._origin]
        self._primitive.targets.append(
            {
                "POSITION": self._blob.add(moved, gltf.VEC3, target=gltf.ARRAY_BUFFER, bounds=True),
                "NORMAL": self._blob.add(
                    self._normals(vertices) - self._rest_normals, gltf.VEC3, target=gltf.ARRAY_BUFFER
                ),
            }
        )

    def _finish(self) -> None:
        frames, start, name = self.clip.frames, self.clip.start, self.clip.name
        times = (np.arange(frames) / self.clip.rate).astype("<f4")
        sampler = gltf.AnimationSampler(
            input=self._blob.add(times, gltf.SCALAR, bounds=True),
            output=self._blob.add(np.eye(frames, dtype="<f4").ravel(), gltf.SCALAR),
            interpolation=gltf.ANIM_LINEAR,
        )
        channel = gltf.AnimationChannel(sampler=0, target=gltf.AnimationChannelTarget(node=0, path="weights"))
        mesh = gltf.Mesh(
            name=name,
            primitives=[self._primitive],
            weights=[0.0] * frames,
            extras={"targetNames": [f"frame {start + frame}" for frame in range(frames)]},
        )
        document = gltf.GLTF2(
            asset=gltf.Asset(version="2.0", generator=f"warpjld {__version__}"),
            scene=0,
            scenes=[gltf.Scene(nodes=[0])],
            nodes=[gltf.Node(name=name, mesh=0)],
            meshes=[mesh],
            animations=[gltf.Animation(name=name, samplers=[sampler], channels=[channel])],
            materials=[_material()],
            accessors=self._blob.accessors,
            bufferViews=self._blob.views,
            buffers=[gltf.Buffer(byteLength=self._blob.length)],
        )
        document.set_binary_blob(b"".join(self._blob.chunks))
        if not document.save_binary(str(self._part(self.path))):
            raise OSError("pygltflib could not write")
        self._close()

    def _close(self) -> None:
        self._blob = _Blob()

    def _normals(self, source: NDArray[np.float32]) -> NDArray[np.float32]:
        """Normals at positions in source order, per vertex of the file: smooth across texture seams."""
        welded = np.empty((len(self.surface.vertices), 3), np.float32)
        welded[self.surface.weld] = source
        smooth = self.surface.to_source(vertex_normals(welded, self.surface.faces))
        return smooth[self._origin].astype("<f4")


def _material() -> gltf.Material:
    # the default material of glTF is metallic
    return gltf.Material(
        name="skin",
        pbrMetallicRoughness=gltf.PbrMetallicRoughness(
            baseColorFactor=[0.78, 0.50, 0.38, 1.0], metallicFactor=0.0, roughnessFactor=0.6
        ),
    )


class _Blob:
    """The binary chunk and its accessors. All arrays have 4-byte components, which keeps them aligned."""

    def __init__(self) -> None:
        self.chunks: list[bytes] = []
        self.length = 0
        self.views: list[gltf.BufferView] = []
        self.accessors: list[gltf.Accessor] = []

    def add(self, array: NDArray[np.generic], kind: str, *, target: int | None = None, bounds: bool = False) -> int:
        """Append an array; returns its accessor's index."""
        content = array.tobytes()
        self.views.append(gltf.BufferView(buffer=0, byteOffset=self.length, byteLength=len(content), target=target))
        rows = array.reshape(len(array), -1)
        self.accessors.append(
            gltf.Accessor(
                bufferView=len(self.views) - 1,
                componentType=gltf.UNSIGNED_INT if array.dtype.kind == "u" else gltf.FLOAT,
                count=len(array),
                type=kind,
                min=rows.min(axis=0).tolist() if bounds else None,
                max=rows.max(axis=0).tolist() if bounds else None,
            )
        )
        self.chunks.append(content)
        self.length += len(content)
        return len(self.accessors) - 1
