//! Observed orders of convergence.

/// Observed orders of consecutive (n, difference) pairs: log(d₁/d₂) / log(n₂/n₁).
pub fn observed_orders(levels: &[(usize, f64)]) -> Vec<f64> {
    levels
        .windows(2)
        .map(|w| (w[0].1 / w[1].1).ln() / (w[1].0 as f64 / w[0].0 as f64).ln())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_those_of_powers() {
        let orders = observed_orders(&[(16, 1.0), (32, 0.25), (64, 0.03125)]);
        assert_eq!(orders, [2.0, 3.0]);
    }
}
