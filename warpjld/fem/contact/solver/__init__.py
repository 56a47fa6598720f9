"""The contact solver: augmented Lagrangian, Newton's method on bodies and contact together, load steps.

Which algorithm it is. Notation: u displacement, x = X + u; of contact point a: area A, weights W (mortar's, or one node
against an obstacle), unit normal n to the other side, gap g = −n·(W x), slip s = (I − n nᵀ) W (u − u₀) since the step
began (less the obstacle's own), multipliers λ_n ≥ 0 and λ_t, penalty ε, friction μ. Equation numbers are this file's
own.

    (1)  R(u, λ) = f_ext(u) − f_int(u) + Σ_a A Wᵀ (q − p n) = 0             equilibrium at free degrees of freedom
    (2)  p = max(0, λ_n − ε g)                                              pressure (Alart & Curnier 1991)
    (3)  q* = λ_t − ε s;  q = q* if |q*| ≤ μ p (stick), else μ p q*/|q*|    return mapping (Simo & Laursen 1992)
    (4)  (K + Σ_a A Wᵀ H W + E) Δu = R,   H = ε n nᵀ + H_t                  Newton step
    (5)  λ_n ← p,  λ_t ← q, both as (2), (3) are at u + Δu to first order   multiplier update (Uzawa's, every step)
    (6)  |R| ≤ tolerance · scale,  −g ≤ penetration · edge,  Σ A |Δλ| ≤ 0.002 Σ A |λ|           when it has converged

K is the bodies' tangent, H_t = ε (I − n nᵀ) where a point sticks and what resists its path's turning where it slides.
K + H is symmetric and, ε being moderate (200 E*/edge), well conditioned, and (5) takes away what overlap and slip a
penalty leaves. It is factorised (``solver.factor``: multifrontal Cholesky); where that costs too much, or K + H is not
positive definite, multigrid preconditions instead. E is what is not symmetric: derivatives of mortar weights and
normals (Puso & Laursen 2004), and of friction by pressure; with it GMRES takes over, preconditioned by K + H.

A load step (``load_steps``, ``contact_newton``), from u and λ of the step before, at the guess that leaves the least
force over (u carried along by what moves the bodies, alone or with last step's correction), or, where that is in vain,
from u itself, prescribed values yet to go to their place:

1. ``newton_state.assemble``: R of (1); end where (6) holds and points found afresh agree (``balanced``, ``confirmed``).
2. ``newton_state.linearise``, ``tangent``: E; ``lagged_solver``: Δu of (4); where K + H is not positive definite
   ``damping`` lends it stiffness at rest (Levenberg, Marquardt). A body that nothing is prescribed of is held back by
   a little stiffness until contact resists all its motions (``unconstrained.grasped``), and not after that.
   A search that never comes near (|R| above .3 of the forces for ten iterations; .05 for twenty where bodies are
   held by contact alone) is ended.
3. How far along Δu (``contact_newton``): as far as points look ahead; elements keep a fifth of their Jacobians
   (``line_search.length_upright``); see 5 for the rest.
4. ``newton_state.advance``: λ by (5); contact points anew; forces by (2), (3).
   *Fixed-point phase*, iterations 1–8: full steps, λ after each of them, and the active set frozen for a solve: what
   has λ_n > 0 presses in (2) whatever its gap, the solve says whether it lets go (primal–dual active set: Hüeber &
   Wohlmuth 2005); the last solve's λ_n bounds friction in (3), so that each solve is a convex problem (Tresca's).
5. *Alternating phase*, after that: λ is updated only when no point came or went; a line search along Δu settles what
   does (work, or residual where E counts).
   In either phase friction follows the present pressure (coupled) once the same points touch, slide and stick in turn
   after turn: Tresca's bound, taken from the solve before, leaves up to .7 of the error each time. Where points that
   stick come and go by it, the bound is taken from the solve before again.
   A search whose points, found afresh, do not agree goes on in this phase, twice at most; before that, points are seen
   afresh once a node has gone a twentieth of an edge from where they were seen.
   In the end (2), (3) are asked of slip as it is: what the multipliers took to slide one way may slide another.
6. Bonds whose traction is too much are broken, and the step is found again; a step that fails is taken in halves.

``contact_system`` has (2)–(5) for all interfaces, ``contact.law`` for one; ``elastic`` has f_int, f_ext and K;
``unconstrained`` steadies bodies that only contact holds, and says why none was found: falls, slides, or is blocked;
``statics`` proves that friction cannot hold a body before that is said. ``passing`` cuts steps longer than contact can
follow (``course`` says where bodies are going) and finds nodes deep in another body, ``first_touch`` when in a step
friction takes hold of what was apart, ``unresolved`` what is finer than the faces that are to see it.

- P. Alart, A. Curnier 1991, A mixed formulation for frictional contact problems prone to Newton like solution methods,
  Comput. Methods Appl. Mech. Eng. 92, 353–375.
- J. C. Simo, T. A. Laursen 1992, An augmented Lagrangian treatment of contact problems involving friction, Comput.
  Struct. 42, 97–116. The same scheme, with equations, in the FEBio Theory Manual 3.6, §7.1.9.6 (augmentation) and
  §7.1.9.7 (trial state and return mapping).
- M. A. Puso, T. A. Laursen 2004, A mortar segment-to-segment contact method for large deformation solid mechanics,
  Comput. Methods Appl. Mech. Eng. 193, 601–629.
- S. Hüeber, B. I. Wohlmuth 2005, A primal–dual active set strategy for non-linear multibody contact problems, Comput.
  Methods Appl. Mech. Eng. 194, 3147–3166.
"""
