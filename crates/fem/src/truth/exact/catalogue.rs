//! The exact solutions that are built in.

use super::{
    Benchmark, CutOff, Elementary, ExactSolution, Extruded, Gap, Hertz, HertzSphere, Kind,
    ManyZones, Monomial, Periodic, Point, Profile, Regularity, Selector, Separated, Side, Text,
};
use Kind::{Contact, Dirichlet, Neumann};

/// Sides left, right, bottom, top of a rectangle.
fn sides_2d(kinds: [Kind; 4]) -> Vec<Side> {
    let places = [(0, false), (0, true), (1, false), (1, true)];
    kinds
        .iter()
        .zip(places)
        .map(|(&kind, (axis, upper))| Side {
            kind,
            axis,
            upper,
            range: None,
        })
        .collect()
}

/// The paper's sides.
const PAPER: [Kind; 4] = [Neumann, Neumann, Contact, Dirichlet];
/// Data prescribed on all sides but the bottom.
const OPEN: [Kind; 4] = [Dirichlet, Dirichlet, Contact, Dirichlet];

fn unit_square(
    name: &'static str,
    purpose: &'static str,
    regularity: Regularity,
    kinds: [Kind; 4],
    solution: impl ExactSolution + 'static,
    text: Text,
) -> Benchmark {
    Benchmark {
        name,
        purpose,
        regularity,
        dimension: 2,
        lower: [0.0; 3],
        upper: [1.0, 1.0, 0.0],
        sides: sides_2d(kinds),
        solution: Box::new(solution),
        text,
    }
}

/// [-1, 1] × [0, 1].
fn wide(
    name: &'static str,
    purpose: &'static str,
    regularity: Regularity,
    solution: impl ExactSolution + 'static,
    text: Text,
) -> Benchmark {
    Benchmark {
        lower: [-1.0, 0.0, 0.0],
        ..unit_square(name, purpose, regularity, OPEN, solution, text)
    }
}

/// In 3D, with `upper` = (1, 1, 1). The kinds are those of x = lower, x = upper, y = lower, …
fn in_3d(
    name: &'static str,
    purpose: &'static str,
    regularity: Regularity,
    lower: Point,
    kinds: [Kind; 6],
    solution: impl ExactSolution + 'static,
    text: Text,
) -> Benchmark {
    let sides = (0..6)
        .map(|i| Side {
            kind: kinds[i],
            axis: i / 2,
            upper: i % 2 == 1,
            range: None,
        })
        .collect();
    Benchmark {
        name,
        purpose,
        regularity,
        dimension: 3,
        lower,
        upper: [1.0; 3],
        sides,
        solution: Box::new(solution),
        text,
    }
}

/// All of them, each with parameters that put its transitions off the lines of usual meshes.
pub fn catalogue() -> Vec<Benchmark> {
    let mut all = Vec::new();
    // r^e has its trace in H^(e+1/2-ε) of a side and itself lies in H^(e+1-ε).
    let general = Regularity::transition(2.5);
    for (name, purpose, exponent) in [
        ("transition-1.5", "one transition as in general", 1.5),
        ("transition-3.5", "one transition, smoother", 3.5),
        ("transition-5.5", "one transition, still smoother", 5.5),
    ] {
        let m = Monomial::transition(exponent, 0.1);
        let regularity = Regularity::transition(exponent + 1.0);
        all.push(wide(name, purpose, regularity, m, m.text()));
    }
    let gap = Gap { a: 0.45 };
    all.push(wide(
        "gap",
        "contact outside a gap, two transitions",
        general,
        gap,
        gap.text(),
    ));
    let hertz = Hertz { a: 0.45 };
    all.push(wide(
        "hertz",
        "contact inside a strip, two transitions",
        general,
        hertz,
        hertz.text(),
    ));
    for (name, n) in [("periodic-1", 1), ("periodic-3", 3)] {
        let periodic = Periodic { a: 0.4, n };
        all.push(unit_square(
            name,
            "periodic zones between Neumann sides",
            general,
            PAPER,
            periodic,
            periodic.text(),
        ));
    }
    for (name, n) in [("many-zones-3", 3), ("many-zones-5", 5)] {
        let zones = ManyZones::new(n);
        all.push(unit_square(
            name,
            "the paper's 6.2 in closed form",
            general,
            PAPER,
            zones,
            zones.text(),
        ));
    }
    for (name, purpose, sobolev, n, profile) in [
        (
            "manufactured-2",
            "homogeneous data, f jumps",
            2.5,
            1,
            Profile::power(2, 2, 0.0),
        ),
        (
            "manufactured-3",
            "homogeneous data, f continuous",
            3.5,
            2,
            Profile::power(3, 3, 0.0),
        ),
        (
            "manufactured-grazing",
            "grazing on sets of positive length",
            2.5,
            1,
            Profile::power(2, 2, 0.4),
        ),
        (
            "manufactured-smooth",
            "a transition of class C^∞",
            f64::INFINITY,
            1,
            Profile::Smooth,
        ),
    ] {
        let selector = Selector::Waves { n };
        let separated = Separated { selector, profile };
        all.push(unit_square(
            name,
            purpose,
            Regularity::transition(sobolev),
            PAPER,
            separated,
            separated.text(),
        ));
    }
    let cut_off = CutOff {
        x0: 0.52,
        radius: 0.45,
    };
    all.push(unit_square(
        "cut-off",
        "r^(3/2) with homogeneous data",
        general,
        PAPER,
        cut_off,
        cut_off.text(),
    ));
    for (name, purpose, kinds, e) in [
        (
            "contact-everywhere",
            "no transition",
            PAPER,
            Elementary::ContactEverywhere,
        ),
        (
            "contact-nowhere",
            "no transition",
            PAPER,
            Elementary::ContactNowhere,
        ),
        (
            "grazing-everywhere",
            "u = 0 and ∂ₙu = 0 on all of Γ_C",
            PAPER,
            Elementary::GrazingEverywhere,
        ),
        (
            "two-sides-contact",
            "two contact sides meet in a corner cell",
            [Contact, Dirichlet, Contact, Dirichlet],
            Elementary::TwoSidesContact,
        ),
        (
            "two-sides-free",
            "two free contact sides meet in a corner cell",
            [Dirichlet, Contact, Contact, Dirichlet],
            Elementary::TwoSidesFree,
        ),
    ] {
        let smooth = Regularity::SMOOTH;
        all.push(unit_square(name, purpose, smooth, kinds, e, e.text()));
    }
    let touch = Monomial::touch();
    all.push(wide(
        "grazing-touch",
        "free, touching in one point",
        Regularity::SMOOTH,
        touch,
        touch.text(),
    ));
    let lift = Monomial::lift();
    all.push(wide(
        "grazing-lift",
        "in contact, without pressure in one point",
        Regularity::SMOOTH,
        lift,
        lift.text(),
    ));
    let meeting = Monomial::meeting();
    let mut mixed = wide(
        "dirichlet-meets-contact",
        "Γ_D and Γ_C share a flat side: outside the theory",
        Regularity::transition(1.5),
        meeting,
        meeting.text(),
    );
    mixed.sides = split_bottom(&mixed.sides);
    all.push(mixed);

    let checker = Separated {
        selector: Selector::Checker,
        profile: Profile::power(2, 2, 0.0),
    };
    let sealed = [Neumann, Neumann, Neumann, Neumann, Contact, Dirichlet];
    let open = [
        Dirichlet, Dirichlet, Dirichlet, Dirichlet, Contact, Dirichlet,
    ];
    all.push(in_3d(
        "checkerboard",
        "homogeneous data, a checkerboard of zones",
        general,
        [0.0; 3],
        sealed,
        checker,
        checker.text(),
    ));
    let corner = [-1.0, -1.0, 0.0];
    let edge = Monomial::transition(1.5, 0.1);
    all.push(in_3d(
        "transition-1.5-3d",
        "r^(3/2) along an edge",
        general,
        corner,
        open,
        Extruded(edge),
        edge.text().extruded(),
    ));
    let sphere = HertzSphere { a: 0.45 };
    all.push(in_3d(
        "hertz-sphere",
        "contact on a disc",
        general,
        corner,
        open,
        sphere,
        sphere.text(),
    ));
    for (name, purpose, kinds, e) in [
        (
            "contact-everywhere-3d",
            "no transition",
            sealed,
            Elementary::ContactEverywhere,
        ),
        (
            "two-sides-free-3d",
            "two free contact sides meet in cells with two contact faces",
            [Dirichlet, Contact, Neumann, Neumann, Contact, Dirichlet],
            Elementary::TwoSidesFree,
        ),
    ] {
        let smooth = Regularity::SMOOTH;
        all.push(in_3d(
            name,
            purpose,
            smooth,
            [0.0; 3],
            kinds,
            Extruded(e),
            e.text().extruded(),
        ));
    }
    all
}

/// The bottom as Γ_D for x < 0 and Γ_C for x > 0.
fn split_bottom(sides: &[Side]) -> Vec<Side> {
    sides
        .iter()
        .flat_map(|&side| match side.kind {
            Contact => vec![
                Side {
                    kind: Dirichlet,
                    range: Some([-1.0, 0.0]),
                    ..side
                },
                Side {
                    range: Some([0.0, 1.0]),
                    ..side
                },
            ],
            _ => vec![side],
        })
        .collect()
}
