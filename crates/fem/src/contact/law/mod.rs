//! The laws: how u ≤ ψ, ∂ₙu ≤ 0, (u-ψ) ∂ₙu = 0 on Γ_C enter the scheme. All of them are one form,
//!
//! ```text
//! (∇u,∇v) - Σ_k w_k q_k(u) g_k(v) + Σ_k w_k max(g_k(u)-ψ_k, γ_k q_k(u)) (θ₂γ_k⁻¹ g_k(v) + θ₁ q_k'(v)) = L(v)
//! ```
//!
//! and differ in the functionals of displacement g_k and flux q_k, and in θ:
//!
//! ```text
//!              g_k                      q_k                                   θ
//! Nitsche      values at the rule's     ∂ₙ there                              any: this is (2.4)
//!              points on Γ_C
//! Corrected    the same                 ∂ₙ - L(φ_F)/|F| on F                  (1, 0)
//! Penalty      the same                 0                                     (0, 1)
//! Multiplier   means on faces           means of ∂ₙ                           (-1, 1): λ eliminated by
//!                                                                             λ = min(0, q - γ⁻¹(g-ψ))
//! Variational  dofs on Γ_C              ((∇u,∇φ_k) - L(φ_k)) / ∫_C φ_k,       (0, 1): row k becomes
//!                                       the flux that balances row k          max(g-ψ, γq) = 0
//! ```

mod flux_corrected;
mod formula;
mod multiplier;
mod nitsche;
mod penalty;
mod variational;

pub use formula::{Formula, OnContact};
pub use multiplier::Multiplier;
pub use nitsche::Nitsche;
pub use penalty::Penalty;

/// A law by name; what it is made of is its [`Formula`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// Nitsche's method with any θ, penalty-free with θ₂ = 0.
    Nitsche(Nitsche),
    /// Penalty-free, with the flux of CR corrected by the load: λ = ∂ₙu - L(φ_F)/|F|.
    FluxCorrected,
    /// The discrete variational inequality: complementarity at each dof on Γ_C.
    Variational,
    /// u ≤ ψ by penalty, which is not consistent.
    Penalty(Penalty),
    /// A stabilised multiplier, constant on each contact face.
    Multiplier(Multiplier),
}

impl std::ops::Deref for Law {
    type Target = dyn Formula;

    fn deref(&self) -> &Self::Target {
        match self {
            Law::Nitsche(law) => law,
            Law::FluxCorrected => &flux_corrected::FluxCorrected,
            Law::Variational => &variational::Variational,
            Law::Penalty(law) => law,
            Law::Multiplier(law) => law,
        }
    }
}
