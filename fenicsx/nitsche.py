"""The method, once: the law of contact and the forms of the family (2.4) in UFL, for paper.py and signorini.py.

After E. Burman, P. Hansbo, M. G. Larson, "The penalty-free Nitsche method and nonconforming finite elements for the
Signorini problem", SIAM J. Numer. Anal. 55 (2017), 2523-2539; equation numbers are theirs. They take g = t = ψ = 0.

Strong form (1.1):          -Δu = f                                in Ω
                              u = g                                on Γ_D
                            ∂ₙu = t                                on Γ_N
                          u ≤ ψ,  ∂ₙu ≤ 0,  (u - ψ) ∂ₙu = 0        on Γ_C

which on Γ_C says (2.2)   u - ψ = -[P_γ(u)]₊,   P_γ(u) = γ ∂ₙu - (u - ψ),   [x]₊ = max(x, 0),   for any γ > 0.

Weak form (3.1): find u in V_h, u = g on Γ_D, with A_h(u; v) = L(v) for all v in V_h that vanish on Γ_D, where by (2.4)

    a_h(u, v)  =  (∇u, ∇v)_Ω - <∂ₙu, v>_C                  inner(grad(u), grad(v)) * dx - dn(u) * v * ds_C
    A_h(u; v)  =  a_h(u, v)                                a_h
                  + θ₁ <u - ψ, ∂ₙv>_C                      + theta1 * (u - psi) * dn(v) * ds_C
                  + θ₂ <γ⁻¹ (u - ψ), v>_C                  + theta2 / gamma * (u - psi) * v * ds_C
                  + <[P_γ(u)]₊, θ₂ γ⁻¹ v + θ₁ ∂ₙv>_C       + plus(P_gamma) * (theta2 / gamma * v + theta1 * dn(v)) * ds_C
    L(v)       =  (f, v)_Ω + <t, v>_N                      f * v * dx + t * v * ds_N

θ₁ = 1, θ₂ = 0 on Crouzeix-Raviart elements is the paper's penalty-free method (3.2); θ₂ = 1 is that of Chouly, Hild and
Renard (2.5), which on P2 serves as the reference.
"""

import dolfinx.fem.petsc
import ufl
from petsc4py import PETSc
from ufl import FacetNormal, conditional, dot, grad, gt, inner

CONTACT, DIRICHLET, NEUMANN = 1, 2, 3  # labels of the boundary faces
ELEMENTS = {"CR": ("CR", 1), "P1": ("Lagrange", 1), "P2": ("Lagrange", 2)}


def load_form(V, data, dx, ds):
    """L(v) of (3.1), by the rules that `dx` and `ds` carry."""
    v = ufl.TestFunction(V)
    return data["f"] * v * dx + data["t"] * v * ds(NEUMANN)


def nitsche_forms(u, gamma, data, ds, sigma=None):
    """A_h(u; v) of (3.1) and its derivative J(w, v) at u. `ds` carries the rule the scheme is defined by."""
    V = u.function_space
    v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
    n = FacetNormal(V.mesh)
    theta1, theta2, psi = (data[name] for name in ("theta1", "theta2", "psi"))
    ds_C = ds(CONTACT)

    def dn(u):  # ∂ₙu = n·∇u
        return dot(n, grad(u))

    def flux(u):  # ∂ₙu, or λ where it is corrected by the load
        return dn(u) if sigma is None else dn(u) - dot(n, sigma)

    P_gamma = gamma * flux(u) - (u - psi)
    # u - ψ + [P_γ(u)]₊ without the cancellation; P_γ ≤ 0 is contact, in the derivative below too.
    law = conditional(gt(P_gamma, 0), gamma * flux(u), u - psi)

    # Degree 2 is exact here. Never less, and never two rules on one measure in one form: there FFCx 0.5 may generate
    # wrong code. So (f, v) stays out of A_h.
    a_h = inner(grad(u), grad(v)) * ufl.dx(degree=2) - flux(u) * v * ds_C

    # (2.4); for θ₁ = 1, θ₂ = 0 this is (3.2), a_h(u, v) + <u - ψ + [P_γ(u)]₊, ∂ₙv>_C
    A_h = a_h + law * (theta2 / gamma * v + theta1 * dn(v)) * ds_C

    J = ufl.derivative(A_h, u, w)
    return A_h, J


def chouly_hild_renard(u, gamma, theta1, ds):
    """(2.5), ψ = 0: the left-hand side as Chouly, Hild and Renard have it. By Proposition 2.1 it is (2.4) with θ₂ = 1."""
    V = u.function_space
    v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
    n = FacetNormal(V.mesh)
    ds_C = ds(CONTACT)
    dn_u, dn_v = dot(n, grad(u)), dot(n, grad(v))
    lateral = u - gamma * dn_u
    A_h = (
        inner(grad(u), grad(v)) * ufl.dx(degree=2)
        + 1 / gamma * conditional(gt(lateral, 0), lateral, 0) * (v + theta1 * gamma * dn_v) * ds_C
        + theta1 * gamma * dn_u * dn_v * ds_C
    )
    return A_h, ufl.derivative(A_h, u, w)


def fixed_point(u, gamma, ds, theta1=1.0, theta2=0.0):
    """In the place of J: the paper's fixed point as it may have been; its splitting is not stated.

    In γ ∂ₙu + [u - γ ∂ₙu]₊, which is u + [P_γ(u)]₊ by (2.6), the displacement new and the flux old: γ ∂ₙu' + χ (u' - γ ∂ₙu), χ from u.
    To the change w = u' - u that is γ ∂ₙw + χ w, where Newton's method has χ w + (1 - χ) γ ∂ₙw. ψ = 0.
    """
    V = u.function_space
    v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
    n = FacetNormal(V.mesh)
    ds_C = ds(CONTACT)
    dn_u, dn_v, dn_w = dot(n, grad(u)), dot(n, grad(v)), dot(n, grad(w))
    new = gamma * dn_w + conditional(gt(gamma * dn_u - u, 0), 0.0, w)
    return (
        inner(grad(w), grad(v)) * ufl.dx(degree=2) - dn_w * v * ds_C + new * (theta2 / gamma * v + theta1 * dn_v) * ds_C
    )


def energy(v, degree):
    """‖∇v‖²_h = Σ_κ ‖∇v‖²_κ, the measure of a Newton step."""
    return inner(grad(v), grad(v)) * ufl.dx(degree=2 * degree)


def assemble(b, form):
    """b <- the vector of a linear form."""
    with b.localForm() as local:
        local.set(0)
    dolfinx.fem.petsc.assemble_vector(b, form)
    b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)


def linear_solver(A):
    """MUMPS' sparse LU, or what PETSC_OPTIONS says, as in "-ksp_type gmres -pc_type hypre"; a failure raises."""
    solver = PETSc.KSP().create(A.comm)
    solver.setOperators(A)
    solver.setType(PETSc.KSP.Type.PREONLY)
    solver.getPC().setType(PETSc.PC.Type.LU)
    solver.getPC().setFactorSolverType("mumps")
    solver.setErrorIfNotConverged(True)
    solver.setFromOptions()
    return solver
