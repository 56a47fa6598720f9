"""Stiffness and internal forces of 8-node elements, assembled directly into the rows of the global matrix.

Elements are processed eight at a time: every value below is a vector of eight, one lane per element, so that the
arithmetic is vectorised for any mesh. A range of rows is owned by one index of the launch, which visits every element
that touches them, in ascending order, and adds to its own rows only: no atomics, and the order of summation does not
depend on the ranges. Elements at the border of two ranges are computed by both.

Laws are given by an isochoric Kirchhoff stress τ and its spatial tangent c at each of 2×2×2 points, and one pressure
per element (mean dilatation), whose small-strain limit is the B-bar element:

    f_a  = Σ_q τ g_a dV + p G_a,          g_a = ∂N_a/∂x,  G_a = Σ_q g_a dv
    K_ab = Σ_q (g_aᵀ c g_b + (g_a·τ g_b) 1) dV + Σ_q p (g_a ⊗ g_b − g_b ⊗ g_a) dv + U''(θ)/V G_a ⊗ G_b
    U(θ) = κ/2 (θ − 1)²,  p = U'(θ),  θ = v/V

The p in K_ab's second sum is an argument: with the current p, K is the exact tangent; with the pressure predicted by
the last Newton step, κ (θ − 1 + Σ G_a·Δu_a / V), it is the tangent of the mixed method, whose steps stay large for
κ ≫ μ. Laws with full integration include p in τ and c at every point.
"""

import warp as wp

from warpjld_kernels.fem_hexahedron import CORNERS, GRADIENTS
from warpjld_kernels.fem_laws import STRESS, VOIGT
from warpjld_kernels.lanes import VECTORISED, prelude

wp.set_module_options(VECTORISED)

LANES = 8
"""Number of elements processed together."""


@wp.struct
class Batches:
    """Ranges of rows; start of each range's batches; elements, law and number of elements of each batch."""

    ranges: wp.array(dtype=wp.int32)
    first: wp.array(dtype=wp.int32)
    elements: wp.array2d(dtype=wp.int32)
    kinds: wp.array(dtype=wp.int32)
    counts: wp.array(dtype=wp.int32)


@wp.struct
class Model:
    """Node positions; element nodes, the blocks they add to, c10, c01, κ and β, initial stress."""

    nodes: wp.array(dtype=wp.float64)
    elements: wp.array2d(dtype=wp.int32)
    slots: wp.array2d(dtype=wp.int32)
    laws: wp.array2d(dtype=wp.float64)
    initial_stress: wp.array2d(dtype=wp.float64)


@wp.struct
class State:
    """Displacement; pressures used in K; displacement about to be added."""

    displacement: wp.array(dtype=wp.float64)
    pressures: wp.array(dtype=wp.float64)
    increment: wp.array(dtype=wp.float64)


@wp.struct
class Sums:
    """Blocks, internal forces, smallest Jacobian determinant and extrapolated pressure of each element."""

    values: wp.array(dtype=wp.float64)
    forces: wp.array(dtype=wp.float64)
    lowest: wp.array(dtype=wp.float64)
    pressures: wp.array(dtype=wp.float64)


@wp.func_native(
    prelude(LANES)
    + VOIGT
    + CORNERS
    + f"constexpr int LANES = {LANES};"
    + """
    int pair[8][8];
    for (int a = 0, n = 0; a < 8; ++a)
        for (int b = a; b < 8; ++b) pair[a][b] = pair[b][a] = n++;
    const int row0 = batches.ranges.data[range], row1 = batches.ranges.data[range + 1];

    const int begin = LANES * batches.first.data[range], end = LANES * batches.first.data[range + 1];
    for (int place = begin; place < end; place += N) {
        const int batch = place / LANES, left = batches.counts.data[batch] - place % LANES;
        const int* ids = batches.elements.data + place;
        const int kind = batches.kinds.data[batch], count = left < N ? left : N;
        const bool large = kind >= NEO_HOOKE;
        const bool full = kind == LINEAR_FULL || kind == NEO_HOOKE_FULL;

        Doubles rest[8][3], now[8][3], moved[8][3], c10, c01, kappa, beta, s0[6];
        for (int l = 0; l < N; ++l) {
            const int e = ids[l];
            const double* law = model.laws.data + 4 * e;
            PICK(c10, l) = law[0];
            PICK(c01, l) = law[1];
            PICK(kappa, l) = law[2];
            PICK(beta, l) = law[3];
            for (int I = 0; I < 6; ++I) PICK(s0[I], l) = model.initial_stress.data[6 * e + I];
            for (int a = 0; a < 8; ++a)
                for (int i = 0; i < 3; ++i) {
                    const int at_node = 3 * model.elements.data[8 * e + a] + i;
                    PICK(rest[a][i], l) = model.nodes.data[at_node];
                    PICK(moved[a][i], l) = state.displacement.data[at_node];
                }
        }
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) now[a][i] = large ? rest[a][i] + moved[a][i] : rest[a][i];

"""
    + GRADIENTS
    + """
        for (int l = 0; l < count; ++l) out.lowest.data[ids[l]] = PICK(lowest, l);

        const Doubles pressure = large ? kappa * (current / volume - 1.0) : Doubles(0);
        Doubles swelling = 0, held;
        for (int a = 0; a < 8; ++a)
            for (int l = 0; l < N; ++l) {
                const double* step = state.increment.data + 3 * model.elements.data[8 * ids[l] + a];
                for (int i = 0; i < 3; ++i) PICK(swelling, l) += PICK(G[a][i], l) * step[i];
            }
        for (int l = 0; l < N; ++l) PICK(held, l) = full ? 0.0 : state.pressures.data[ids[l]];
        const Doubles following = pressure + kappa * swelling / volume;
        for (int l = 0; l < count; ++l) out.pressures.data[ids[l]] = PICK(following, l);
        const Doubles bulk = full ? Doubles(0) : kappa / volume;
        Doubles K[36][9], f[8][3];
        for (int n = 0; n < 36; ++n)
            for (int i = 0; i < 9; ++i) K[n][i] = 0;
        for (int a = 0; a < 8; ++a)
            for (int i = 0; i < 3; ++i) f[a][i] = large && !full ? pressure * G[a][i] : Doubles(0);

        for (int q = 0; q < 8; ++q) {
"""
    + STRESS
    + """
            Doubles h[8][3];
            for (int a = 0; a < 8; ++a) {
                const Doubles x = g[q][a][0], y = g[q][a][1], z = g[q][a][2];
                h[a][0] = dV[q] * (total[0] * x + total[3] * y + total[5] * z);
                h[a][1] = dV[q] * (total[3] * x + total[1] * y + total[4] * z);
                h[a][2] = dV[q] * (total[5] * x + total[4] * y + total[2] * z);
                for (int i = 0; i < 3; ++i) f[a][i] += h[a][i];
            }
            if (!want_stiffness && large) continue;
            const Doubles squeeze = held * dv[q];
            for (int b = 0; b < 8; ++b) {
                const Doubles x = dV[q] * g[q][b][0], y = dV[q] * g[q][b][1], z = dV[q] * g[q][b][2];
                Doubles C[6][3];
                for (int I = 0; I < 6; ++I) {
                    C[I][0] = D[I][0] * x + D[I][3] * y + D[I][5] * z;
                    C[I][1] = D[I][3] * x + D[I][1] * y + D[I][4] * z;
                    C[I][2] = D[I][5] * x + D[I][4] * y + D[I][2] * z;
                }
                for (int a = 0; a <= b; ++a) {
                    const Doubles gx = g[q][a][0], gy = g[q][a][1], gz = g[q][a][2];
                    Doubles* k = K[pair[a][b]];
                    for (int j = 0; j < 3; ++j) {
                        k[j] += gx * C[0][j] + gy * C[3][j] + gz * C[5][j];
                        k[3 + j] += gx * C[3][j] + gy * C[1][j] + gz * C[4][j];
                        k[6 + j] += gx * C[5][j] + gy * C[4][j] + gz * C[2][j];
                    }
                    if (large) {
                        const Doubles s = h[a][0] * g[q][b][0] + h[a][1] * g[q][b][1] + h[a][2] * g[q][b][2];
                        k[0] += s;
                        k[4] += s;
                        k[8] += s;
                        const Doubles xy = squeeze * (gx * g[q][b][1] - gy * g[q][b][0]);
                        const Doubles yz = squeeze * (gy * g[q][b][2] - gz * g[q][b][1]);
                        const Doubles zx = squeeze * (gz * g[q][b][0] - gx * g[q][b][2]);
                        k[1] += xy;
                        k[3] -= xy;
                        k[5] += yz;
                        k[7] -= yz;
                        k[6] += zx;
                        k[2] -= zx;
                    }
                }
            }
        }
        if (want_stiffness || !large)
            for (int b = 0; b < 8; ++b)
                for (int a = 0; a <= b; ++a)
                    for (int i = 0; i < 3; ++i)
                        for (int j = 0; j < 3; ++j) K[pair[a][b]][3 * i + j] += bulk * G[a][i] * G[b][j];
        if (!large)
            for (int a = 0; a < 8; ++a)
                for (int b = 0; b < 8; ++b) {
                    const Doubles* k = K[pair[a][b]];
                    for (int i = 0; i < 3; ++i)
                        for (int j = 0; j < 3; ++j) f[a][i] += (a <= b ? k[3 * i + j] : k[3 * j + i]) * moved[b][j];
                }

        for (int l = 0; l < count; ++l) {
            const int e = ids[l];
            for (int a = 0; a < 8; ++a) {
                const int row = model.elements.data[8 * e + a];
                if (row < row0 || row >= row1) continue;
                for (int i = 0; i < 3; ++i) out.forces.data[3 * row + i] += PICK(f[a][i], l);
                if (!want_stiffness) continue;
                for (int b = 0; b < 8; ++b) {
                    double* block = out.values.data + 9 * size_t(model.slots.data[64 * size_t(e) + 8 * a + b]);
                    const Doubles* k = K[pair[a][b]];
                    if (a <= b)
                        for (int i = 0; i < 9; ++i) block[i] += PICK(k[i], l);
                    else
                        for (int i = 0; i < 3; ++i)
                            for (int j = 0; j < 3; ++j) block[3 * i + j] += PICK(k[3 * j + i], l);
                }
            }
        }
    }
"""
)
def add_elements(range: int, batches: Batches, model: Model, state: State, want_stiffness: wp.bool, out: Sums): ...


@wp.kernel
def assemble(
    # ranges of rows and their batches of elements
    first: int,
    batches: Batches,
    # model and state
    model: Model,
    state: State,
    want_stiffness: wp.bool,
    # out: values and forces are zero before
    out: Sums,
):
    """Tangent blocks, internal forces, and smallest Jacobian determinant of each element, at a displacement."""
    add_elements(first + wp.tid(), batches, model, state, want_stiffness, out)
