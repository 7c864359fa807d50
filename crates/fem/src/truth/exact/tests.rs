use super::*;

/// Fractions in (0, 1)³ without pattern.
fn fractions(count: u32) -> impl Iterator<Item = Point> {
    (1..=count).map(|i| {
        [0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902]
            .map(|g| (g * f64::from(i)).fract())
    })
}

fn place(e: &Benchmark, fraction: Point, margin: f64) -> Point {
    std::array::from_fn(|k| {
        let (low, high) = (e.lower[k], e.upper[k]);
        if high > low {
            low + margin + (high - low - 2.0 * margin) * fraction[k]
        } else {
            0.0
        }
    })
}

fn shifted(mut p: Point, axis: usize, by: f64) -> Point {
    p[axis] += by;
    p
}

/// Points of a side.
fn on_side(e: &Benchmark, side: &Side) -> Vec<Point> {
    fractions(400)
        .map(|fraction| {
            let mut p = place(e, fraction, 0.0);
            if let Some([low, high]) = side.range {
                p[0] = low + (high - low) * fraction[0];
            }
            p[side.axis] = if side.upper {
                e.upper[side.axis]
            } else {
                e.lower[side.axis]
            };
            p
        })
        .collect()
}

/// The sixth-order stencils of the second and first derivative, and the one-sided first.
const SECOND: [f64; 7] = [2.0, -27.0, 270.0, -490.0, 270.0, -27.0, 2.0];
const FIRST: [f64; 7] = [-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0];
const ONE_SIDED: [f64; 7] = [-147.0, 360.0, -450.0, 400.0, -225.0, 72.0, -10.0];

fn apply(stencil: [f64; 7], divisor: f64, u: impl Fn(f64) -> f64, first: f64, h: f64) -> f64 {
    let sum: f64 = stencil
        .iter()
        .enumerate()
        .map(|(i, c)| c * u((first + i as f64) * h))
        .sum();
    sum / divisor
}

/// All errors small, or all but those at the breaks of a piecewise solution.
fn assert_small(e: &Benchmark, what: &str, mut errors: Vec<f64>, tolerance: f64) {
    errors.sort_by(f64::total_cmp);
    let share = if e.solution.is_piecewise() { 0.93 } else { 1.0 };
    let index = ((errors.len() as f64 * share) as usize).clamp(1, errors.len()) - 1;
    assert!(
        errors[index] < tolerance,
        "{}: {what} {:e}",
        e.name,
        errors[index]
    );
}

#[test]
fn the_equation_holds_in_the_interior() {
    let h = 5e-4;
    for e in catalogue() {
        let points: Vec<Point> = fractions(500).map(|q| place(&e, q, 0.03)).collect();
        let scale = points
            .iter()
            .map(|&p| e.f(p).abs().max(e.u(p).abs()))
            .fold(1.0, f64::max);
        let errors = points
            .iter()
            .map(|&p| {
                let laplacian: f64 = (0..e.dimension)
                    .map(|k| apply(SECOND, 180.0 * h * h, |s| e.u(shifted(p, k, s)), -3.0, h))
                    .sum();
                (laplacian + e.f(p)).abs() / scale
            })
            .collect();
        assert_small(&e, "-Δu - f", errors, 2e-6);
    }
}

#[test]
fn the_gradient_is_that_of_u() {
    let h = 5e-4;
    for e in catalogue() {
        for k in 0..e.dimension {
            let errors = fractions(300)
                .map(|q| {
                    let p = place(&e, q, 0.03);
                    let slope = apply(FIRST, 60.0 * h, |s| e.u(shifted(p, k, s)), -3.0, h);
                    (slope - e.grad(p)[k]).abs()
                })
                .collect();
            assert_small(&e, "∇u", errors, 1e-6);
        }
    }
}

#[test]
fn the_contact_conditions_hold() {
    for e in catalogue() {
        for side in e.sides.iter().filter(|s| s.kind == Kind::Contact) {
            let inward = if side.upper { -1.0 } else { 1.0 };
            let h = 2e-5;
            for p in on_side(&e, side) {
                let (u, q) = (e.u(p), e.flux(side, p));
                assert!(u <= 1e-14, "{}: u({p:?}) = {u}", e.name);
                assert!(q <= 1e-13, "{}: flux({p:?}) = {q}", e.name);
                assert!(
                    (u * q).abs() < 1e-13,
                    "{}: at {p:?} u = {u}, flux = {q}",
                    e.name
                );
                // The same only from values of u, coarser: the transitions are singular.
                let inside = |s: f64| e.u(shifted(p, side.axis, inward * s));
                let slope = -apply(ONE_SIDED, 60.0 * h, inside, 0.0, h);
                assert!(
                    (slope - q).abs() < 2e-2 * (1.0 + q.abs()),
                    "{}: {p:?} {slope} {q}",
                    e.name
                );
            }
        }
    }
}

#[test]
fn the_data_are_those_of_the_sides() {
    for e in catalogue() {
        for side in &e.sides {
            for p in on_side(&e, side) {
                match side.kind {
                    Kind::Neumann => {
                        let q = e.flux(side, p);
                        let scale = e.grad(p).iter().fold(1.0, |a: f64, g| a.max(g.abs()));
                        assert!(
                            (q - e.t(p)).abs() < 1e-13 * scale,
                            "{}: t({p:?}) = {q}",
                            e.name
                        );
                    }
                    Kind::Dirichlet => {
                        let stated = e.text.g == "0";
                        assert!(
                            !stated || e.g(p).abs() < 1e-13,
                            "{}: g({p:?}) = {}",
                            e.name,
                            e.g(p)
                        );
                    }
                    Kind::Contact => {}
                }
            }
        }
    }
}

#[test]
fn the_flux_points_outward() {
    let h = 1e-3;
    for e in catalogue() {
        // Smooth up to every side.
        if !["two-sides-contact", "two-sides-free", "contact-everywhere"].contains(&e.name) {
            continue;
        }
        for side in &e.sides {
            let inward = if side.upper { -1.0 } else { 1.0 };
            for p in on_side(&e, side) {
                let inside = |s: f64| e.u(shifted(p, side.axis, inward * s));
                let slope = -apply(ONE_SIDED, 60.0 * h, inside, 0.0, h);
                assert!(
                    (slope - e.flux(side, p)).abs() < 1e-9,
                    "{}: {p:?} {slope}",
                    e.name
                );
            }
        }
    }
}

#[test]
fn solutions_are_finite_everywhere_on_the_closed_box() {
    for e in catalogue() {
        for side in &e.sides {
            for p in on_side(&e, side) {
                assert!(
                    e.u(p).is_finite() && e.f(p).is_finite(),
                    "{} at {p:?}",
                    e.name
                );
                assert!(
                    e.grad(p).iter().all(|g| g.is_finite()),
                    "{} at {p:?}",
                    e.name
                );
            }
        }
    }
}

#[test]
fn contact_and_free_parts_are_as_the_names_say() {
    // Share of the contact sides that is in contact (flux < 0), free (u < 0), and neither.
    for (name, contact, grazing) in [
        ("transition-1.5", 0.45, 0.0),
        ("gap", 0.55, 0.0),
        ("hertz", 0.45, 0.0),
        ("periodic-1", 0.6, 0.0),
        ("manufactured-2", 0.5, 0.0),
        ("manufactured-grazing", 0.369, 0.262),
        ("contact-everywhere", 1.0, 0.0),
        ("contact-nowhere", 0.0, 0.0),
        ("grazing-everywhere", 0.0, 1.0),
        ("two-sides-contact", 1.0, 0.0),
        ("two-sides-free", 0.0, 0.0),
        ("grazing-touch", 0.0, 0.0),
        ("grazing-lift", 1.0, 0.0),
        ("dirichlet-meets-contact", 0.0, 0.0),
        ("hertz-sphere", 0.159, 0.0),
        ("checkerboard", 0.5, 0.0),
    ] {
        let e = catalogue().into_iter().find(|e| e.name == name).unwrap();
        let (mut in_contact, mut in_neither, mut all) = (0, 0, 0);
        for side in e.sides.iter().filter(|s| s.kind == Kind::Contact) {
            for p in on_side(&e, side) {
                let (u, q) = (e.u(p), e.flux(side, p));
                all += 1;
                in_contact += i32::from(q < -1e-12);
                in_neither += i32::from(q >= -1e-12 && u >= -1e-12);
            }
        }
        let share = |count: i32| f64::from(count) / f64::from(all);
        assert!(
            (share(in_contact) - contact).abs() < 0.03,
            "{name}: {}",
            share(in_contact)
        );
        assert!(
            (share(in_neither) - grazing).abs() < 0.03,
            "{name}: {}",
            share(in_neither)
        );
    }
}

#[test]
fn the_closed_form_of_many_zones_is_the_reference() {
    for n in [1, 3, 5, 20] {
        let r = crate::truth::Reference::zones(n, crate::truth::DEFAULT_RESOLUTION).unwrap();
        let exact = ManyZones::new(n);
        // What y = 1 reflects, and rounding.
        let tolerance = 3.0 * (-4.0 * std::f64::consts::PI * f64::from(n)).exp() + 1e-12;
        assert!((r.contact_set[0][1] / exact.half_width() - 1.0).abs() < tolerance);
        assert!((r.grad_norm_sq / exact.grad_norm_sq() - 1.0).abs() < tolerance);
        assert!((r.contact_flux / exact.contact_flux() - 1.0).abs() < tolerance);
        for [x, y, _] in fractions(300) {
            let difference = r.u(x, y) - exact.u([x, y, 0.0]);
            assert!(
                difference.abs() < tolerance,
                "N = {n}, ({x}, {y}): {difference:e}"
            );
            let scale = std::f64::consts::TAU * f64::from(n);
            for (a, b) in r.grad(x, y).iter().zip(exact.grad([x, y, 0.0])) {
                assert!(
                    (a - b).abs() < 10.0 * scale * tolerance,
                    "N = {n}, ({x}, {y}): {a} {b}"
                );
            }
        }
    }
}

/// With hundreds of zones too, up to y = 1.
#[test]
fn any_number_of_zones_is_in_range() {
    for n in [1, 20, 200, 1000] {
        let exact = ManyZones::new(n);
        let scale = std::f64::consts::TAU * f64::from(n);
        for [x, y, _] in fractions(200) {
            // Where u does something, and everywhere.
            for y in [y / scale, y, 1.0] {
                let point = [x, y, 0.0];
                assert!(exact.u(point).is_finite(), "N = {n}, ({x}, {y})");
                let step = 1e-6 / scale;
                let along = |axis: usize| {
                    let at = |sign: f64| {
                        let mut moved = point;
                        moved[axis] += sign * step;
                        exact.u(moved)
                    };
                    (at(1.0) - at(-1.0)) / (2.0 * step * scale)
                };
                let grad = exact.grad(point);
                for axis in 0..2 {
                    let apart = (along(axis) - grad[axis] / scale).abs();
                    assert!(apart < 1e-3, "N = {n}, ({x}, {y}), {axis}: {apart:e}");
                }
            }
        }
    }
}

#[test]
fn names_are_unique() {
    let all = catalogue();
    for (i, e) in all.iter().enumerate() {
        assert!(all.iter().skip(i + 1).all(|other| other.name != e.name));
    }
}
