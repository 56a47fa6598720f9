"""Vertex normals of a deformed surface, made where they are first asked for: most are not."""

import warp as wp

from warpjld_kernels.lanes import VECTORISED

wp.set_module_options({**VECTORISED, "max_unroll": 1})


@wp.struct
class Normals:
    """Normals of a surface's vertices.

    ``first`` and ``around`` hold the two other corners of each face at a vertex, ``area`` the length of its normal at
    rest [m²]. Where ``known`` is not 0: ``normal``, a third of the faces' area as a vector along their normals [m²],
    its ``unit`` vector, and ``plain``, 1 where these faces are nearly coplanar, 0 where they are folded, so that inside
    is not defined there.
    """

    first: wp.array(dtype=wp.int32)
    around: wp.array(dtype=wp.vec2i)
    area: wp.array(dtype=float)
    known: wp.array(dtype=wp.int32)
    normal: wp.array(dtype=wp.vec3)
    unit: wp.array(dtype=wp.vec3)
    plain: wp.array(dtype=float)


KNOW = """
    auto know = [&](int v) {
        if (normals.known.data[v]) return;
        const float* at = (const float*)points.data;
        const float* p = at + 3 * size_t(v);
        float x = 0.0f, y = 0.0f, z = 0.0f;
        for (int i = normals.first.data[v]; i < normals.first.data[v + 1]; ++i) {
            const float* b = at + 3 * size_t(normals.around.data[i][0]);
            const float* c = at + 3 * size_t(normals.around.data[i][1]);
            const float bx = b[0] - p[0], by = b[1] - p[1], bz = b[2] - p[2];
            const float cx = c[0] - p[0], cy = c[1] - p[1], cz = c[2] - p[2];
            x += by * cz - bz * cy;
            y += bz * cx - bx * cz;
            z += bx * cy - by * cx;
        }
        x /= 6.0f; y /= 6.0f; z /= 6.0f;
        const float length = sqrtf(x * x + y * y + z * z), inverse = length > 0.0f ? 1.0f / length : 0.0f;
        const float rest = normals.area.data[v] > 1e-30f ? normals.area.data[v] : 1e-30f;
        const float plain = 4.0f * length / rest - 0.6f;
        normals.normal.data[v] = wp::vec3(x, y, z);
        normals.unit.data[v] = wp::vec3(x * inverse, y * inverse, z * inverse);
        normals.plain.data[v] = plain < 0.0f ? 0.0f : (plain > 1.0f ? 1.0f : plain);
        normals.known.data[v] = 1;
    };
"""
"""C++ of ``know``, which sees to it that the normal at a vertex is known."""


@wp.func_native(
    KNOW
    + """
    know(v);
"""
)
def know_normal(normals: Normals, points: wp.array(dtype=wp.vec3), v: int):
    """See to it that the normal at vertex ``v`` is known, from these positions where it is not."""
