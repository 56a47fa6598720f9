"""A writer of small FBX 7.4 text files: the formula of the FBX SDK's transforms backwards, curves of single floats.

local = T · Rpre · R(order) · Rpost⁻¹ · S,   angles in degrees, Rpre and Rpost in the order X, Y, Z
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

SECOND = 46_186_158_000
"""FBX counts time in these ticks."""

ORDERS = ("xyz", "xzy", "yzx", "yxz", "zxy", "zyx")
"""Euler orders by FBX's number; the first letter turns first, about axes that stay."""

AXES = {  # up, front, right: axis and sign; columns of what turns the world's axes (Y up) into the file's
    "y": ((1, 1), (2, 1), (0, 1)),
    "z": ((2, 1), (1, -1), (0, 1)),
    "x": ((0, 1), (2, 1), (1, -1)),
    "-z": ((2, -1), (1, 1), (0, 1)),
    "y, facing x": ((1, 1), (0, 1), (2, -1)),
    "left-handed": ((1, 1), (2, -1), (0, 1)),
}
_MODES = {23.976: 13, 24.0: 11, 25.0: 10, 30.0: 6, 60.0: 3, 120.0: 1}


@dataclass
class Mesh:
    """One mesh: what is left empty takes the plainest form.

    Attributes:
        name: Its node's name.
        vertices: At bind, in the world [m], shape (W, 3).
        polygons: Vertices of each.
        joints: Influencing joints, shape (W, K); None for a mesh without skin.
        weights: Their weights, shape (W, K).
        uv: Texture coordinates of every corner of every polygon, shape (sum of corners, 2).
        node: The mesh node's transform at bind, in the world [m].
        parent: Joint that the node hangs on, -1 for none.
        geometric: Translation of the geometry in its node [m].
        shapes: Blend shapes: weight in per cent, and offsets [m] in the world, shape (W, 3).
        texture: File of the texture of its material; empty: without material.
    """

    name: str
    vertices: np.ndarray
    polygons: Sequence[Sequence[int]]
    joints: np.ndarray | None = None
    weights: np.ndarray | None = None
    uv: np.ndarray | None = None
    node: np.ndarray = field(default_factory=lambda: np.eye(4))
    parent: int = -1
    geometric: Sequence[float] = (0.0, 0.0, 0.0)
    shapes: Sequence[tuple[float, np.ndarray]] = ()
    texture: str = ""


@dataclass
class Fbx:
    """Content of a file, in metres and Y up; the writer brings it to the file's units and axes.

    Attributes:
        names: Joints' names, parents first.
        parents: Their parents, -1 for roots.
        frames: World transforms at bind, shape (J, 4, 4).
        meshes: Meshes.
        shown: World transforms that the nodes show, where it is another pose.
        stacks: Animations: world transforms, shape (F, J, 4, 4), by name.
        rate: Frames a second.
        stated: What the file says it is, where that is another.
        start: Frame at which they start.
        unit: ``UnitScaleFactor``: centimetres.
        up: One of ``AXES``.
        orders: Euler order of every joint.
        pre: Pre-rotation of every joint [degrees], shape (J, 3).
        post: Post-rotation likewise.
        unbound: Joints without a cluster.
        kinds: Kind of node of every joint: ``LimbNode``, ``Null`` or ``""`` for a node without attribute.
        pose: Whether a bind pose is written besides the clusters' matrices.
        spans: Other start and stop [s] than the animations', by name.
        version: The format's version.
        inherit: How joints inherit scale: FBX's ``InheritType``, 1 for as matrices do.
        blend: What a skin says that it blends.
        shaped: Animations in which blend shapes go from 0 to 100 per cent.
    """

    names: Sequence[str]
    parents: Sequence[int]
    frames: np.ndarray
    meshes: Sequence[Mesh] = ()
    shown: np.ndarray | None = None
    stacks: dict[str, np.ndarray] = field(default_factory=dict)
    rate: float = 30.0
    stated: float | None = None
    start: int = 0
    unit: float = 1.0
    up: str = "y"
    orders: Sequence[int] | None = None
    pre: np.ndarray | None = None
    post: np.ndarray | None = None
    unbound: frozenset[int] = frozenset()
    kinds: Sequence[str] | None = None
    pose: bool = True
    spans: dict[str, tuple[float, float]] = field(default_factory=dict)
    version: int = 7400
    inherit: int = 1
    blend: str = "Linear"
    shaped: frozenset[str] = frozenset()

    def write(self, path: Path) -> Path:
        """Write it."""
        path.write_text(_Writer(self).text(), encoding="utf-8")
        return path


class _Writer:
    def __init__(self, fbx: Fbx) -> None:
        self.fbx = fbx
        self.objects: list[str] = []
        self.links: list[str] = []
        self.last = 1000
        self.channels: list[int] = []
        up, front, right = ([sign * float(a == axis) for a in range(3)] for axis, sign in AXES[fbx.up])
        self.turn = np.column_stack([right, up, front])  # world (Y up) → file
        self.scale = 100.0 / fbx.unit

    def file(self, world: np.ndarray) -> np.ndarray:
        """A transform of the world in the file's units and axes; joints keep their size, and stay right-handed."""
        turn, mirror, out = np.eye(4), np.eye(4), np.array(world, dtype=float)
        turn[:3, :3] = self.turn
        mirror[2, 2] = np.linalg.det(self.turn)
        out[..., :3, 3] *= self.scale
        return turn @ out @ mirror

    def points(self, points: np.ndarray) -> np.ndarray:
        return self.scale * np.asarray(points) @ self.turn.T

    def add(self, kind: str, name: str, sub: str, body: str) -> int:
        self.last += 1
        self.objects.append(f'{kind}: {self.last}, "{name}", "{sub}" {{\n{body}\n}}')
        return self.last

    def link(self, child: int, parent: int, prop: str = "") -> None:
        self.links.append(f'C: "OP",{child},{parent},"{prop}"' if prop else f'C: "OO",{child},{parent}')

    def text(self) -> str:
        fbx = self.fbx
        models = self.joints()
        for mesh in fbx.meshes:
            self.mesh(mesh, models)
        if fbx.pose:
            binds = self.file(fbx.frames)
            nodes = "\n".join(
                f"PoseNode: {{\nNode: {model}\nMatrix: {_array(_columns(binds[j]))}\n}}"
                for j, model in enumerate(models)
            )
            self.add("Pose", "Pose::Bind", "BindPose", f'Type: "BindPose"\nNbPoseNodes: {len(models)}\n{nodes}')
        for name, worlds in fbx.stacks.items():
            self.stack(name, worlds, models)
        objects, links = "\n".join(self.objects), "\n".join(self.links)
        return (
            f"; FBX {'.'.join(str(fbx.version)[:3])} project file\n"
            f"FBXHeaderExtension: {{\nFBXHeaderVersion: 1003\nFBXVersion: {fbx.version}\n}}\n"
            f"{self.settings()}\nObjects: {{\n{objects}\n}}\nConnections: {{\n{links}\n}}\n"
        )

    def settings(self) -> str:
        fbx = self.fbx
        stated = fbx.rate if fbx.stated is None else fbx.stated
        mode = _MODES.get(stated, 14)
        rows = [
            f'P: "{name}Axis{what}", "int", "Integer", "",{value}'
            for name, pair in zip(("Up", "Front", "Coord"), AXES[fbx.up], strict=True)
            for what, value in zip(("", "Sign"), pair, strict=True)
        ]
        rows.append(f'P: "UnitScaleFactor", "double", "Number", "",{fbx.unit!r}')
        rows.append(f'P: "TimeMode", "enum", "", "",{mode}')
        rows.append(f'P: "CustomFrameRate", "double", "Number", "",{stated!r}')
        return "GlobalSettings: {\nVersion: 1000\n" + _properties(rows) + "\n}"

    def joints(self) -> list[int]:
        fbx = self.fbx
        shown = self.file(fbx.frames if fbx.shown is None else fbx.shown)
        models = []
        for j, name in enumerate(fbx.names):
            place, turn, size = self.local(j, shown[None])
            pre, post = self.pre_post(j)
            rows = [
                _vector("Lcl Translation", place[0]),
                _vector("Lcl Rotation", turn[0]),
                _vector("Lcl Scaling", size[0]),
                f'P: "InheritType", "enum", "", "",{fbx.inherit}',
                f'P: "RotationOrder", "enum", "", "",{self.order(j)}',
            ]
            if pre.any() or post.any():
                rows += ['P: "RotationActive", "bool", "", "",1', _vector("PreRotation", pre)]
                rows += [_vector("PostRotation", post)]
            kind = "LimbNode" if fbx.kinds is None else fbx.kinds[j]
            model = self.add("Model", f"Model::{name}", kind or "Null", f"Version: 232\n{_properties(rows)}")
            if kind:
                flags = "Skeleton" if kind == "LimbNode" else "Null"
                self.link(self.add("NodeAttribute", f"NodeAttribute::{name}", kind, f'TypeFlags: "{flags}"'), model)
            self.link(model, models[fbx.parents[j]] if fbx.parents[j] >= 0 else 0)
            models.append(model)
        return models

    def order(self, joint: int) -> int:
        return 0 if self.fbx.orders is None else self.fbx.orders[joint]

    def pre_post(self, joint: int) -> tuple[np.ndarray, np.ndarray]:
        blank = np.zeros(3)
        return (
            blank if self.fbx.pre is None else self.fbx.pre[joint],
            blank if self.fbx.post is None else self.fbx.post[joint],
        )

    def local(self, joint: int, worlds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lcl Translation, Rotation [degrees], Scaling by frame, each of shape (F, 3)."""
        parent = self.fbx.parents[joint]
        locals_ = worlds[:, joint] if parent < 0 else np.linalg.inv(worlds[:, parent]) @ worlds[:, joint]
        size = np.linalg.norm(locals_[:, :3, :3], axis=1)
        pre, post = (Rotation.from_euler("xyz", angles, degrees=True) for angles in self.pre_post(joint))
        turn = pre.inv() * Rotation.from_matrix(locals_[:, :3, :3] / size[:, None, :]) * post
        angles = turn.as_euler(ORDERS[self.order(joint)])
        # as_euler gives the angles in the order of its letters; curves are by axis
        by_axis = np.empty_like(angles)
        by_axis[:, ["xyz".index(letter) for letter in ORDERS[self.order(joint)]]] = np.unwrap(angles, axis=0)
        return locals_[:, :3, 3], np.degrees(by_axis), size

    def mesh(self, mesh: Mesh, models: list[int]) -> None:
        node = self.file(mesh.node)
        geometric = self.points(np.array(mesh.geometric, dtype=float))
        inside = np.linalg.inv(node)
        local = self.points(mesh.vertices) @ inside[:3, :3].T + inside[:3, 3] - geometric
        inside_out = np.linalg.det(self.turn) < 0.0  # seen from outside, corners go round anticlockwise by the numbers
        polygons = [polygon[::-1] if inside_out else polygon for polygon in mesh.polygons]
        corners = [v if i + 1 < len(polygon) else ~v for polygon in polygons for i, v in enumerate(polygon)]
        body = f"Vertices: {_array(local.ravel())}\nPolygonVertexIndex: {_array(corners)}\nGeometryVersion: 124"
        if mesh.uv is not None:
            values, index = np.unique(mesh.uv, axis=0, return_inverse=True)
            body += (
                '\nLayerElementUV: 0 {\nVersion: 101\nName: "map1"\nMappingInformationType: "ByPolygonVertex"\n'
                f'ReferenceInformationType: "IndexToDirect"\nUV: {_array(values.ravel())}\n'
                f"UVIndex: {_array(index.ravel())}\n}}\nLayer: 0 {{\nVersion: 100\n"
                'LayerElement: {\nType: "LayerElementUV"\nTypedIndex: 0\n}\n}'
            )
        geometry = self.add("Geometry", f"Geometry::{mesh.name}", "Mesh", body)
        above = np.eye(4)
        if mesh.parent >= 0:
            above = self.file(self.fbx.frames if self.fbx.shown is None else self.fbx.shown)[mesh.parent]
            if self.fbx.shown is not None:  # the mesh hangs as it did at bind
                above = self.file(self.fbx.frames)[mesh.parent]
        hung = np.linalg.inv(above) @ node
        size = np.linalg.norm(hung[:3, :3], axis=0)
        rows = [
            _vector("Lcl Translation", hung[:3, 3]),
            _vector("Lcl Rotation", Rotation.from_matrix(hung[:3, :3] / size).as_euler("xyz", degrees=True)),
            _vector("Lcl Scaling", size),
            'P: "InheritType", "enum", "", "",1',
        ]
        if np.any(geometric):
            rows.append(_vector("GeometricTranslation", geometric))
        model = self.add("Model", f"Model::{mesh.name}", "Mesh", f"Version: 232\n{_properties(rows)}")
        self.link(geometry, model)
        self.link(model, models[mesh.parent] if mesh.parent >= 0 else 0)
        if mesh.texture:
            material = self.add("Material", "Material::skin", "", 'Version: 102\nShadingModel: "lambert"')
            file = f'Type: "TextureVideoClip"\nFileName: "{mesh.texture}"\nRelativeFilename: "{mesh.texture}"'
            self.link(material, model)
            self.link(self.add("Texture", "Texture::picture", "", file), material, "DiffuseColor")
        if mesh.shapes:
            self.shapes(mesh, geometry, inside)
        if mesh.joints is not None and mesh.weights is not None:
            self.skin(mesh, geometry, node, models)

    def shapes(self, mesh: Mesh, geometry: int, inside: np.ndarray) -> None:
        deformer = self.add("Deformer", "Deformer::shapes", "BlendShape", "Version: 100")
        self.link(deformer, geometry)
        for n, (percent, offsets) in enumerate(mesh.shapes):
            moved = np.flatnonzero(np.abs(offsets).max(axis=1))
            local = self.points(offsets[moved]) @ inside[:3, :3].T
            channel = self.add(
                "Deformer",
                f"SubDeformer::shape{n}",
                "BlendShapeChannel",
                f"Version: 100\nDeformPercent: {percent}\nFullWeights: {_array([100.0])}\n"
                + _properties([f'P: "DeformPercent", "Number", "", "A",{percent!r}']),
            )
            body = f"Version: 100\nIndexes: {_array(moved)}\nVertices: {_array(local.ravel())}"
            shape = self.add("Geometry", f"Geometry::shape{n}", "Shape", body)
            self.channels.append(channel)
            self.link(shape, channel)
            self.link(channel, deformer)

    def skin(self, mesh: Mesh, geometry: int, node: np.ndarray, models: list[int]) -> None:
        skin = self.add(
            "Deformer",
            "Deformer::skin",
            "Skin",
            f'Version: 101\nLink_DeformAcuracy: 50\nSkinningType: "{self.fbx.blend}"',
        )
        self.link(skin, geometry)
        binds = self.file(self.fbx.frames)
        assert mesh.joints is not None
        assert mesh.weights is not None
        for j, model in enumerate(models):
            if j in self.fbx.unbound:
                continue
            weights = np.where(mesh.joints == j, mesh.weights, 0.0).sum(axis=1)
            used = np.flatnonzero(weights)
            rows = [f"Indexes: {_array(used)}", f"Weights: {_array(weights[used])}"] if len(used) else []
            rows.append(f"Transform: {_array(_columns(np.linalg.inv(binds[j]) @ node))}")
            rows.append(f"TransformLink: {_array(_columns(binds[j]))}")
            cluster = self.add("Deformer", f"SubDeformer::{j}", "Cluster", "\n".join(["Version: 100", *rows]))
            self.link(cluster, skin)
            self.link(model, cluster)

    def stack(self, name: str, worlds: np.ndarray, models: list[int]) -> None:
        fbx = self.fbx
        times = [round((fbx.start + f) * SECOND / fbx.rate) for f in range(len(worlds))] or [0]
        first, last = times[0], times[-1]
        if name in fbx.spans:
            first, last = (round(t * SECOND) for t in fbx.spans[name])
        rows = [f'P: "{what}", "KTime", "Time", "",{t}' for what, t in (("LocalStart", first), ("LocalStop", last))]
        stack = self.add("AnimationStack", f"AnimStack::{name}", "", _properties(rows))
        layer = self.add("AnimationLayer", "AnimLayer::Base", "", "")
        self.link(layer, stack)
        for channel in self.channels if name in fbx.shaped else ():
            node = self.add("AnimationCurveNode", "AnimCurveNode::DeformPercent", "", "")
            self.link(node, layer)
            self.link(node, channel, "DeformPercent")
            percent = np.linspace(0.0, 100.0, len(times))
            self.link(self.add("AnimationCurve", "AnimCurve::", "", _curve(times, percent)), node, "d|DeformPercent")
        for j, model in enumerate(models if len(worlds) else ()):
            for what, values in zip(
                ("Translation", "Rotation", "Scaling"), self.local(j, self.file(worlds)), strict=True
            ):
                node = self.add("AnimationCurveNode", f"AnimCurveNode::{what[0]}", "", "")
                self.link(node, layer)
                self.link(node, model, f"Lcl {what}")
                for axis, column in zip("XYZ", values.T, strict=True):
                    curve = self.add("AnimationCurve", "AnimCurve::", "", _curve(times, column))
                    self.link(curve, node, f"d|{axis}")


def _curve(times: list[int], values: np.ndarray) -> str:
    return (
        f"Default: {values[0]}\nKeyVer: 4008\nKeyTime: {_array(times)}\n"
        f"KeyValueFloat: {_array(values.astype(np.float32))}\nKeyAttrFlags: {_array([4])}\n"
        f"KeyAttrDataFloat: {_array([0, 0, 0, 0])}\nKeyAttrRefCount: {_array([len(times)])}"
    )


def _vector(name: str, values: Iterable[float]) -> str:
    return f'P: "{name}", "Vector3D", "Vector", "",' + ",".join(repr(float(v)) for v in values)


def _properties(rows: list[str]) -> str:
    return "Properties70: {\n" + "\n".join(rows) + "\n}"


def _array(values: Iterable[float]) -> str:
    numbers = [str(int(v)) if isinstance(v, int | np.integer) else repr(float(v)) for v in values]
    return f"*{len(numbers)} {{\na: {','.join(numbers)}\n}}"


def _columns(matrix: np.ndarray) -> np.ndarray:
    return matrix.T.ravel()
