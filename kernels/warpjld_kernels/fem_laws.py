"""C++ code for material laws: stress and tangent at a point, used in ``fem_element``.

A law gives an isochoric Kirchhoff stress τ and its spatial tangent c; the volumetric part is one pressure per element,
except for ``LINEAR_FULL`` and ``NEO_HOOKE_FULL``. Values are ``Doubles``, one lane per element (see ``lanes``).
"""

LINEAR = 0
"""Linear elasticity with B-bar, in the rest configuration."""
LINEAR_FULL = 1
"""Linear elasticity with full integration: locks near ν = ½; for comparison."""
NEO_HOOKE = 2
MOONEY_RIVLIN = 3
FUNG = 4
"""Neo-Hookean with a shear modulus that grows as exp(β (Ī₁ − 3))."""
NEO_HOOKE_FULL = 5
"""Neo-Hookean with U(J) at every point: locks like ``LINEAR_FULL``."""

VOIGT = f"""
    constexpr int LINEAR_FULL = {LINEAR_FULL}, NEO_HOOKE = {NEO_HOOKE}, MOONEY_RIVLIN = {MOONEY_RIVLIN}, FUNG = {FUNG};
    constexpr int NEO_HOOKE_FULL = {NEO_HOOKE_FULL};
    const int voigt[6][2] = {{{{0, 0}}, {{1, 1}}, {{2, 2}}, {{0, 1}}, {{1, 2}}, {{2, 0}}}};
    const int at[3][3] = {{{{0, 3, 5}}, {{3, 1, 4}}, {{5, 4, 2}}}};
"""
"""Defines the laws' indices, ``voigt[I]`` (row and column of a tensor's I-th component) and its inverse ``at``."""

STRESS = """
            Doubles tau[6], D[6][6], total[6];
            if (!large) {
                const Doubles mu = 2.0 * (c10 + c01);
                for (int I = 0; I < 6; ++I) {
                    tau[I] = 0;
                    total[I] = s0[I];
                    for (int J = 0; J < 6; ++J) {
                        D[I][J] = I < 3 && J < 3 ? mu * (-2.0 / 3.0) : Doubles(0);
                        if (I == J) D[I][J] += I < 3 ? 2.0 * mu : mu;
                    }
                }
                if (kind == LINEAR_FULL)
                    for (int I = 0; I < 3; ++I)
                        for (int J = 0; J < 3; ++J) D[I][J] += kappa;
            } else {
                const Doubles jacobian = dv[q] / dV[q];
                Doubles scale;
                for (int l = 0; l < N; ++l) {
                    const double j = PICK(jacobian, l) > 1e-12 ? PICK(jacobian, l) : 1e-12;
                    PICK(scale, l) = pow(j, -2.0 / 3.0);
                }
                Doubles b[6], b2[6];
                for (int I = 0; I < 6; ++I) {
                    const int i = voigt[I][0], j = voigt[I][1];
                    b[I] = scale * (F[q][i][0] * F[q][j][0] + F[q][i][1] * F[q][j][1] + F[q][i][2] * F[q][j][2]);
                }
                for (int I = 0; I < 6; ++I) {
                    const int i = voigt[I][0], j = voigt[I][1];
                    b2[I] = b[at[i][0]] * b[at[0][j]] + b[at[i][1]] * b[at[1][j]] + b[at[i][2]] * b[at[2][j]];
                }
                const Doubles first = b[0] + b[1] + b[2];
                Doubles trace = 0, slope = c10;
                if (kind == FUNG)
                    for (int l = 0; l < N; ++l) PICK(slope, l) *= exp(PICK(beta, l) * (PICK(first, l) - 3.0));
                for (int I = 0; I < 6; ++I) tau[I] = 2.0 * slope * b[I] + 2.0 * c01 * (first * b[I] - b2[I]);
                trace = tau[0] + tau[1] + tau[2];
                for (int I = 0; I < 3; ++I) tau[I] -= trace / 3.0;
                for (int I = 0; I < 6; ++I)
                    for (int J = 0; J < 6; ++J) {
                        const double shape = (I < 3 && J < 3 ? -1.0 / 3.0 : 0.0) + (I == J ? (I < 3 ? 1.0 : 0.5) : 0.0);
                        Doubles d = trace * shape;
                        if (I < 3) d -= tau[J];
                        if (J < 3) d -= tau[I];
                        D[I][J] = (2.0 / 3.0) * d;
                    }
                if (kind == FUNG)
                    for (int I = 0; I < 6; ++I)
                        for (int J = 0; J < 6; ++J) D[I][J] += beta / slope * tau[I] * tau[J];
                if (kind == MOONEY_RIVLIN) {
                    // P : 4 c01 (b ⊗ b − b ⊡ b) : P, the second invariant's own tangent
                    Doubles m[6];
                    for (int I = 0; I < 6; ++I) m[I] = 4.0 * c01 * (first * b[I] - b2[I]);
                    const Doubles mm = m[0] + m[1] + m[2];
                    for (int I = 0; I < 6; ++I)
                        for (int J = 0; J < 6; ++J) {
                            const int i = voigt[I][0], j = voigt[I][1], k = voigt[J][0], n = voigt[J][1];
                            const Doubles crossed = b[at[i][k]] * b[at[j][n]] + b[at[i][n]] * b[at[j][k]];
                            D[I][J] += 4.0 * c01 * (b[I] * b[J] - 0.5 * crossed);
                            if (I < 3) D[I][J] -= m[J] / 3.0;
                            if (J < 3) D[I][J] -= m[I] / 3.0;
                            if (I < 3 && J < 3) D[I][J] += mm / 9.0;
                        }
                }
                if (kind == NEO_HOOKE_FULL)
                    for (int I = 0; I < 6; ++I) {
                        const Doubles p = kappa * jacobian * (jacobian - 1.0);
                        if (I < 3) tau[I] += p;
                        D[I][I] -= (I < 3 ? 2.0 : 1.0) * p;
                        for (int J = 0; J < 3 && I < 3; ++J) D[I][J] += p + kappa * jacobian * jacobian;
                    }
                Doubles FS[3][3];
                for (int i = 0; i < 3; ++i)
                    for (int j = 0; j < 3; ++j)
                        FS[i][j] = F[q][i][0] * s0[at[0][j]] + F[q][i][1] * s0[at[1][j]] + F[q][i][2] * s0[at[2][j]];
                for (int I = 0; I < 6; ++I) {
                    const int i = voigt[I][0], j = voigt[I][1];
                    total[I] = tau[I] + FS[i][0] * F[q][j][0] + FS[i][1] * F[q][j][1] + FS[i][2] * F[q][j][2];
                }
            }
"""
"""Reads the constants ``c10``, ``c01``, ``kappa``, ``beta`` and initial stress ``s0``, ``kind``, ``large``, and at
point q ``F``, ``dv``, ``dV``. Defines ``tau`` (τ), ``D`` (c) and ``total`` (τ plus the pushed-forward initial stress).
"""
