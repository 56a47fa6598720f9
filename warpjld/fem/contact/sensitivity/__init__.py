"""Sensitivity of a contact equilibrium: derivatives of displacements, contact forces and reactions by parameters.

Notation as in ``contact.solver``. At convergence the multipliers have replaced the penalty. For active points a (in
contact or bonded) the equations are those of the active set, without penalty:

    (1)  f_ext − f_int(u; θ) + Σ_a A Wᵀ (q − p n) = 0                       at free degrees of freedom
    (2)  g(u; θ) = 0                                                        active: p is the multiplier
    (3)  Tᵀ s(u; θ) = 0,  s = (I − n nᵀ) (W (u − u₀) − carried)             sticking: q = T η, T spans the tangent plane
    (4)  q = μ p t,  t = −s / |s|                                           sliding, backward Euler over the last step
    (5)  p = q = 0                                                          open

with u₀ and the contact state at the start of the last load step: that step is differentiated, the history before it is
constant. Differentiating (1)–(4) by a parameter θ gives the linear saddle-point problem

    (6)  [K − F_u   −B] [du]   [∂R/∂θ]      F_u: derivative of Σ A Wᵀ (q − p n) by u at constant p, η: weights, areas,
         [  C        0] [dλ] = [−∂c/∂θ]          normals, tangent planes, and μ p (I − t tᵀ) / |s| at sliding points
                                            B:   A Wᵀ (−n + μ t) for p, A Wᵀ T for η;  C: derivative of (2), (3) by u

which is non-symmetric with sliding points. It is solved by the method of multipliers, exact at its fixed point:

    (7)  (K − F_u + B E C) du = ∂R/∂θ + B (ν − E ∂c/∂θ);   ν ← ν − E (C du + ∂c/∂θ) → dλ

The matrix of (7) is factorised once for any number of parameters; E is as large as the factorisation allows, so that
two to five iterations suffice. Derivatives of reactions, digits' forces and pressures are linear in (du, dλ).

The derivative is valid away from changes of the active set: where a point is about to open, touch, stick or slip, it
jumps (and is one-sided), and the nearest such change bounds the range of a linear extrapolation.

- P. Michaleris, D. A. Tortorelli, C. A. Vidal 1994, Tangent operators and design sensitivity formulations for transient
  non-linear coupled problems, Int. J. Numer. Methods Eng. 37, 2471–2499: differentiating the equations of the step.
- A. Klarbring, J. Haslinger 1993, On almost constant contact stress distributions by shape optimization, Struct. Optim.
  5, 213–216: derivatives of equilibria with unilateral contact.
- N. Strömberg, A. Klarbring 2010, Topology optimization of structures in unilateral contact, Struct. Multidiscip.
  Optim. 41, 57–64: sensitivities from the augmented Lagrangian's equations.
- D. P. Bertsekas 1982, Constrained Optimization and Lagrange Multiplier Methods, §2: (7) and its rate.
"""
