//! What problems leave open is removed if requested, nothing else is, and it is named if not requested.

use super::*;
use faceoff_mesh::CellKind;
use faceoff_mesh::field::{ResultField, Results};

/// n × n squares cut into triangles, `bodies` of them side by side with gaps; cells have separate points when `broken`.
fn squares(n: usize, bodies: usize, broken: bool) -> Results {
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    for body in 0..bodies {
        let first = points.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                let [x, y] = [i, j].map(|k| k as f64 / n as f64);
                // Bent, so that no mean is a mean of nodal values.
                points.push([
                    x * (0.7 + 0.3 * x) + 2.0 * body as f64,
                    y + 0.2 * x * x,
                    0.0,
                ]);
            }
        }
        for j in 0..n {
            for i in 0..n {
                let k = first + (j * (n + 1) + i) as u32;
                let up = k + n as u32 + 1;
                cells.extend([k, k + 1, up + 1, k, up + 1, up]);
            }
        }
    }
    if broken {
        points = cells.iter().map(|p| points[*p as usize]).collect();
        cells = (0..cells.len() as u32).collect();
    }
    Results {
        source: "squares".into(),
        space: 2,
        kinds: vec![(CellKind::Triangle, cells.len() / 3)],
        points: points.into(),
        width: 3,
        cells: cells.into(),
        ..Results::default()
    }
}

fn with(
    mesh: &Results,
    source: &str,
    components: usize,
    value: impl Fn(&[f64; 3]) -> Vec<f64>,
) -> Results {
    let field = ResultField {
        name: "u".into(),
        components,
        values: mesh.points.iter().flat_map(value).collect(),
        rest: None,
        at: None,
        scaled_by: None,
        single: false,
    };
    Results {
        source: source.into(),
        on_points: vec![field],
        ..mesh.clone()
    }
}

fn compared(a: &Results, b: &Results, up_to: Option<UpTo>) -> ComparedField {
    let settings = Settings {
        up_to: vec![("u".to_owned(), up_to.into_iter().collect())],
        ..Settings::default()
    };
    compare_results(a, b, &settings).unwrap().fields[0].clone()
}

/// If it is declared open, the results agree, and this was removed; if not, the verdict stays and the same is reported.
fn is_open(a: &Results, b: &Results, up_to: UpTo) -> Removed {
    let plain = compared(a, b, None);
    assert_eq!(plain.field.verdict, Verdict::Disagree, "{up_to:?}");
    let told = plain.equal_after.into_iter().next();
    let told = told.unwrap_or_else(|| panic!("{up_to:?} is not told"));
    assert_eq!(told.up_to, up_to);
    let asked = compared(a, b, Some(up_to));
    assert_eq!(asked.field.verdict, Verdict::Agree, "{asked:?}");
    let removed = asked.removed[0].clone();
    assert_eq!(removed, told);
    removed
}

fn smooth(x: &[f64; 3]) -> f64 {
    (3.0 * x[0]).sin() * (1.0 + x[1]).ln() + x[0]
}

#[test]
fn constants_differ_by_connected_part() {
    let mesh = squares(6, 2, false);
    let a = with(&mesh, "a", 1, |x| vec![smooth(x) + 40.0]);
    let b = with(&mesh, "b", 1, |x| {
        vec![smooth(x) - if x[0] < 1.5 { 0.342 } else { -2.0 }]
    });
    let removed = is_open(&a, &b, UpTo::Constant);
    let sizes: Vec<f64> = removed.parts.iter().map(|part| part.size).collect();
    assert!(
        (sizes[0] - 40.342).abs() < 1e-12 && (sizes[1] - 38.0).abs() < 1e-12,
        "{sizes:?}"
    );
    assert_eq!(removed.over, Over::Cells);
    assert_eq!(
        removed.words(["a", "b"]),
        "adding 40.34 to b on one of 2 connected parts"
    );
    // The mean is an integral: on the bent square it differs from that of the values. Its area is 1.
    assert!((removed.parts[0].measure - 1.0).abs() < 1e-12);
    // A difference that is not a constant, however small relative to the constant, is judged on the scale of the remaining field.
    let wrong = with(&mesh, "b", 1, |x| vec![smooth(x) - 0.342 + 1e-7 * x[1]]);
    let found = compared(&a, &wrong, Some(UpTo::Constant));
    assert_eq!(found.field.verdict, Verdict::Disagree);
    assert!(
        found.scale.unwrap() < 4.0,
        "the constant is part of no scale"
    );
}

#[test]
fn constants_that_are_all_there_is_leave_rounding() {
    let mesh = squares(3, 1, false);
    let [a, b] = [5.1, -7.3].map(|c| with(&mesh, "of", 1, move |_| vec![c]));
    is_open(&a, &b, UpTo::Constant);
}

#[test]
fn meshes_may_be_others() {
    let of = |n, c| {
        with(&squares(n, 1, false), "of", 1, move |x| {
            vec![2.0 * x[0] - x[1] + c]
        })
    };
    // The bent side is a different polygon on each, except for the strip between them.
    let straight = |n: usize, c: f64| {
        let mut side = of(n, c);
        side.points.to_mut().iter_mut().zip(0..).for_each(|(p, k)| {
            *p = [
                (k % (n + 1)) as f64 / n as f64,
                (k / (n + 1)) as f64 / n as f64,
                0.0,
            ];
        });
        let values = side.points.iter().map(|x| 2.0 * x[0] - x[1] + c).collect();
        side.on_points[0].values = values;
        side
    };
    let (a, b) = (straight(4, 0.0), straight(7, 3.25));
    let removed = is_open(&a, &b, UpTo::Constant);
    assert_eq!(removed.words(["a", "b"]), "adding -3.25 to b");
    let mut minus = straight(7, 0.0);
    minus.on_points[0]
        .values
        .to_mut()
        .iter_mut()
        .for_each(|v| *v = -*v);
    assert_eq!(
        is_open(&a, &minus, UpTo::Sign).words(["a", "b"]),
        "changing the sign of b"
    );
}

#[test]
fn signs_factors_and_phases() {
    let mesh = squares(5, 1, false);
    let a = with(&mesh, "a", 1, |x| vec![smooth(x)]);
    let times = |f: f64| with(&mesh, "b", 1, move |x| vec![f * smooth(x)]);
    assert_eq!(
        is_open(&a, &times(-1.0), UpTo::Sign).parts[0].factor,
        Some([-1.0, 0.0])
    );
    let removed = is_open(&a, &times(-0.25), UpTo::Scale);
    assert!((removed.parts[0].factor.unwrap()[0] + 4.0).abs() < 1e-12);
    assert_eq!(
        compared(&a, &times(2.0), Some(UpTo::Sign)).field.verdict,
        Verdict::Disagree
    );
    // A zero field stays a zero field.
    for [x, y] in [[1.0, 0.0], [0.0, 1.0]] {
        let found = compared(&times(x), &times(y), Some(UpTo::Scale));
        assert_eq!(found.field.verdict, Verdict::Disagree);
    }
    let wave = |turn: f64| {
        with(&mesh, "wave", 2, move |x| {
            let phase = 3.0 * x[0] + turn;
            vec![(1.0 + x[1]) * phase.cos(), (1.0 + x[1]) * phase.sin()]
        })
    };
    let removed = is_open(&wave(0.5), &wave(0.0), UpTo::Phase);
    assert!((removed.parts[0].factor.unwrap()[1] - 0.5_f64.sin()).abs() < 1e-12);
    let found = compared(&a, &times(-1.0), Some(UpTo::Phase));
    assert_eq!(found.field.verdict, Verdict::Disagree);
    assert!(found.field.reason.unwrap().contains("complex numbers"));
}

#[test]
fn a_sign_and_a_constant_are_found_together() {
    let mesh = squares(5, 1, false);
    let a = with(&mesh, "a", 1, |x| vec![smooth(x)]);
    let b = with(&mesh, "b", 1, |x| vec![0.5 - smooth(x)]);
    let told = compared(&a, &b, None).equal_after;
    assert_eq!(
        removed_words(&told, ["a", "b"]),
        "changing the sign of b and adding 0.5 to b"
    );
}

#[test]
fn rigid_motions_are_no_strain() {
    let mesh = squares(5, 2, false);
    let moved = |x: &[f64; 3], c: [f64; 2], spin: f64, strain: f64| {
        let u = [smooth(x), 0.3 * x[0] * x[1]];
        vec![
            u[0] + c[0] - spin * x[1] + strain * x[0],
            u[1] + c[1] + spin * x[0],
        ]
    };
    let a = with(&mesh, "a", 2, |x| moved(x, [0.0; 2], 0.0, 0.0));
    let b = with(&mesh, "b", 2, |x| match x[0] < 1.5 {
        true => moved(x, [0.5, -1.0], 0.25, 0.0),
        false => moved(x, [0.0, 3.0], -0.5, 0.0),
    });
    let removed = is_open(&a, &b, UpTo::Rigid);
    let spin = |k: usize| removed.parts[k].of_a[2] - removed.parts[k].of_b[2];
    assert!((spin(0) + 0.25).abs() < 1e-12 && (spin(1) - 0.5).abs() < 1e-12);
    // A strain of a millionth is caught.
    let strained = with(&mesh, "b", 2, |x| moved(x, [0.5, -1.0], 0.25, 1e-6));
    assert_eq!(
        compared(&a, &strained, Some(UpTo::Rigid)).field.verdict,
        Verdict::Disagree
    );
    let scalar = with(&mesh, "s", 1, |x| vec![smooth(x)]);
    let reason = compared(&scalar, &scalar, Some(UpTo::Rigid))
        .field
        .reason
        .unwrap();
    assert!(reason.contains("1 components"), "{reason}");
}

#[test]
fn gradients_of_linear_functions_are_free_and_curls_are_not() {
    let mesh = squares(4, 1, true);
    // φ = x² interpolated: its gradient is constant on each cell.
    let gradient = |cell: &[[f64; 3]]| {
        let [p, q, r] = [cell[0], cell[1], cell[2]];
        let phi = |x: &[f64; 3]| x[0] * x[0] + 0.5 * x[1] * x[0];
        let (e, f) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let det = e[0] * f[1] - e[1] * f[0];
        let (d, g) = (phi(&q) - phi(&p), phi(&r) - phi(&p));
        [(d * f[1] - g * e[1]) / det, (g * e[0] - d * f[0]) / det]
    };
    let of = |share: f64, curl: f64| {
        let mut side = with(&mesh, "of", 2, |x| {
            vec![x[1] * x[1] - curl * x[1], x[0] * x[1] + curl * x[0]]
        });
        let added = mesh
            .points
            .chunks_exact(3)
            .flat_map(|cell| [gradient(cell); 3]);
        let added: Vec<f64> = added.flatten().map(|g| share * g).collect();
        let values = side.on_points[0].values.to_mut();
        values
            .iter_mut()
            .zip(added)
            .for_each(|(value, added)| *value += added);
        side
    };
    let asked = |b: &Results| compared(&of(0.0, 0.0), b, Some(UpTo::Gradient));
    let found = asked(&of(0.7, 0.0));
    assert_eq!(found.field.verdict, Verdict::Agree, "{found:?}");
    assert!(found.removed[0].parts[0].size > 0.1);
    assert_eq!(asked(&of(0.7, 1e-5)).field.verdict, Verdict::Disagree);
    // Where it was not asked for, it is reported, and the verdict stays.
    let plain = |b: &Results| compared(&of(0.0, 0.0), b, None);
    let found = plain(&of(0.7, 0.0));
    assert_eq!(found.field.verdict, Verdict::Disagree);
    assert_eq!(found.equal_after[0].up_to, UpTo::Gradient, "{found:?}");
    assert!(plain(&of(0.7, 1e-5)).equal_after.is_empty());
    let shared = with(&squares(4, 1, false), "of", 2, |x| vec![x[1], x[0]]);
    let reason = compared(&shared, &shared, Some(UpTo::Gradient))
        .field
        .reason
        .unwrap();
    assert!(reason.contains("jump"), "{reason}");
}

#[test]
fn dirichlet_values_leave_no_constant_open() {
    let mesh = squares(6, 1, false);
    let bubble = |x: &[f64; 3]| {
        let s = (-0.7 + (0.49 + 1.2 * x[0]).sqrt()) / 0.6;
        let t = x[1] - 0.2 * s * s;
        s * (1.0 - s) * t * (1.0 - t)
    };
    let of = |f: f64| with(&mesh, "of", 1, move |x| vec![f * bubble(x)]);
    let found = compared(&of(1.0), &of(1.01), Some(UpTo::Constant));
    assert_eq!(found.field.verdict, Verdict::Disagree);
    let reason = found.field.reason.unwrap();
    assert!(
        reason.contains("the same values at 24 of 49 points"),
        "{reason}"
    );
    // Not even if a wide tolerance accepts it.
    let settings = Settings {
        up_to: vec![("u".into(), vec![UpTo::Constant])],
        tolerances: Tolerances {
            of_all: Tolerance {
                rtol: 0.1,
                atol: 0.0,
            },
            ..Tolerances::default()
        },
        ..Settings::default()
    };
    let comparison = compare_results(&of(1.0), &of(1.01), &settings).unwrap();
    assert_eq!(comparison.verdict, Verdict::Undetermined);
}

#[test]
fn errors_against_a_formula_are_up_to_the_same() {
    let mesh = squares(24, 1, false);
    let exact = |at: [f64; 3], _: usize| (smooth(&at), [0.0; 3]);
    let error = |c: f64, f: f64, up_to: UpTo| {
        let side = with(&mesh, "of", 1, move |x| vec![f * smooth(x) + c]);
        error_up_to(&side, "u", 1, &exact, &[up_to]).unwrap()
    };
    let plain = error_against(&with(&mesh, "of", 1, |x| vec![smooth(x)]), "u", 1, &exact).unwrap();
    let (norms, removed) = error(7.0, 1.0, UpTo::Constant);
    // The interpolant has an error that is nearly, but not quite, orthogonal to constants.
    assert!(
        norms.l2 <= plain.l2 && norms.l2 > 0.1 * plain.l2,
        "{norms:?} {plain:?}"
    );
    assert!((removed[0].parts[0].size - 7.0).abs() < 0.01);
    assert!(norms.l2_scale < plain.l2_scale);
    let (norms, _) = error(0.0, -1.0, UpTo::Sign);
    assert!((norms.l2 - plain.l2).abs() < 1e-12);
    let (norms, _) = error(0.0, 3.0, UpTo::Scale);
    assert!(norms.l2 <= plain.l2);
    let (wrong, _) = error(0.0, 3.0, UpTo::Constant);
    assert!(wrong.l2 > 10.0 * plain.l2);
}

#[test]
fn what_is_not_finite_is_no_pass_whatever_is_open() {
    let mesh = squares(3, 1, false);
    let a = with(&mesh, "a", 2, |x| vec![smooth(x), x[1]]);
    for bad in [f64::NAN, f64::INFINITY] {
        let mut b = a.clone();
        b.on_points[0].values.to_mut()[5] = bad;
        for up_to in UpTo::ALL {
            for (a, b) in [(&a, &b), (&b, &b.clone())] {
                let found = compared(a, b, Some(up_to));
                assert_ne!(found.field.verdict, Verdict::Agree, "{up_to:?} {bad}");
            }
        }
    }
}

#[test]
fn a_name_that_no_field_has_is_refused() {
    let a = with(&squares(2, 1, false), "a", 1, |x| vec![smooth(x)]);
    let settings = Settings {
        up_to: vec![("p".into(), vec![UpTo::Sign])],
        ..Settings::default()
    };
    let error = compare_results(&a, &a.clone(), &settings)
        .unwrap_err()
        .to_string();
    assert!(error.contains("neither has the field `p`"), "{error}");
}

#[test]
fn rigid_motions_in_space() {
    let grid = |k: usize| {
        (0..k).flat_map(move |z| (0..k).flat_map(move |y| (0..k).map(move |x| [x, y, z])))
    };
    let points: Vec<[f64; 3]> = grid(4)
        .map(|p| p.map(|k| (k as f64 / 3.0).powf(1.2)))
        .collect();
    let at = |p: [usize; 3]| (p[0] + 4 * p[1] + 16 * p[2]) as u32;
    let paths = [
        [0, 1, 2],
        [0, 2, 1],
        [1, 2, 0],
        [1, 0, 2],
        [2, 0, 1],
        [2, 1, 0],
    ];
    let cells = grid(3).flat_map(|p| {
        paths.iter().flat_map(move |path| {
            let mut x = p;
            let mut cell = vec![at(x)];
            for axis in path {
                x[*axis] += 1;
                cell.push(at(x));
            }
            cell
        })
    });
    let cells: Vec<u32> = cells.collect();
    let mesh = Results {
        source: "cube".into(),
        space: 3,
        kinds: vec![(CellKind::Tetrahedron, cells.len() / 4)],
        points: points.into(),
        width: 4,
        cells: cells.into(),
        ..Results::default()
    };
    let spin = [0.3, -0.2, 0.7];
    let of = |share: f64, strain: f64| {
        with(&mesh, "of", 3, move |x| {
            let turned = [
                spin[1] * x[2] - spin[2] * x[1],
                spin[2] * x[0] - spin[0] * x[2],
                spin[0] * x[1] - spin[1] * x[0],
            ];
            (0..3)
                .map(|c| smooth(x) * c as f64 + share * (turned[c] + 2.0) + strain * x[(c + 1) % 3])
                .collect()
        })
    };
    let removed = is_open(&of(1.0, 0.0), &of(0.0, 0.0), UpTo::Rigid);
    for (k, spin) in spin.iter().enumerate() {
        let found = removed.parts[0].of_a[3 + k] - removed.parts[0].of_b[3 + k];
        assert!((found - spin).abs() < 1e-12, "{found} for {spin}");
    }
    let strained = compared(&of(1.0, 1e-6), &of(0.0, 0.0), Some(UpTo::Rigid));
    assert_eq!(strained.field.verdict, Verdict::Disagree);
}
