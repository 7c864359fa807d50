use std::f64::consts::{PI, TAU};

use super::*;

fn all() -> Vec<Reference> {
    let zones = [1, 2, 3, 5].map(|n| Reference::zones(n, DEFAULT_RESOLUTION).unwrap());
    [Reference::one_zone(DEFAULT_RESOLUTION).unwrap()]
        .into_iter()
        .chain(zones)
        .collect()
}

/// Points that avoid symmetry, from the contact side to the far one.
fn samples() -> impl Iterator<Item = (f64, f64)> {
    (0..60).map(|i| {
        let golden = 0.618_033_988_749_895 * f64::from(i + 1);
        (
            0.02 + 0.96 * golden.fract(),
            0.02 + 0.96 * f64::from(i) / 59.0,
        )
    })
}

/// Nodes and weights of 10-point Gauss–Legendre on [0, 1].
fn gauss() -> [(f64, f64); 10] {
    let half = [
        (0.148_874_338_981_631_2, 0.295_524_224_714_752_9),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_4),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    ];
    std::array::from_fn(|i| {
        let (x, w) = half[i / 2];
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        (0.5 + 0.5 * sign * x, 0.5 * w)
    })
}

/// Quadrature on [a, b], graded geometrically towards both ends.
fn graded(a: f64, b: f64, levels: i32) -> Vec<(f64, f64)> {
    let middle = 0.5 * (b - a);
    let mut edges: Vec<f64> = (0..levels).map(|l| middle * 0.25f64.powi(l)).collect();
    edges.push(0.0);
    let mut rule = Vec::new();
    for pair in edges.windows(2) {
        let (outer, inner) = (pair[0], pair[1]);
        for (x, w) in gauss() {
            let distance = inner + (outer - inner) * x;
            rule.push((a + distance, w * (outer - inner)));
            rule.push((b - distance, w * (outer - inner)));
        }
    }
    rule
}

/// Quadrature in x, graded towards every end of the contact set and the sides.
fn graded_across(r: &Reference, levels: i32) -> Vec<(f64, f64)> {
    let mut ends: Vec<f64> = r.contact_set.iter().flatten().copied().collect();
    ends.extend([0.0, 1.0]);
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    ends.windows(2)
        .flat_map(|pair| graded(pair[0], pair[1], levels))
        .collect()
}

#[test]
fn doubled_resolution_changes_nothing() {
    for (coarse, fine) in [
        (
            Reference::one_zone(24).unwrap(),
            Reference::one_zone(48).unwrap(),
        ),
        (
            Reference::one_zone(48).unwrap(),
            Reference::one_zone(96).unwrap(),
        ),
        (
            Reference::zones(1, 48).unwrap(),
            Reference::zones(1, 96).unwrap(),
        ),
        (
            Reference::zones(5, 48).unwrap(),
            Reference::zones(5, 96).unwrap(),
        ),
    ] {
        for (a, b) in coarse
            .contact_set
            .iter()
            .flatten()
            .zip(fine.contact_set.iter().flatten())
        {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert!((coarse.grad_norm_sq / fine.grad_norm_sq - 1.0).abs() < 1e-12);
        assert!((coarse.l2_norm / fine.l2_norm - 1.0).abs() < 1e-12);
        assert!((coarse.contact_flux / fine.contact_flux - 1.0).abs() < 1e-12);
        for (x, y) in samples() {
            assert!((coarse.u(x, y) - fine.u(x, y)).abs() < 1e-12);
            assert!((coarse.flux(x) - fine.flux(x)).abs() < 1e-10 * (1.0 + fine.flux(x).abs()));
            for (a, b) in coarse.grad(x, y).iter().zip(fine.grad(x, y)) {
                assert!((a - b).abs() < 1e-10);
            }
        }
    }
}

#[test]
fn the_equation_holds_in_the_interior() {
    for r in all() {
        let h = 2e-3 / r.load.frequency.max(1.0);
        let stencil = [
            (-3.0, 2.0),
            (-2.0, -27.0),
            (-1.0, 270.0),
            (0.0, -490.0),
            (1.0, 270.0),
            (2.0, -27.0),
            (3.0, 2.0),
        ];
        for (x, y) in samples() {
            let laplacian: f64 = stencil
                .iter()
                .map(|(s, c)| c * (r.u(x + s * h, y) + r.u(x, y + s * h)) / (180.0 * h * h))
                .sum();
            let error = laplacian + r.f(x);
            assert!(
                error.abs() < 1e-7 * r.load.omega().powi(2),
                "({x}, {y}): {error}"
            );
        }
    }
}

#[test]
fn the_gradient_is_that_of_u() {
    let first = [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)];
    for r in all() {
        let h = 1e-3 / r.load.frequency.max(1.0);
        for (x, y) in samples() {
            let difference = |dx: f64, dy: f64| -> f64 {
                first
                    .iter()
                    .map(|(s, c)| {
                        let (dx, dy) = (s * h * dx, s * h * dy);
                        c * (r.u(x + dx, y + dy) - r.u(x - dx, y - dy)) / (60.0 * h)
                    })
                    .sum()
            };
            let [gx, gy] = r.grad(x, y);
            let errors = [gx - difference(1.0, 0.0), gy - difference(0.0, 1.0)];
            assert!(
                errors.iter().all(|e| e.abs() < 1e-9 * r.load.omega()),
                "({x}, {y}): {errors:?}"
            );
        }
    }
}

#[test]
fn the_boundary_conditions_hold() {
    for r in all() {
        for i in 0..=1000 {
            let s = f64::from(i) / 1000.0;
            let (u, q) = (r.u(s, 0.0), r.flux(s));
            assert!(u <= 1e-12, "u({s}, 0) = {u}");
            assert!(q <= 0.0, "flux({s}) = {q}");
            assert!(
                (u * q).abs() < 1e-11 * r.load.omega(),
                "at {s}: u = {u}, flux = {q}"
            );
            let contact = r.contact_set.iter().any(|[a, b]| (*a..=*b).contains(&s));
            assert_eq!(contact, q < 0.0, "at {s}");
            assert!(contact || u < 0.0, "at {s}");
            assert!(
                (r.grad(s, 0.0)[1] + q).abs() < 1e-10 * r.load.omega(),
                "at {s}"
            );
            assert!(r.u(s, 1.0).abs() < 1e-12, "u({s}, 1) = {}", r.u(s, 1.0));
            for x in [0.0, 1.0] {
                let slope = r.grad(x, s)[0];
                assert!(slope.abs() < 1e-9, "at ({x}, {s}): {slope}");
            }
        }
    }
}

#[test]
fn the_pressure_vanishes_like_a_square_root() {
    for r in all() {
        let [a, b] = r.contact_set[0];
        // The end that lies inside the side.
        let (end, inward) = if a > 0.0 { (a, 1.0) } else { (b, -1.0) };
        let near = r.flux(end + inward * 1e-6);
        let nearer = r.flux(end + inward * 1e-8);
        assert!((near / nearer - 10.0).abs() < 1e-2, "{near} {nearer}");
    }
}

#[test]
fn energy_and_norm_agree_with_a_quadrature() {
    for r in [
        Reference::one_zone(DEFAULT_RESOLUTION),
        Reference::zones(1, DEFAULT_RESOLUTION),
    ] {
        let r = r.unwrap();
        let (across, up) = (graded_across(&r, 6), graded(0.0, 1.0, 6));
        let (mut work, mut square) = (0.0, 0.0);
        for &(x, wx) in &across {
            for &(y, wy) in &up {
                let u = r.u(x, y);
                work += wx * wy * r.f(x) * u;
                square += wx * wy * u * u;
            }
        }
        assert!(
            (work / r.grad_norm_sq - 1.0).abs() < 1e-10,
            "{work} {}",
            r.grad_norm_sq
        );
        assert!(
            (square.sqrt() / r.l2_norm - 1.0).abs() < 1e-10,
            "{square} {}",
            r.l2_norm
        );
    }
}

#[test]
fn the_dirichlet_integral_agrees_with_a_quadrature() {
    for r in [
        Reference::one_zone(DEFAULT_RESOLUTION),
        Reference::zones(1, DEFAULT_RESOLUTION),
    ] {
        let r = r.unwrap();
        let (across, up) = (graded_across(&r, 5), graded(0.0, 1.0, 5));
        let mut sum = 0.0;
        for &(x, wx) in &across {
            for &(y, wy) in &up {
                let [gx, gy] = r.grad(x, y);
                sum += wx * wy * (gx * gx + gy * gy);
            }
        }
        assert!(
            (sum / r.grad_norm_sq - 1.0).abs() < 1e-7,
            "{sum} {}",
            r.grad_norm_sq
        );
    }
}

#[test]
fn the_fluxes_balance() {
    for r in all() {
        let rule = graded_across(&r, 12);
        let integral = |g: &dyn Fn(f64) -> f64| rule.iter().map(|&(x, w)| w * g(x)).sum::<f64>();
        let contact = integral(&|x| r.flux(x));
        let far = integral(&|x| r.grad(x, 1.0)[1]);
        let load = integral(&|x| r.f(x));
        assert!(
            (contact - r.contact_flux).abs() < 1e-11,
            "{contact} {}",
            r.contact_flux
        );
        assert!(
            (load + contact + far).abs() < 1e-9,
            "{load} {contact} {far}"
        );
    }
}

/// Contact half-width a and ‖∇u‖² of 6.2 if the load's reflection at y = 1 acted on its own mode only.
fn zones_closed_form(n: f64) -> (f64, f64) {
    let omega = TAU * n;
    let mut s: f64 = 0.1 / n;
    for _ in 0..100 {
        s -= (omega * s - 1.0 + s - s * s.ln()) / (omega - s.ln());
    }
    let half_width = 2.0 / omega * s.sqrt().asin();
    let tanh = (0.5 * omega).tanh();
    let energy = 0.5
        * omega
        * omega
        * (tanh * tanh * omega.tanh() * (1.0 - s).powi(2) / omega + 1.0 - 2.0 * tanh / omega);
    (half_width, energy)
}

#[test]
fn many_zones_are_the_closed_form_but_for_the_reflection() {
    for n in [1, 2, 3, 5, 40] {
        let r = Reference::zones(n, DEFAULT_RESOLUTION).unwrap();
        let (half_width, energy) = zones_closed_form(f64::from(n));
        let reflection = (-4.0 * PI * f64::from(n)).exp();
        let width_error = (r.contact_set[0][1] / half_width - 1.0).abs();
        let energy_error = (r.grad_norm_sq / energy - 1.0).abs();
        assert!(
            width_error < 2.0 * reflection + 1e-13,
            "N = {n}: {width_error:.2e} {reflection:.2e}"
        );
        assert!(
            energy_error < 2.0 * reflection + 1e-13,
            "N = {n}: {energy_error:.2e} {reflection:.2e}"
        );
        assert_eq!(r.contact_set.len(), n as usize + 1);
    }
}

#[test]
fn what_cannot_be_computed_is_refused() {
    assert!(matches!(Reference::zones(0, 48), Err(Error::Usage { .. })));
    for resolution in [0, 7, 8, 1025, usize::MAX] {
        assert!(
            matches!(Reference::one_zone(resolution), Err(Error::Solver { .. })),
            "{resolution}"
        );
    }
    let r = Reference::zones(2, 48).unwrap();
    for (x, y) in [
        (-0.1, 0.5),
        (0.5, 1.1),
        (f64::NAN, 0.5),
        (0.5, f64::INFINITY),
    ] {
        assert!(r.u(x, y).is_nan());
        assert!(r.grad(x, y)[0].is_nan());
    }
    assert!(r.flux(2.0).is_nan());
}

#[test]
fn away_from_both_sides_only_the_mean_of_the_pressure_is_felt() {
    let r = Reference::zones(40, DEFAULT_RESOLUTION).unwrap();
    for (x, y) in samples().filter(|(_, y)| (0.2..0.8).contains(y)) {
        let expected = (r.load.omega() * x).cos() + r.contact_flux * (1.0 - y);
        assert!((r.u(x, y) - expected).abs() < 1e-12, "({x}, {y})");
        assert!(
            (r.grad(x, y)[1] + r.contact_flux).abs() < 1e-11,
            "({x}, {y})"
        );
    }
}

#[test]
fn a_million_zones_stay_finite() {
    for n in [1000, 1_000_000] {
        let r = Reference::zones(n, DEFAULT_RESOLUTION).unwrap();
        for (x, y) in samples() {
            assert!(r.u(x, y).is_finite() && r.grad(x, y)[1].is_finite() && r.flux(x).is_finite());
        }
        let (_, energy) = zones_closed_form(f64::from(n));
        assert!((r.grad_norm_sq / energy - 1.0).abs() < 1e-12);
    }
}
