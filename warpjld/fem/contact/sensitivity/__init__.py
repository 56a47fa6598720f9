"""Sensitivity of a contact equilibrium: how displacements, contact forces and reactions follow what is prescribed.

Notation as in ``contact.solver``. At convergence multipliers have taken over what the penalty did: of active points a
(pressed, or bonded) the equations are those of the active set, with no penalty in them,

    (1)  f_ext − f_int(u; θ) + Σ_a A Wᵀ (q − p n) = 0                       at free degrees of freedom
    (2)  g(u; θ) = 0                                                        active: p is what holds the gap shut
    (3)  Tᵀ s(u; θ) = 0,  s = (I − n nᵀ) (W (u − u₀) − carried)             sticking: q = T η, T spans the tangent plane
    (4)  q = μ p t,  t = −s / |s|                                           sliding, backward Euler over the last step
    (5)  p = q = 0                                                          open

with u₀, and what the multipliers knew, at the start of the last load step: the step that found the equilibrium is what
is differentiated, the history before it stays. By a parameter θ, (1)–(4) give the linear saddle-point problem

    (6)  [K − F_u   −B] [du]   [∂R/∂θ]      F_u: of Σ A Wᵀ (q − p n) by u with p, η held: weights, areas, normals,
         [  C        0] [dλ] = [−∂c/∂θ]          μ p (I − t tᵀ) / |s| of what slides, turning tangent planes
                                            B:   A Wᵀ (−n + μ t) for p, A Wᵀ T for η;  C: of (2), (3) by u

which is not symmetric where anything slides. It is solved by the method of multipliers, exact at its fixed point:

    (7)  (K − F_u + B E C) du = ∂R/∂θ + B (ν − E ∂c/∂θ);   ν ← ν − E (C du + ∂c/∂θ) → dλ

The matrix of (7) is factorised once for any number of parameters; E is as stiff as a factor allows, so that two to five
rounds suffice. Derivatives of reactions, digits' forces and pressures are linear in (du, dλ).

It holds away from changes of the active set: where a point is about to open, touch, stick or slip, the derivative jumps
(it is then one-sided), and the nearest such change bounds how far the linear answer reaches.

- P. Michaleris, D. A. Tortorelli, C. A. Vidal 1994, Tangent operators and design sensitivity formulations for transient
  non-linear coupled problems, Int. J. Numer. Methods Eng. 37, 2471–2499: differentiate the step's own equations.
- A. Klarbring, J. Haslinger 1993, On almost constant contact stress distributions by shape optimization, Struct. Optim.
  5, 213–216: derivatives of equilibria with unilateral contact.
- N. Strömberg, A. Klarbring 2010, Topology optimization of structures in unilateral contact, Struct. Multidiscip.
  Optim. 41, 57–64: sensitivities from the augmented Lagrangian's equations.
- D. P. Bertsekas 1982, Constrained Optimization and Lagrange Multiplier Methods, §2: (7) and its rate.
"""
