"""Stiffness and internal forces of 8-node elements, added straight into the rows of the global matrix.

Elements are taken eight at a time: every number below is a vector of eight, one lane an element, so that the arithmetic
is vectorised whatever the mesh. A range of rows is owned by one index of the launch, which visits every element that
touches them, in ascending order, and adds only into its own rows: no atomics, and every sum in the same order however
the rows are divided. Elements at the border of two ranges are computed by both.

Laws are written as an isochoric Kirchhoff stress τ and its spatial tangent c at each of 2×2×2 points, and one pressure
per element (mean dilatation), whose small-strain limit is the B-bar element:

    f_a  = Σ_q τ g_a dV + p G_a,          g_a = ∂N_a/∂x,  G_a = Σ_q g_a dv
    K_ab = Σ_q (g_aᵀ c g_b + (g_a·τ g_b) 1) dV + Σ_q p (g_a ⊗ g_b − g_b ⊗ g_a) dv + U''(θ)/V G_a ⊗ G_b
    U(θ) = κ/2 (θ − 1)²,  p = U'(θ),  θ = v/V

The p of K_ab's second sum is an argument: with p itself K is the exact tangent; with the pressure that the last Newton
step predicted, κ (θ − 1 + Σ G_a·Δu_a / V), it is the tangent of the mixed method, whose steps stay large where κ ≫ μ.
"""

import warp as wp

wp.set_module_options(
    {
        "enable_backward": False,
        "cpu_compiler_flags": "-march=native -ffp-contract=fast -mprefer-vector-width=512",
    }
)

LANES = 8
"""Elements computed together."""

LINEAR = 0
"""Linear elasticity with B-bar. Geometry stays at rest."""
LINEAR_FULL = 1
"""Linear elasticity with the volumetric part at every point: locks near ν = ½; for comparison."""
NEO_HOOKE = 2
MOONEY_RIVLIN = 3
FUNG = 4
"""Neo-Hookean with a shear modulus that grows as exp(β (Ī₁ − 3))."""


@wp.func_native(
    f"""
    typedef double V __attribute__((ext_vector_type({LANES})));
    const int voigt[6][2] = {{{{0, 0}}, {{1, 1}}, {{2, 2}}, {{0, 1}}, {{1, 2}}, {{2, 0}}}};
    const int at[3][3] = {{{{0, 3, 5}}, {{3, 1, 4}}, {{5, 4, 2}}}};
    const double side[8][3] = {{{{-1, -1, -1}}, {{1, -1, -1}}, {{1, 1, -1}}, {{-1, 1, -1}},
                               {{-1, -1, 1}}, {{1, -1, 1}}, {{1, 1, 1}}, {{-1, 1, 1}}}};
    int pair[8][8];
    for (int a = 0, n = 0; a < 8; ++a)
        for (int b = a; b < 8; ++b) pair[a][b] = pair[b][a] = n++;
    double dn[8][8][3];
    for (int q = 0; q < 8; ++q)
        for (int a = 0; a < 8; ++a) {{
            double h[3];
            for (int i = 0; i < 3; ++i) h[i] = 1.0 + side[a][i] * side[q][i] * 0.57735026918962576451;
            dn[q][a][0] = 0.125 * side[a][0] * h[1] * h[2];
            dn[q][a][1] = 0.125 * side[a][1] * h[0] * h[2];
            dn[q][a][2] = 0.125 * side[a][2] * h[0] * h[1];
        }}
    const int row0 = ranges.data[range], row1 = ranges.data[range + 1];

    for (int batch = range_batches.data[range]; batch < range_batches.data[range + 1]; ++batch) {{
        const int* ids = batch_elements.data + {LANES} * batch;
        const int kind = batch_kinds.data[batch], count = batch_counts.data[batch];
        const bool large = kind >= {NEO_HOOKE};

        V rest[8][3], now[8][3], moved[8][3], c10, c01, kappa, beta, s0[6];
        for (int l = 0; l < {LANES}; ++l) {{
            const int e = ids[l];
            const double* law = laws.data + 4 * e;
            c10[l] = law[0];
            c01[l] = law[1];
            kappa[l] = law[2];
            beta[l] = law[3];
            for (int I = 0; I < 6; ++I) s0[I][l] = initial_stress.data[6 * e + I];
            for (int a = 0; a < 8; ++a)
                for (int i = 0; i < 3; ++i) {{
                    const int at_node = 3 * elements.data[8 * e + a] + i;
                    rest[a][i][l] = nodes.data[at_node];
                    moved[a][i][l] = displacement.data[at_node];
                }}
        }}
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) now[a][i] = large ? rest[a][i] + moved[a][i] : rest[a][i];

        V g[8][8][3], F[8][3][3], dV[8], dv[8], G[8][3];
        V volume = 0, current = 0, lowest = 1e300;
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) G[a][i] = 0;
        for (int q = 0; q < 8; ++q) {{
            V A[3][3], inverse0[3][3], inverse[3][3];
            V det = 0;
            for (int pass = 0; pass < (large ? 2 : 1); ++pass) {{
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j) {{
                        V s = 0;
                        for (int a = 0; a < 8; ++a) s += (pass ? now[a][i] : rest[a][i]) * dn[q][a][j];
                        A[i][j] = s;
                    }}
                for (int i = 0; i < 3; ++i) {{
                    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
                    for (int j = 0; j < 3; ++j) {{
                        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
                        inverse[j][i] = A[i1][j1] * A[i2][j2] - A[i1][j2] * A[i2][j1];
                    }}
                }}
                det = A[0][0] * inverse[0][0] + A[0][1] * inverse[1][0] + A[0][2] * inverse[2][0];
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j) {{
                        inverse[i][j] /= det;
                        if (!pass) inverse0[i][j] = inverse[i][j];
                    }}
                lowest = __builtin_elementwise_min(lowest, det);
                if (!pass) dV[q] = det;
            }}
            dv[q] = det;
            volume += dV[q];
            current += det;
            if (large)
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j)
                        F[q][i][j] = A[i][0] * inverse0[0][j] + A[i][1] * inverse0[1][j] + A[i][2] * inverse0[2][j];
            for (int a = 0; a < 8; ++a)
                for (int i = 0; i < 3; ++i) {{
                    const double* d = dn[q][a];
                    g[q][a][i] = d[0] * inverse[0][i] + d[1] * inverse[1][i] + d[2] * inverse[2][i];
                    G[a][i] += g[q][a][i] * det;
                }}
        }}
        for (int l = 0; l < count; ++l) lowest_out.data[ids[l]] = lowest[l];

        const V pressure = large ? kappa * (current / volume - 1.0) : V(0);
        V swelling = 0, held;
        for (int a = 0; a < 8; ++a)
            for (int l = 0; l < {LANES}; ++l) {{
                const double* step = increment.data + 3 * elements.data[8 * ids[l] + a];
                for (int i = 0; i < 3; ++i) swelling[l] += G[a][i][l] * step[i];
            }}
        for (int l = 0; l < {LANES}; ++l) held[l] = pressures.data[ids[l]];
        const V following = pressure + kappa * swelling / volume;
        for (int l = 0; l < count; ++l) pressures_out.data[ids[l]] = following[l];
        const V bulk = kind == {LINEAR_FULL} ? V(0) : kappa / volume;
        V K[36][9], f[8][3];
        for (int n = 0; n < 36; ++n)
            for (int i = 0; i < 9; ++i) K[n][i] = 0;
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) f[a][i] = large ? pressure * G[a][i] : V(0);

        for (int q = 0; q < 8; ++q) {{
            V tau[6], D[6][6], total[6];
            if (!large) {{
                const V mu = 2.0 * (c10 + c01);
                for (int I = 0; I < 6; ++I) {{
                    tau[I] = 0;
                    total[I] = s0[I];
                    for (int J = 0; J < 6; ++J) {{
                        D[I][J] = I < 3 && J < 3 ? mu * (-2.0 / 3.0) : V(0);
                        if (I == J) D[I][J] += I < 3 ? 2.0 * mu : mu;
                    }}
                }}
                if (kind == {LINEAR_FULL})
                    for (int I = 0; I < 3; ++I)
                        for (int J = 0; J < 3; ++J) D[I][J] += kappa;
            }} else {{
                const V jacobian = dv[q] / dV[q];
                V scale;
                for (int l = 0; l < {LANES}; ++l) {{
                    const double j = jacobian[l] > 1e-12 ? jacobian[l] : 1e-12;
                    scale[l] = pow(j, -2.0 / 3.0);
                }}
                V b[6], b2[6];
                for (int I = 0; I < 6; ++I) {{
                    const int i = voigt[I][0], j = voigt[I][1];
                    b[I] = scale * (F[q][i][0] * F[q][j][0] + F[q][i][1] * F[q][j][1] + F[q][i][2] * F[q][j][2]);
                }}
                for (int I = 0; I < 6; ++I) {{
                    const int i = voigt[I][0], j = voigt[I][1];
                    b2[I] = b[at[i][0]] * b[at[0][j]] + b[at[i][1]] * b[at[1][j]] + b[at[i][2]] * b[at[2][j]];
                }}
                const V first = b[0] + b[1] + b[2];
                V trace = 0, slope = c10;
                if (kind == {FUNG})
                    for (int l = 0; l < {LANES}; ++l) slope[l] *= exp(beta[l] * (first[l] - 3.0));
                for (int I = 0; I < 6; ++I) tau[I] = 2.0 * slope * b[I] + 2.0 * c01 * (first * b[I] - b2[I]);
                trace = tau[0] + tau[1] + tau[2];
                for (int I = 0; I < 3; ++I) tau[I] -= trace / 3.0;
                for (int I = 0; I < 6; ++I)
                    for (int J = 0; J < 6; ++J) {{
                        const double shape = (I < 3 && J < 3 ? -1.0 / 3.0 : 0.0) + (I == J ? (I < 3 ? 1.0 : 0.5) : 0.0);
                        D[I][J] = (2.0 / 3.0) * (trace * shape - (I < 3 ? tau[J] : V(0)) - (J < 3 ? tau[I] : V(0)));
                    }}
                if (kind == {FUNG})
                    for (int I = 0; I < 6; ++I)
                        for (int J = 0; J < 6; ++J) D[I][J] += beta / slope * tau[I] * tau[J];
                if (kind == {MOONEY_RIVLIN}) {{
                    // P : 4 c01 (b ⊗ b − b ⊡ b) : P, the second invariant's own tangent
                    V m[6];
                    for (int I = 0; I < 6; ++I) m[I] = 4.0 * c01 * (first * b[I] - b2[I]);
                    const V mm = m[0] + m[1] + m[2];
                    for (int I = 0; I < 6; ++I)
                        for (int J = 0; J < 6; ++J) {{
                            const int i = voigt[I][0], j = voigt[I][1], k = voigt[J][0], n = voigt[J][1];
                            const V crossed = b[at[i][k]] * b[at[j][n]] + b[at[i][n]] * b[at[j][k]];
                            D[I][J] += 4.0 * c01 * (b[I] * b[J] - 0.5 * crossed);
                            if (I < 3) D[I][J] -= m[J] / 3.0;
                            if (J < 3) D[I][J] -= m[I] / 3.0;
                            if (I < 3 && J < 3) D[I][J] += mm / 9.0;
                        }}
                }}
                V FS[3][3];
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j)
                        FS[i][j] = F[q][i][0] * s0[at[0][j]] + F[q][i][1] * s0[at[1][j]] + F[q][i][2] * s0[at[2][j]];
                for (int I = 0; I < 6; ++I) {{
                    const int i = voigt[I][0], j = voigt[I][1];
                    total[I] = tau[I] + FS[i][0] * F[q][j][0] + FS[i][1] * F[q][j][1] + FS[i][2] * F[q][j][2];
                }}
            }}
            V h[8][3];
            for (int a = 0; a < 8; ++a) {{
                const V x = g[q][a][0], y = g[q][a][1], z = g[q][a][2];
                h[a][0] = dV[q] * (total[0] * x + total[3] * y + total[5] * z);
                h[a][1] = dV[q] * (total[3] * x + total[1] * y + total[4] * z);
                h[a][2] = dV[q] * (total[5] * x + total[4] * y + total[2] * z);
                for (int i = 0; i < 3; ++i) f[a][i] += h[a][i];
            }}
            if (!want_stiffness && large) continue;
            const V squeeze = held * dv[q];
            for (int b = 0; b < 8; ++b) {{
                const V x = dV[q] * g[q][b][0], y = dV[q] * g[q][b][1], z = dV[q] * g[q][b][2];
                V C[6][3];
                for (int I = 0; I < 6; ++I) {{
                    C[I][0] = D[I][0] * x + D[I][3] * y + D[I][5] * z;
                    C[I][1] = D[I][3] * x + D[I][1] * y + D[I][4] * z;
                    C[I][2] = D[I][5] * x + D[I][4] * y + D[I][2] * z;
                }}
                for (int a = 0; a <= b; ++a) {{
                    const V gx = g[q][a][0], gy = g[q][a][1], gz = g[q][a][2];
                    V* k = K[pair[a][b]];
                    for (int j = 0; j < 3; ++j) {{
                        k[j] += gx * C[0][j] + gy * C[3][j] + gz * C[5][j];
                        k[3 + j] += gx * C[3][j] + gy * C[1][j] + gz * C[4][j];
                        k[6 + j] += gx * C[5][j] + gy * C[4][j] + gz * C[2][j];
                    }}
                    if (large) {{
                        const V s = h[a][0] * g[q][b][0] + h[a][1] * g[q][b][1] + h[a][2] * g[q][b][2];
                        k[0] += s;
                        k[4] += s;
                        k[8] += s;
                        const V xy = squeeze * (gx * g[q][b][1] - gy * g[q][b][0]);
                        const V yz = squeeze * (gy * g[q][b][2] - gz * g[q][b][1]);
                        const V zx = squeeze * (gz * g[q][b][0] - gx * g[q][b][2]);
                        k[1] += xy;
                        k[3] -= xy;
                        k[5] += yz;
                        k[7] -= yz;
                        k[6] += zx;
                        k[2] -= zx;
                    }}
                }}
            }}
        }}
        if (want_stiffness || !large)
            for (int b = 0; b < 8; ++b)
                for (int a = 0; a <= b; ++a)
                    for (int i = 0; i < 3; ++i)
                        for (int j = 0; j < 3; ++j) K[pair[a][b]][3 * i + j] += bulk * G[a][i] * G[b][j];
        if (!large)
            for (int a = 0; a < 8; ++a)
                for (int b = 0; b < 8; ++b) {{
                    const V* k = K[pair[a][b]];
                    for (int i = 0; i < 3; ++i)
                        for (int j = 0; j < 3; ++j) f[a][i] += (a <= b ? k[3 * i + j] : k[3 * j + i]) * moved[b][j];
                }}

        for (int l = 0; l < count; ++l) {{
            const int e = ids[l];
            for (int a = 0; a < 8; ++a) {{
                const int row = elements.data[8 * e + a];
                if (row < row0 || row >= row1) continue;
                for (int i = 0; i < 3; ++i) forces_out.data[3 * row + i] += f[a][i][l];
                if (!want_stiffness) continue;
                for (int b = 0; b < 8; ++b) {{
                    double* out = values_out.data + 9 * size_t(slots.data[64 * size_t(e) + 8 * a + b]);
                    const V* k = K[pair[a][b]];
                    if (a <= b)
                        for (int i = 0; i < 9; ++i) out[i] += k[i][l];
                    else
                        for (int i = 0; i < 3; ++i)
                            for (int j = 0; j < 3; ++j) out[3 * i + j] += k[3 * j + i][l];
                }}
            }}
        }}
    }}
"""
)
def add_elements(
    range: int,
    ranges: wp.array(dtype=wp.int32),
    range_batches: wp.array(dtype=wp.int32),
    batch_elements: wp.array2d(dtype=wp.int32),
    batch_kinds: wp.array(dtype=wp.int32),
    batch_counts: wp.array(dtype=wp.int32),
    nodes: wp.array(dtype=wp.float64),
    elements: wp.array2d(dtype=wp.int32),
    slots: wp.array2d(dtype=wp.int32),
    laws: wp.array2d(dtype=wp.float64),
    initial_stress: wp.array2d(dtype=wp.float64),
    displacement: wp.array(dtype=wp.float64),
    pressures: wp.array(dtype=wp.float64),
    increment: wp.array(dtype=wp.float64),
    want_stiffness: wp.bool,
    values_out: wp.array(dtype=wp.float64),
    forces_out: wp.array(dtype=wp.float64),
    lowest_out: wp.array(dtype=wp.float64),
    pressures_out: wp.array(dtype=wp.float64),
): ...


@wp.kernel
def assemble(
    # ranges of rows and their batches of elements
    first: int,
    ranges: wp.array(dtype=wp.int32),
    range_batches: wp.array(dtype=wp.int32),
    batch_elements: wp.array2d(dtype=wp.int32),
    batch_kinds: wp.array(dtype=wp.int32),
    batch_counts: wp.array(dtype=wp.int32),
    # model
    nodes: wp.array(dtype=wp.float64),
    elements: wp.array2d(dtype=wp.int32),
    slots: wp.array2d(dtype=wp.int32),
    laws: wp.array2d(dtype=wp.float64),
    initial_stress: wp.array2d(dtype=wp.float64),
    # state
    displacement: wp.array(dtype=wp.float64),
    pressures: wp.array(dtype=wp.float64),
    increment: wp.array(dtype=wp.float64),
    want_stiffness: wp.bool,
    # out: zero before
    values_out: wp.array(dtype=wp.float64),
    forces_out: wp.array(dtype=wp.float64),
    lowest_out: wp.array(dtype=wp.float64),
    pressures_out: wp.array(dtype=wp.float64),
):
    """Tangent blocks, internal forces, and the lowest Jacobian determinant of each element, at a displacement."""
    add_elements(
        first + wp.tid(),
        ranges,
        range_batches,
        batch_elements,
        batch_kinds,
        batch_counts,
        nodes,
        elements,
        slots,
        laws,
        initial_stress,
        displacement,
        pressures,
        increment,
        want_stiffness,
        values_out,
        forces_out,
        lowest_out,
        pressures_out,
    )
