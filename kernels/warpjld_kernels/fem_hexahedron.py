"""C++ code for the geometry of 8-node elements at 2×2×2 points, used in ``fem_element``.

Values are ``Doubles``, one lane per element (see ``lanes``).
"""

CORNERS = """
    const double side[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                               {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
    double dn[8][8][3];
    for (int q = 0; q < 8; ++q)
        for (int a = 0; a < 8; ++a) {
            double h[3];
            for (int i = 0; i < 3; ++i) h[i] = 1.0 + side[a][i] * side[q][i] * 0.57735026918962576451;
            dn[q][a][0] = 0.125 * side[a][0] * h[1] * h[2];
            dn[q][a][1] = 0.125 * side[a][1] * h[0] * h[2];
            dn[q][a][2] = 0.125 * side[a][2] * h[0] * h[1];
        }
"""
"""Defines ``dn[q][a][i]``: derivative of node a's shape function with respect to local coordinate i at point q."""

GRADIENTS = """
        Doubles g[8][8][3], F[8][3][3], dV[8], dv[8], G[8][3];
        Doubles volume = 0, current = 0, lowest = 1e300;
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) G[a][i] = 0;
        for (int q = 0; q < 8; ++q) {
            Doubles A[3][3], inverse0[3][3], inverse[3][3];
            Doubles det = 0;
            for (int pass = 0; pass < (large ? 2 : 1); ++pass) {
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j) {
                        Doubles s = 0;
                        for (int a = 0; a < 8; ++a) s += (pass ? now[a][i] : rest[a][i]) * dn[q][a][j];
                        A[i][j] = s;
                    }
                for (int i = 0; i < 3; ++i) {
                    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
                    for (int j = 0; j < 3; ++j) {
                        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                        inverse[j][i] = A[i1][j1] * A[i2][j2] - A[i1][j2] * A[i2][j1];
                    }
                }
                det = A[0][0] * inverse[0][0] + A[0][1] * inverse[1][0] + A[0][2] * inverse[2][0];
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j) {
                        inverse[i][j] /= det;
                        if (!pass) inverse0[i][j] = inverse[i][j];
                    }
                lowest = LOWEST(lowest, det);
                if (!pass) dV[q] = det;
            }
            dv[q] = det;
            volume += dV[q];
            current += det;
            if (large)
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j)
                        F[q][i][j] = A[i][0] * inverse0[0][j] + A[i][1] * inverse0[1][j] + A[i][2] * inverse0[2][j];
            for (int a = 0; a < 8; ++a)
                for (int i = 0; i < 3; ++i) {
                    const double* d = dn[q][a];
                    g[q][a][i] = d[0] * inverse[0][i] + d[1] * inverse[1][i] + d[2] * inverse[2][i];
                    G[a][i] += g[q][a][i] * det;
                }
        }
"""
"""Reads ``rest``, ``now`` (node positions) and ``large``. Defines

- ``g[q][a]``: ∂N_a/∂x at point q, in the deformed configuration for large strain; ``F[q]``: deformation gradients there
- ``dV[q]``, ``dv[q]``: volumes of the points at rest and deformed; ``volume``, ``current``: their sums
- ``G[a]``: Σ_q g_a dv; ``lowest``: smallest Jacobian determinant
"""
