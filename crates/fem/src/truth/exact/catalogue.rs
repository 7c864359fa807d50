//! The exact solutions that are built in.

use super::{
    Benchmark, CutOff, Elementary, ExactSolution, Extruded, Gap, Hertz, HertzSphere, Kind,
    ManyZones, Monomial, Periodic, Point, Profile, Regularity, Selector, Separated, Side,
};
use Kind::{Contact, Dirichlet, Neumann};

/// The paper's sides.
const PAPER: [Kind; 4] = [Neumann, Neumann, Contact, Dirichlet];
/// Data prescribed on all sides but the bottom.
const OPEN: [Kind; 4] = [Dirichlet, Dirichlet, Contact, Dirichlet];

/// On the box from `lower` to `upper`. The kinds are those of x = lower, x = upper, y = lower, …
fn on_box(
    name: &'static str,
    purpose: &'static str,
    regularity: Regularity,
    [lower, upper]: [Point; 2],
    kinds: &[Kind],
    solution: impl ExactSolution + 'static,
) -> Benchmark {
    let side = |(i, &kind): (usize, &Kind)| Side {
        kind,
        axis: i / 2,
        upper: i % 2 == 1,
        range: None,
    };
    Benchmark {
        name,
        purpose,
        regularity,
        dimension: kinds.len() / 2,
        lower,
        upper,
        sides: kinds.iter().enumerate().map(side).collect(),
        text: solution.text(),
        solution: Box::new(solution),
    }
}

const UNIT_SQUARE: [Point; 2] = [[0.0; 3], [1.0, 1.0, 0.0]];
/// [-1, 1] × [0, 1].
const WIDE: [Point; 2] = [[-1.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
const UNIT_CUBE: [Point; 2] = [[0.0; 3], [1.0; 3]];
const WIDE_BOX: [Point; 2] = [[-1.0, -1.0, 0.0], [1.0; 3]];

/// All of them, each with parameters that put its transitions off the lines of usual meshes.
pub fn catalogue() -> Vec<Benchmark> {
    let mut all = Vec::new();
    // r^e has its trace in H^(e+1/2-ε) of a side and itself lies in H^(e+1-ε).
    let general = Regularity::transition(2.5);
    let smooth = Regularity::SMOOTH;
    for (name, purpose, exponent) in [
        ("transition-1.5", "one transition as in general", 1.5),
        ("transition-3.5", "one transition, smoother", 3.5),
        ("transition-5.5", "one transition, still smoother", 5.5),
    ] {
        let m = Monomial::transition(exponent, 0.1);
        let regularity = Regularity::transition(exponent + 1.0);
        all.push(on_box(name, purpose, regularity, WIDE, &OPEN, m));
    }
    let purpose = "contact outside a gap, two transitions";
    let gap = Gap { a: 0.45 };
    all.push(on_box("gap", purpose, general, WIDE, &OPEN, gap));
    let purpose = "contact inside a strip, two transitions";
    let hertz = Hertz { a: 0.45 };
    all.push(on_box("hertz", purpose, general, WIDE, &OPEN, hertz));
    for (name, n) in [("periodic-1", 1), ("periodic-3", 3)] {
        let purpose = "periodic zones between Neumann sides";
        let periodic = Periodic { a: 0.4, n };
        all.push(on_box(
            name,
            purpose,
            general,
            UNIT_SQUARE,
            &PAPER,
            periodic,
        ));
    }
    for (name, n) in [("many-zones-3", 3), ("many-zones-5", 5)] {
        let purpose = "the paper's 6.2 in closed form";
        let zones = ManyZones::new(n);
        all.push(on_box(name, purpose, general, UNIT_SQUARE, &PAPER, zones));
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
        let regularity = Regularity::transition(sobolev);
        all.push(on_box(
            name,
            purpose,
            regularity,
            UNIT_SQUARE,
            &PAPER,
            separated,
        ));
    }
    let cut_off = CutOff {
        x0: 0.52,
        radius: 0.45,
    };
    let purpose = "r^(3/2) with homogeneous data";
    all.push(on_box(
        "cut-off",
        purpose,
        general,
        UNIT_SQUARE,
        &PAPER,
        cut_off,
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
        all.push(on_box(name, purpose, smooth, UNIT_SQUARE, &kinds, e));
    }
    for (name, purpose, m) in [
        (
            "grazing-touch",
            "free, touching in one point",
            Monomial::touch(),
        ),
        (
            "grazing-lift",
            "in contact, without pressure in one point",
            Monomial::lift(),
        ),
    ] {
        all.push(on_box(name, purpose, smooth, WIDE, &OPEN, m));
    }
    let mut mixed = on_box(
        "dirichlet-meets-contact",
        "Γ_D and Γ_C share a flat side: outside the theory",
        Regularity::transition(1.5),
        WIDE,
        &OPEN,
        Monomial::meeting(),
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
    all.push(on_box(
        "checkerboard",
        "homogeneous data, a checkerboard of zones",
        general,
        UNIT_CUBE,
        &sealed,
        checker,
    ));
    all.push(on_box(
        "transition-1.5-3d",
        "r^(3/2) along an edge",
        general,
        WIDE_BOX,
        &open,
        Extruded(Monomial::transition(1.5, 0.1)),
    ));
    all.push(on_box(
        "hertz-sphere",
        "contact on a disc",
        general,
        WIDE_BOX,
        &open,
        HertzSphere { a: 0.45 },
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
        let e = Extruded(e);
        all.push(on_box(name, purpose, smooth, UNIT_CUBE, &kinds, e));
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
