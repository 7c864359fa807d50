//! The factorisations against each other and against the matrix itself.

use super::*;
use proptest::prelude::*;

/// Springs between points in 2D, each end also fixed by a spring of stiffness `ground`.
pub(super) struct Network {
    pub points: Vec<[f64; 3]>,
    pub springs: Vec<([u32; 2], f64)>,
    pub ground: f64,
}

impl Network {
    /// Springs of stiffness 1, 2, … along a line.
    pub fn path(n: u32) -> Self {
        Network {
            points: (0..n).map(|k| [f64::from(k), 0.0, 0.0]).collect(),
            springs: (1..n).map(|k| ([k - 1, k], f64::from(k))).collect(),
            ground: 1.0,
        }
    }

    /// Points scattered in a square by `seed`, each joined to some near it in a grid's order.
    fn scattered(side: u32, seed: u64) -> Self {
        let random = |k: u32| (f64::from(k) * 12.9898 + seed as f64).sin().abs();
        let n = side * side;
        let points = (0..n)
            .map(|k| {
                let (x, y) = (f64::from(k % side), f64::from(k / side));
                [x + 0.8 * random(2 * k), y + 0.8 * random(2 * k + 1), 0.0]
            })
            .collect();
        let mut springs = Vec::new();
        for k in 0..n {
            for (step, inside) in [
                (1, k % side + 1 < side),
                (side, true),
                (side + 1, k % side + 1 < side),
                (side - 1, k % side > 0),
            ] {
                if inside && k + step < n && random(7 * k + step) > 0.2 {
                    springs.push(([k, k + step], 0.1 + random(k + step)));
                }
            }
        }
        Network {
            points,
            springs,
            ground: 0.01,
        }
    }
}

impl Elements for Network {
    fn unknowns(&self) -> usize {
        self.points.len()
    }

    fn count(&self) -> usize {
        self.springs.len()
    }

    fn size(&self) -> usize {
        2
    }

    fn of(&self, element: usize) -> &[u32] {
        &self.springs[element].0
    }

    fn centre(&self, element: usize) -> [f64; 3] {
        let [p, q] = self.springs[element].0.map(|k| self.points[k as usize]);
        std::array::from_fn(|k| 0.5 * (p[k] + q[k]))
    }

    fn matrix(&self, element: usize, matrix: &mut [f64]) {
        let stiffness = self.springs[element].1;
        let diagonal = stiffness + self.ground;
        matrix.copy_from_slice(&[diagonal, -stiffness, -stiffness, diagonal]);
    }
}

/// A bound that avoids an ordering if iterating is better: less than the whole, and no less than each unknown takes.
#[test]
fn one_path_down_the_tree_takes_less_than_the_whole() {
    for [nx, ny, nz] in [[12, 12, 12], [60, 3, 3], [20, 20, 2]] {
        let number = |i: u32, j: u32, k: u32| (k * ny + j) * nx + i;
        let mut network = Network::path(nx * ny * nz);
        network.springs.clear();
        for (i, j, k) in (0..nx * ny * nz).map(|v| (v % nx, v / nx % ny, v / nx / ny)) {
            let own = number(i, j, k);
            network.points[own as usize] = [i, j, k].map(f64::from);
            let ahead = [(1, i + 1 < nx), (nx, j + 1 < ny), (nx * ny, k + 1 < nz)];
            let springs = ahead.iter().filter(|(_, inside)| *inside);
            network
                .springs
                .extend(springs.map(|(step, _)| ([own, own + step], 1.0)));
        }
        let roles = vec![Role::Eliminated; network.points.len()];
        let whole = Analysis::new(&network, &roles, &[], true).seconds();
        let least = Analysis::seconds_at_least(&network, &roles);
        let of_unknowns = 8e-7 * roles.len() as f64;
        assert!(
            of_unknowns < least && least < whole,
            "{nx} {ny} {nz}: {least} {whole}"
        );
        // Far from nothing where fronts are large.
        assert!(nx != ny || nz < nx || 20.0 * (least - of_unknowns) > whole - of_unknowns);
        network.points.iter_mut().for_each(|x| x[2] = 0.0);
        assert_eq!(Analysis::seconds_at_least(&network, &roles), 0.0);
    }
}

/// Unknowns that no spring touches have no equation: they are fixed.
fn roles(network: &Network, kept: u32, fixed: u32, seed: u64) -> Vec<Role> {
    let mut roles = vec![Role::Fixed; network.points.len()];
    for (ends, _) in &network.springs {
        for &k in ends {
            roles[k as usize] = match (u64::from(k) * 7919 + seed) % 100 {
                r if r < u64::from(kept) => Role::Kept,
                r if r < u64::from(kept + fixed) => Role::Fixed,
                _ => Role::Eliminated,
            };
        }
    }
    roles
}

fn settings(solver: Solver, precision: Precision) -> Settings {
    Settings { solver, precision }
}

/// Solves with the Schur complement, and returns x with S and g.
fn solve(
    network: &Network,
    roles: &[Role],
    b: &[f64],
    settings: Settings,
) -> (Vec<f64>, Schur, Vec<f64>, f64) {
    let (factor, reduced, schur, _) = condense(network, roles, &[], b.to_vec(), settings, None)
        .unwrap()
        .unwrap();
    let kept = schur
        .lu(&[], None)
        .changed(&LowRank::default(), &mut Solved::default())(reduced.kept());
    let mut x = vec![0.0; b.len()];
    factor.expand(reduced.clone(), &kept, &mut x);
    // A right-hand side that comes later gives the same as the one that was eliminated along.
    let later = factor.reduce(b);
    let mut again = vec![0.0; b.len()];
    factor.expand(later, &kept, &mut again);
    let rounding = match settings.precision {
        Precision::F32Refined => 1e-6,
        Precision::F64 | Precision::Auto => 1e-13,
    };
    let size = x.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
    for (a, b) in x.iter().zip(&again) {
        assert!((a - b).abs() <= rounding * size, "{a} {b}");
    }
    (x, schur, reduced.kept().to_vec(), reduced.energy())
}

proptest! {
    #![proptest_config(crate::test_config(40))]
    #[test]
    fn both_factorisations_solve_the_system(
        side in 2u32..40, seed in 0u64..1000, kept in 0u32..30, fixed in 0u32..30,
    ) {
        let network = Network::scattered(side, seed);
        let roles = roles(&network, kept, fixed, seed);
        let b: Vec<f64> = (0..network.points.len()).map(|k| (k as f64 + seed as f64).cos()).collect();
        let (x, schur, g, energy) = solve(&network, &roles, &b, settings(Solver::Multifrontal, Precision::F64));
        let (y, other, h, faer) = solve(&network, &roles, &b, settings(Solver::Faer, Precision::F64));
        let size = x.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (a, b) in x.iter().zip(&y) {
            prop_assert!((a - b).abs() <= 1e-13 * size, "{a} {b}");
        }
        // S x_K = g and bᵀx, whatever each of the two keeps.
        let mut energies = [energy, faer];
        for (total, (schur, g, x)) in energies.iter_mut().zip([(&schur, &g, &x), (&other, &h, &y)]) {
            let on_kept: Vec<f64> = schur.kept().iter().map(|&k| x[k as usize]).collect();
            for (a, b) in schur.times(&on_kept).iter().zip(g) {
                prop_assert!((a - b).abs() <= 1e-12 * (1.0 + size), "{a} {b}");
            }
            *total += on_kept.iter().zip(g).map(|(x, g)| x * g).sum::<f64>();
        }
        prop_assert!((energies[0] - energies[1]).abs() <= 1e-11 * (1.0 + energies[0].abs()), "{energies:?}");
        // And the matrix, put together, takes the answer to the right-hand side.
        let matrix = Symmetric::new(&network, &roles).unwrap();
        let free = |v: &[f64]| -> Vec<f64> {
            v.iter().zip(&roles).filter(|(_, r)| **r != Role::Fixed).map(|(v, _)| *v).collect()
        };
        for (a, b) in matrix.times(&free(&x)).iter().zip(free(&b)) {
            prop_assert!((a - b).abs() <= 1e-12 * (1.0 + size), "{a} {b}");
        }
        // f32 has its own digits, whatever the condition.
        let (z, ..) = solve(&network, &roles, &b, settings(Solver::Multifrontal, Precision::F32Refined));
        for (a, b) in x.iter().zip(&z) {
            prop_assert!((a - b).abs() <= 1e-6 * size, "{a} {b}");
        }
    }
}

/// A path that is fixed at one end, whose condition is the square of its length: what rounding to f32 takes from a column must
/// neither hold nor push it.
#[test]
fn a_factor_in_f32_has_six_digits_whatever_the_condition() {
    for length in [300, 30_000_u32] {
        let mut network = Network::path(length);
        network.ground = 0.0;
        for (k, spring) in network.springs.iter_mut().enumerate() {
            spring.1 = 1.0 + 0.3 * (k as f64).sin();
        }
        let mut roles = vec![Role::Eliminated; length as usize];
        roles[0] = Role::Fixed;
        // Forces that are in balance: what rounding leaves of their sum moves all of the path.
        let b: Vec<f64> = (0..length)
            .map(|k| if k % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let by = |precision| {
            let settings = settings(Solver::Multifrontal, precision);
            let (factor, ..) = condense(&network, &roles, &[], b.clone(), settings, None)
                .unwrap()
                .unwrap();
            let mut x = vec![0.0; b.len()];
            factor.expand(factor.reduce(&b), &[], &mut x);
            x
        };
        let (wide, narrow) = (by(Precision::F64), by(Precision::F32Refined));
        let size = wide.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let errors = wide.iter().zip(&narrow).map(|(a, b)| (a - b).abs());
        let error = errors.fold(0.0, f64::max) / size;
        assert!(error > 0.0 && error < 1e-6, "{length}: {error:e}");
    }
}

/// The tree of tasks does not depend on the number of threads, nor does any sum.
#[test]
fn the_number_of_threads_changes_no_bit() {
    let network = Network::scattered(150, 3);
    let roles = roles(&network, 2, 1, 5);
    let b: Vec<f64> = (0..network.points.len())
        .map(|k| (k as f64).sin())
        .collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let settings = settings(Solver::Multifrontal, Precision::F64);
            let (factor, reduced, schur, _) =
                condense(&network, &roles, &[], b.clone(), settings, None)
                    .unwrap()
                    .unwrap();
            let kept = schur.times(reduced.kept());
            let mut x = vec![0.0; b.len()];
            factor.expand(reduced.clone(), &kept, &mut x);
            x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        })
    };
    let one = run(1);
    assert!(one == run(1) && one == run(2) && one == run(3));
}

#[test]
fn an_indefinite_matrix_is_refused_with_the_dof() {
    let mut network = Network::path(50);
    network.springs[20].1 = -5.0;
    let b = vec![1.0; 50];
    for solver in [Solver::Multifrontal, Solver::Faer] {
        let refusal = condense(
            &network,
            &[Role::Eliminated; 50],
            &[],
            b.clone(),
            settings(solver, Precision::F64),
            None,
        );
        let refusal = refusal.err().unwrap().to_string();
        assert!(refusal.contains("not positive definite"), "{refusal}");
    }
}

#[test]
fn more_memory_than_there_is_is_refused_in_words() {
    // Each point joined to three anywhere: what separates two halves is a part of all, and dense.
    let n = 300_000;
    let mut network = Network::path(n);
    let anywhere = |k: u32| (u64::from(k) * 2_654_435_761 % u64::from(n)) as u32;
    for k in 0..2 * n {
        let ends = [k % n, anywhere(k)];
        network
            .springs
            .extend((ends[0] != ends[1]).then_some((ends, 1.0)));
    }
    let roles = vec![Role::Eliminated; n as usize];
    let refusal = condense(
        &network,
        &roles,
        &[],
        vec![0.0; n as usize],
        Settings::default(),
        None,
    );
    let refusal = refusal.err().unwrap().to_string();
    assert!(refusal.contains("MB of memory are available"), "{refusal}");
}
