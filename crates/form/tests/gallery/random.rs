//! Random forms, in all codes.

use faceoff_form::random::{Drawn, Grammar, QUADRANGLES, Random, Shape, TRIANGLES};
use faceoff_mesh::mesh::Mesh;

use super::cubes::lattice;
use super::{Codes, agree_on, square};

/// Random forms on a mesh; `FACEOFF_SEED` and `FACEOFF_SCENES` ask for others and for more of them, and `FACEOFF_CODES` for some codes only.
fn agree_on_random(
    count: u64,
    grammar: Grammar,
    mesh: impl Fn() -> Mesh + std::panic::RefUnwindSafe,
) {
    let number = |name: &str, usual: u64| {
        std::env::var(name).map_or(usual, |text| text.parse().expect("an integer"))
    };
    // FFCx 0.5 takes the point of a rule of degree 1 for rules that follow it.
    let grammar = Grammar {
        has_degrees: false,
        ..grammar
    };
    let mut random = Random::new(number("FACEOFF_SEED", 2017));
    let faults: Vec<String> = (0..count * number("FACEOFF_SCENES", 1))
        .filter_map(|_| {
            let text = Drawn::new(&mut random, &grammar, Shape::small()).text("random");
            let ran = std::panic::catch_unwind(|| agree_on(&text, &mesh(), Codes::InTurn));
            ran.err().map(|_| text)
        })
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn random_forms() {
    agree_on_random(3, TRIANGLES, square);
}

#[test]
fn random_forms_on_quadrangles() {
    agree_on_random(2, QUADRANGLES, || lattice(2, 4));
}
