"""Contact solver: augmented Lagrangian method with Newton's method on bodies and contact together, in load steps.

Notation: u displacement, x = X + u; of contact point a: area A, weights W (mortar weights, or a single node against an
obstacle), unit normal n towards the other side (between meshes: the mean over those parts of both sides' faces around
the node that face each other, the flatter side's weighted more, ``FacingParts``), gap g = −n·(W x), slip
s = (I − n nᵀ) W (u − u₀) since the start of the load step (minus the obstacle's own motion), multipliers λ_n ≥ 0 and
λ_t, penalty ε, friction coefficient μ. Equation numbers are those of this file.

    (1)  R(u, λ) = f_ext(u) − f_int(u) + Σ_a A Wᵀ (q − p n) = 0             equilibrium at free degrees of freedom
    (2)  p = max(0, λ_n − ε g)                                              pressure (Alart & Curnier 1991)
    (3)  q* = λ_t − ε s;  q = q* if |q*| ≤ μ p (stick), else μ p q*/|q*|    return mapping (Simo & Laursen 1992)
    (4)  (K + Σ_a A Wᵀ H W + E) Δu = R,   H = ε n nᵀ + H_t                  Newton step
    (5)  λ_n ← p,  λ_t ← q, by (2), (3) linearised at u, evaluated at u+Δu  multiplier update (Uzawa, every iteration)
    (6)  |R| ≤ tolerance · scale,  −g ≤ penetration · edge,  Σ A |Δλ| ≤ 0.002 Σ A |λ|           convergence

K is the tangent of the bodies; H_t = ε (I − n nᵀ) at sticking points, and at sliding points the resistance to turning
of the slip direction. K + Σ A Wᵀ H W (below: K + H) is symmetric and, as ε is moderate (200 E*/edge), well conditioned;
(5) removes the penetration and elastic slip that a penalty leaves. It is factorised by multifrontal Cholesky
(``fem.solver.factor``); if that costs too much, or K + H is not positive definite, a multigrid preconditioner is used.
E is the non-symmetric part of the tangent: derivatives of mortar weights and normals (Puso & Laursen 2004), and of
friction with respect to pressure; with it (4) is solved by GMRES preconditioned by K + H.

A load step (``load_steps``, ``contact_newton``) starts from u and λ of the previous step, at the predictor with the
smallest residual (u carried along by the moving boundary conditions, or u itself if these stand still, with or without
the last step's correction); if that fails, at u itself, with the Dirichlet values applied in the first Newton step.
Iterations:

1. ``newton_state.assemble``: R of (1). The step ends when (6) holds and contact points searched again agree
   (``balanced``, ``confirmed``).
2. ``newton_state.linearise``, ``tangent``: E; ``lagged_solver``: Δu of (4). If K + H is not positive definite,
   ``damping`` adds a fraction of the stiffness at rest (Levenberg–Marquardt). A body without Dirichlet conditions gets
   a small artificial stiffness until contact resists all its rigid motions (``unconstrained.grasped``).
   A search that does not come near (|R| above 0.3 of the forces for 10 iterations; 0.05 for 20 if bodies are held by
   contact alone), or whose |R| has not become less for 12 iterations (if none is held by contact alone), is abandoned.
3. Step length along Δu (``contact_newton``): limited by the search distance of contact, and such that elements keep a
   fifth of their Jacobian determinants (``line_search.length_upright``); in the alternating phase also by 5.
4. ``newton_state.advance``: λ by (5); contact points searched again; forces by (2), (3).
   *Fixed-point phase*, iterations 1–8: full steps, λ updated after each, and the active set frozen during a solve:
   points with λ_n > 0 are active in (2) whatever their gap, and the solve decides whether they open (primal–dual active
   set strategy: Hüeber & Wohlmuth 2005). λ_n of the previous solve bounds friction in (3), so that each solve is a
   convex problem (Tresca friction). Friction acts on a point from its second iteration with pressure on; if it has slid
   far without friction until then, and no body is held by friction alone, it begins by sliding, else by sticking. If
   contact alone holds a body that slid everywhere and is let go, all points begin by sticking (``stuck_again``).
5. *Alternating phase*, afterwards: λ is updated only if the active set did not change; otherwise a line search along Δu
   (by work, or by the residual if E is present) settles the active set.
   In either phase friction is bounded by the current pressure (``coupled``: full Coulomb friction) once the same points
   touch, slide and stick in successive iterations (four where some stick, else two), as iterating over Tresca bounds
   leaves up to 0.7 of the error each time; and once |R| is small, (3) is evaluated with its trial traction, since the
   slip direction of the fixed-point phase converges as slowly. If sticking points change because of that, the bound is
   taken from the previous solve again.
   If the contact points do not agree with those searched again at convergence, iterations continue in this phase, at
   most twice. Points are also searched again once a node has moved by a twentieth of an edge since the last search.
   At convergence, (2) and (3) are evaluated once more at the slip found (``confirmed``), since its direction may differ
   from that of the multipliers.
6. Bonds whose traction exceeds their strength are broken and the step is solved again; a step that fails is halved.

``contact_system`` evaluates (2)–(5) for all interfaces, ``contact.law`` for one; ``elastic`` f_int, f_ext and K.
``unconstrained`` stabilises bodies held by contact alone, and explains a failure: unheld, sliding or blocked;
``statics`` proves that friction cannot hold a body before that is reported. ``passing`` cuts steps longer than contact
search can follow (by the ``predicted_motion``) and finds nodes deep inside another body; ``first_touch`` finds when
in a step frictional contact begins; ``friction_continuation`` helps where friction alone holds a body; ``unresolved``
finds corners and edges that the mesh is too coarse to resolve, ``facet_ridges`` facets that scatter pressures.

Numeric constants of these modules have their units in brackets, none if they are dimensionless; those without a stated
reason or source are assumed.

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
