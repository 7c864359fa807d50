use super::*;
use crate::quadrature::{exact, parts};

/// Points and weights of a composite rule on 4^dim parts.
fn points(dim: usize) -> Vec<([f64; 4], f64)> {
    let twice = parts(&WHOLE, dim)
        .into_iter()
        .flat_map(|part| parts(&part, dim));
    let twice: Vec<Piece> = twice.collect();
    let share = 1.0 / twice.len() as f64;
    let of = |part: &Piece| -> Vec<([f64; 4], f64)> {
        let inside = |inner: [f64; 4]| {
            std::array::from_fn(|i| (0..=dim).map(|k| inner[k] * part[k][i]).sum())
        };
        let rule = exact(dim, 5);
        rule.iter().map(|(l, w)| (inside(l), share * w)).collect()
    };
    twice.iter().flat_map(of).collect()
}

/// On random cells and faces: what is said of f - p holds at the points of a rule, in its mean and in its mean square.
#[test]
fn models_hold_the_function() {
    let mut random = crate::Random::new(3);
    let mut random = || random.next();
    for text in [
        "sin(3*x + y - z) + x^2*y",
        "exp(x*y) / (2 + z) - x^y",
        "sqrt(2 + x - y) * cos(2*z)",
        "atan2(1 + y, 2 + x) + tanh(3*x)*z",
        "(x - 0.5)^4 - 2*(y - 0.3)^3*x + x*y*z",
        "abs(x - 0.4) + if(y < 0.6, 0, 1)",
        "sin(3*y) + 2*y^3",
    ] {
        let expression = Expression::parse(text).unwrap();
        for (dim, space) in [(1, 2), (2, 2), (2, 3), (3, 3)] {
            // What is known of other boxes, and by fewer derivatives, is not taken for what it is not.
            let mut boxes = Boxes::default();
            for _ in 0..40 {
                let size = 0.4 * 10f64.powf(-2.0 * random());
                let first: [f64; 3] = std::array::from_fn(|_| 0.3 + random());
                let mut corner = || -> [f64; 3] {
                    let mut at = |k: usize| first[k] + size * random();
                    std::array::from_fn(|k| if k < space { at(k) } else { 0.0 })
                };
                let vertices: [[f64; 3]; 4] = std::array::from_fn(|_| corner());
                // The same corners in another order are another simplex, and so are the same but for one.
                let (mut turned, mut moved) = (vertices, vertices);
                turned[..=dim].rotate_left(1);
                moved[dim] = corner();
                for vertices in [vertices, turned, moved] {
                    let domain = Domain {
                        expression: &expression,
                        vertices: Box::new(move |_| vertices),
                        measures: vec![1.0],
                        dim,
                        space,
                        unit: 0,
                    };
                    let left = |lambda: &[f64; 4], leaf: &Leaf| {
                        let all = vertices.iter().zip(lambda).take(dim + 1);
                        let x = std::array::from_fn(|k| all.clone().map(|(v, l)| l * v[k]).sum());
                        let linear = leaf.values.iter().zip(lambda).take(dim + 1);
                        expression.value(x) - linear.map(|(p, l)| p * l).sum::<f64>()
                    };
                    let errors = [AT_FIRST, MOST].map(|order| {
                        let leaf = domain.model((0, &WHOLE), order, &domain.axes(), &mut boxes);
                        let (mut mean, mut square) = (0.0, 0.0);
                        for (lambda, weight) in points(dim) {
                            let off = left(&lambda, &leaf);
                            assert!(
                                off.abs() <= leaf.wave + leaf.error + 1e-12,
                                "{text} {leaf:?}"
                            );
                            mean += weight * off;
                            square += weight * off * off;
                        }
                        if leaf.is_smooth {
                            // The rule has an error of its own.
                            let slack = 1e-12 + 1e-5 * size.powi(6);
                            assert!(mean.abs() <= leaf.error + slack, "{text} {mean} {leaf:?}");
                            let root = square.sqrt();
                            assert!(
                                root <= leaf.swell + leaf.error + slack,
                                "{text} {root} {leaf:?}"
                            );
                        }
                        leaf.error
                    });
                    // Third and fourth derivatives are worth their time.
                    if size < 0.1 && !text.contains("if") {
                        let [second, fourth] = errors;
                        assert!(fourth <= 0.02 * second + 1e-13, "{text} {size} {errors:?}");
                    }
                }
            }
        }
    }
}
