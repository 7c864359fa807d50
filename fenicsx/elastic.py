"""Contact in linear elasticity, once: the law of contact and the family (2.4), with σₙ for ∂ₙ, in UFL.

Equation numbers: E. Burman, P. Hansbo, M. G. Larson, SIAM J. Numer. Anal. 55 (2017), 2523-2539; theirs is the scalar problem, as in nitsche.py.

Strong form:      -div σ(u) = f  in Ω,  σ(u) = 2μ ε(u) + λ div u I,    u = g  on Γ_D,    σn = t  on Γ_N,
              uₙ ≤ ψ,  σₙ ≤ 0,  (uₙ - ψ) σₙ = 0                         on Γ_C,  with no shear there, or with friction:
              |σ_t| ≤ s, and where the body slips σ_t = -s u_t/|u_t|; s is given (Tresca), or a coefficient times -σₙ (Coulomb).

As equations (2.2), for any γ > 0:   uₙ - ψ = -[Pₙ]₊,   Pₙ = γσₙ - (uₙ - ψ);   γσ_t = |P_t|_s,   P_t = γσ_t - u_t,
where |P_t|_s is the number nearest to P_t that is no larger than γs, and for Coulomb γs is the coefficient times [-Pₙ]₊.

Weak form: find u in V_h, u = g on Γ_D, such that for all v in V_h that vanish on Γ_D

    Σ_K (σ(u), ε(v))_K                                         inner(sigma(u), sym(grad(v))) * dx
      + Σ_F β 2μ/h_F <[u], [v]>_F                              + beta * 2 * mu / h_F * dot(jump(u), jump(v)) * dS
      - <σₙ(u), vₙ>_C                                          - sigma_n(u) * normal(v) * ds_C
      + <uₙ - ψ + [Pₙ]₊, θ₁σₙ(v) + θ₂γ⁻¹vₙ>_C                  + law * (theta1 * sigma_n(v) + theta2 / gamma * normal(v)) * ds_C
      = (f, v)_Ω + <t, v>_N                                    - dot(f, v) * dx - dot(t, v) * ds_N

θ₁ = 1, θ₂ = 0 on Crouzeix-Raviart elements is the penalty-free method, whose jumps over inner facets F (Hansbo and Larson 2003) replace Korn's
inequality; θ₂ = 1 is that of Chouly, Hild and Renard (2015).
"""

import ufl
from ufl import CellDiameter, FacetNormal, Identity, conditional, div, dot, grad, gt, inner, jump, sym


def elastic_form(u, v, data, dx, ds_C, ds_N, dS):
    """A_h(u; v) - L(v). `data` has E, nu, gamma0, theta1, theta2, psi, and what there is of f, t, along, friction, coulomb, beta with h_F, plane_stress."""
    mesh = u.function_space.mesh
    n, h = FacetNormal(mesh), CellDiameter(mesh)
    e = data.get("along", n)  # ψ is the gap along it
    E, nu, psi = (data[name] for name in ("E", "nu", "psi"))
    theta1, theta2 = data["theta1"], data["theta2"]
    mu = E / (2 * (1 + nu))
    lam = E * nu / (1 - nu**2) if data.get("plane_stress") else E * nu / ((1 + nu) * (1 - 2 * nu))
    gamma = data["gamma0"] * h / (2 * mu + lam)

    def sigma(w):
        return 2 * mu * sym(grad(w)) + lam * div(w) * Identity(len(w))

    def sigma_n(w):
        return dot(e, dot(sigma(w), n))

    def normal(w):
        return dot(w, e)

    P_n = gamma * sigma_n(u) - (normal(u) - psi)
    # uₙ - ψ + [Pₙ]₊ without the cancellation; Pₙ ≤ 0 is contact, in the derivative too.
    law = conditional(gt(P_n, 0), gamma * sigma_n(u), normal(u) - psi)
    F = inner(sigma(u), sym(grad(v))) * dx
    F += (law * (theta1 * sigma_n(v) + theta2 / gamma * normal(v)) - sigma_n(u) * normal(v)) * ds_C
    if "beta" in data:
        F += data["beta"] * 2 * mu / data["h_F"] * dot(jump(u), jump(v)) * dS
    if "f" in data:
        F -= dot(data["f"], v) * dx
    if "t" in data:
        F -= dot(data["t"], v) * ds_N
    if "friction" in data or "coulomb" in data:

        def along(w):
            return w[0] * n[1] - w[1] * n[0]

        def sigma_t(w):
            return along(dot(sigma(w), n))

        radius = gamma * data["friction"] if "friction" in data else data["coulomb"] * ufl.max_value(-P_n, 0)
        P_t = gamma * sigma_t(u) - along(u)
        nearest = ufl.max_value(-radius, ufl.min_value(P_t, radius))
        slip = gamma * sigma_t(u) - nearest
        F += (slip * (theta1 * sigma_t(v) + theta2 / gamma * along(v)) - sigma_t(u) * along(v)) * ds_C
    return F
