use super::difference::compare as compared;
use super::{Compared, Coordinates, DofTable, Region, Result, Settings, System, Verdict};

fn compare(a: System, b: System, settings: &Settings) -> Result<Compared> {
    compared(&a, &b, settings)
}

/// The stiffness matrix, times κ, and the mass matrix, times c, of P1 on the unit interval, with the loads of f = 1.
fn rod(n: usize, kappa: f64, c: f64, order: &dyn Fn(usize) -> usize) -> System {
    let h = 1.0 / n as f64;
    let mut entries = Vec::new();
    let mut load = vec![0.0; n + 1];
    let mut at = vec![[0.0; 3]; n + 1];
    for cell in 0..n {
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let sign = if i == j { 1.0 } else { -1.0 };
            let mass = if i == j { h / 3.0 } else { h / 6.0 };
            entries.push((
                order(cell + i) as u32,
                order(cell + j) as u32,
                sign * kappa / h + c * mass,
            ));
        }
        (0..2).for_each(|i| load[order(cell + i)] += h / 2.0);
    }
    (0..=n).for_each(|k| at[order(k)][0] = k as f64 * h);
    let dofs = DofTable {
        names: vec!["u".into()],
        field: vec![0; n + 1],
        direction: vec![[1.0, 0.0, 0.0]; n + 1],
        at,
        values: None,
    };
    let matrix = Coordinates {
        rows: n + 1,
        columns: n + 1,
        entries,
    };
    System::new("rod", matrix, load, dofs).unwrap()
}

fn same(k: usize) -> usize {
    k
}

/// Edits the entries of a system.
fn edited(system: &System, edit: impl Fn(usize, usize, f64) -> f64) -> System {
    let count = system.load.len();
    let rows = (0..count).flat_map(|i| system.matrix.row(i).map(move |(j, a)| (i, j, a)));
    let entries = rows
        .map(|(i, j, a)| (i as u32, j as u32, edit(i, j, a)))
        .collect();
    let matrix = Coordinates {
        rows: count,
        columns: count,
        entries,
    };
    System::new("edited", matrix, system.load.clone(), system.dofs.clone()).unwrap()
}

fn settings() -> Settings {
    Settings {
        volume: Some(1.0),
        ..Settings::default()
    }
}

#[test]
fn the_order_of_rows_does_not_matter() {
    let found = compare(
        rod(8, 2.0, 0.0, &same),
        rod(8, 2.0, 0.0, &|k| 8 - k),
        &settings(),
    )
    .unwrap();
    assert_eq!(found.verdict, Verdict::Agree);
    assert!(found.matrix[0].largest < 1e-15, "{found:?}");
    assert_eq!(found.energies[0].values, [2.0, 2.0]);
    assert!(found.kernels[0].left.iter().all(|left| *left < 1e-14));
}

#[test]
fn a_factor_and_a_term_on_top_are_told_apart() {
    let factor = compare(
        rod(8, 2.0, 0.0, &same),
        rod(8, 2.02, 0.0, &|k| 8 - k),
        &settings(),
    )
    .unwrap();
    assert!((factor.matrix[0].factor.unwrap() - 1.01).abs() < 1e-14);
    assert!(factor.matrix[0].differs.everywhere && factor.matrix[0].symmetric);
    assert_eq!(factor.load[0].differs.rows, 0);
    let mass = compare(
        rod(8, 2.0, 0.0, &same),
        rod(8, 2.0, 0.5, &same),
        &settings(),
    )
    .unwrap();
    assert_eq!(mass.matrix[0].factor, None);
    let constants = &mass.kernels[0].left;
    assert!(constants[0] < 1e-14 && constants[1] > 1e-4, "{constants:?}");
    let energy = mass
        .energies
        .iter()
        .find(|e| e.name == "the energy of constants")
        .unwrap();
    assert!((energy.values[1] - 0.5).abs() < 1e-13);
}

/// Rows of the identity, a penalty, and elimination state the same equations.
#[test]
fn constraints_are_equal_however_they_are_kept() {
    let free = rod(8, 1.0, 1.0, &same);
    let mut identity = edited(&free, |i, j, a| {
        if i == 0 {
            f64::from(u8::from(j == 0))
        } else {
            a
        }
    });
    identity.load[0] = 3.0;
    let mut penalty = edited(&free, |i, j, a| if i == 0 && j == 0 { 1e30 } else { a });
    penalty.load[0] = 3e30;
    let mut symmetric = edited(&identity, |i, j, a| if i > 0 && j == 0 { 0.0 } else { a });
    symmetric.load[1] -= 3.0 * free.matrix.entry(1, 0);
    let entries = (1..9).flat_map(|i| {
        free.matrix
            .row(i)
            .filter(|(j, _)| *j > 0)
            .map(move |(j, a)| (i as u32 - 1, j as u32 - 1, a))
    });
    let rest = DofTable {
        field: vec![0; 8],
        at: free.dofs.at[1..].to_vec(),
        direction: free.dofs.direction[1..].to_vec(),
        ..free.dofs.clone()
    };
    let matrix = Coordinates {
        rows: 8,
        columns: 8,
        entries: entries.collect(),
    };
    let eliminated = System::new("eliminated", matrix, symmetric.load[1..].to_vec(), rest).unwrap();
    let all = [identity, penalty, symmetric, eliminated];
    for a in &all {
        for b in &all {
            let found = compare(a.clone(), b.clone(), &settings()).unwrap();
            assert_eq!(found.verdict, Verdict::Agree, "{found:?}");
        }
    }
    let mut other = all[1].clone();
    other.load[0] *= 2.0;
    let found = compare(all[0].clone(), other, &settings()).unwrap();
    assert_eq!(found.constrained.values, 1);
    assert!((found.constrained.factor.unwrap() - 2.0).abs() < 1e-14);
    // A row that only one of them constrains.
    let found = compare(all[0].clone(), free, &settings()).unwrap();
    assert_eq!(found.constrained.only, [1, 0]);
    assert_eq!(found.verdict, Verdict::Disagree);
}

/// Places are described by one group, or by the fewest that contain all rows together.
#[test]
fn rows_are_told_by_the_groups_that_have_them() {
    let free = rod(8, 1.0, 1.0, &same);
    let held = |rows: &[usize]| {
        edited(&free, |i, j, a| match (rows.contains(&i), i == j) {
            (true, same) => f64::from(u8::from(same)),
            _ => a,
        })
    };
    let region = |name: &str, places: &[f64]| Region {
        name: name.into(),
        places: places.iter().map(|x| [*x, 0.0, 0.0]).collect(),
    };
    let settings = Settings {
        regions: vec![
            region("left", &[0.0]),
            region("right", &[1.0]),
            region("middle", &[0.375, 0.5, 0.625]),
        ],
        ..settings()
    };
    let groups = |rows: &[usize]| {
        let found = compare(held(rows), free.clone(), &settings).unwrap();
        found.constrained.only_where.unwrap().groups
    };
    assert_eq!(groups(&[8]), ["right"]);
    assert_eq!(groups(&[0, 8]), ["left", "right"]);
    assert_eq!(groups(&[0, 1]), [""; 0]);
}

/// Moments with different signs and lengths are the same unknowns.
#[test]
fn signs_and_scalings_of_moments_are_taken_out() {
    let mut a = rod(8, 1.0, 1.0, &same);
    a.dofs.values = Some(vec![0.0; 9]);
    let scale = |k: usize| if k.is_multiple_of(2) { -1.0 } else { 0.25 };
    let mut b = edited(&a, |i, j, v| v * scale(i) * scale(j));
    for k in 0..9 {
        b.load[k] *= scale(k);
        b.dofs.direction[k] = a.dofs.direction[k].map(|d| d / scale(k));
    }
    let found = compare(a.clone(), b.clone(), &settings()).unwrap();
    assert_eq!((found.verdict, found.rescaled), (Verdict::Agree, 9));
    // With a sign that the table does not state they are different equations.
    b.dofs.direction[2] = b.dofs.direction[2].map(|d| -d);
    assert_eq!(
        compare(a, b, &settings()).unwrap().verdict,
        Verdict::Disagree
    );
}

/// A row of the identity states a value in the code's scaling of that dof.
#[test]
fn rows_of_the_identity_are_recognised_in_either_scaling() {
    let mut a = rod(4, 1.0, 0.0, &same);
    a = edited(&a, |i, j, v| match (i, j) {
        (0, 0) => 1.0,
        (0, _) => 0.0,
        _ => v,
    });
    a.load[0] = 3.0;
    let mut b = edited(&a, |i, j, v| {
        if i == 0 {
            v
        } else if j == 0 {
            0.3 * v
        } else {
            v
        }
    });
    b.load[0] = 3.0 / 0.3;
    b.dofs.direction[0] = a.dofs.direction[0].map(|d| d / 0.3);
    for (a, b) in [(&a, &b), (&b, &a)] {
        let found = compare(a.clone(), b.clone(), &settings()).unwrap();
        assert_eq!(
            (found.constrained.both, found.constrained.only),
            (1, [0, 0])
        );
        assert_eq!(found.verdict, Verdict::Agree);
    }
}

#[test]
fn what_cannot_be_matched_is_refused() {
    let a = rod(4, 1.0, 0.0, &same);
    let mut twice = a.clone();
    twice.dofs.at[1] = twice.dofs.at[2];
    let error = compare(a.clone(), twice, &settings())
        .unwrap_err()
        .to_string();
    assert!(error.contains("several partners"), "{error}");
    let mut far = a.clone();
    far.dofs.at[1][0] += 0.01;
    let error = compare(a.clone(), far, &settings())
        .unwrap_err()
        .to_string();
    assert!(error.contains("no partner"), "{error}");
    let mut bubble = a.dofs.clone();
    bubble.direction[3] = [0.0; 3];
    let matrix = Coordinates {
        rows: 5,
        columns: 5,
        entries: vec![],
    };
    let error = System::new("p", matrix, a.load.clone(), bubble)
        .unwrap_err()
        .to_string();
    assert!(error.contains("hierarchical"), "{error}");
}

/// A solver that stopped early leaves a residual in its system, and equal systems leave the same in the other.
#[test]
fn answers_are_put_into_each_other_s_system() {
    let mut a = rod(4, 1.0, 1.0, &same);
    // c u = 1 with c = 1.
    a.dofs.values = Some(vec![1.0; 5]);
    let mut b = a.clone();
    b.dofs.values = Some(vec![1.0, 1.0, 1.1, 1.0, 1.0]);
    let found = compare(a, b, &settings()).unwrap().residuals.unwrap();
    assert!(found.own[0] < 1e-15 && found.other[0] < 1e-15, "{found:?}");
    assert!(found.own[1] > 1e-3 && found.other[1] > 1e-3, "{found:?}");
}

/// NaN equals nothing, so a system must not contain it.
#[test]
fn what_is_not_finite_is_refused() {
    let right = rod(4, 1.0, 0.0, &same);
    let of = |edit: &dyn Fn(&mut Coordinates, &mut Vec<f64>, &mut DofTable)| {
        let rows = (0..5).flat_map(|i| {
            right
                .matrix
                .row(i)
                .map(move |(j, a)| (i as u32, j as u32, a))
        });
        let mut matrix = Coordinates {
            rows: 5,
            columns: 5,
            entries: rows.collect(),
        };
        let (mut load, mut dofs) = (right.load.clone(), right.dofs.clone());
        edit(&mut matrix, &mut load, &mut dofs);
        System::new("edited", matrix, load, dofs)
    };
    assert!(of(&|_, _, _| ()).is_ok());
    assert!(of(&|matrix, _, _| matrix.entries[3].2 = f64::NAN).is_err());
    assert!(of(&|_, load, _| load[1] = f64::INFINITY).is_err());
    assert!(of(&|_, _, dofs| dofs.at[2][0] = f64::NAN).is_err());
    assert!(of(&|_, _, dofs| dofs.values = Some(vec![f64::NAN; 5])).is_err());
}
