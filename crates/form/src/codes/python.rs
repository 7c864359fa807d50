//! Common parts of the tables of codes in Python.

use minijinja::Value;

use super::points::NUMPY;
use super::table::{Code, Leaves, Sharing};

/// Reserved words of Python and names of the frame.
pub const RESERVED: &str = "False None True and as assert async await break class continue def del elif else except finally for from global \
    if import in is lambda nonlocal not or pass raise return try while with abs float int len list map max min open pow print range repr \
    set str sum tuple zip all any bool dict divmod enumerate getattr hasattr iter next slice sorted i j vertices values here own numpy pathlib \
    __file__ np sys Path x y z n h circumradius facet_length longest_edge edges pairs radii lengths length slope index corner normals slopes ones steps own_normal pi reads writes points cells regions facets labels read_msh write_vtu step A r d form \
    system write_system at_dofs directions names describe count is_held loads basis M columns state whole from_nodes to_nodes modes eigenvalues mass";

/// The defaults for codes in Python.
pub const USUAL: Code = Code {
    name: "",
    suffix: "",
    command: &["python3"],
    mesh: ("msh2", "msh"),
    frame: "",
    by_hand_scheme: None,
    reserved: &[RESERVED],
    first: 0,
    mark: '_',
    pi: "np.pi",
    coordinates: ["x", "y", "z"],
    normals: ["n[0]", "n[1]", "n[2]"],
    length: |length, _| length.name(),
    clock: str::to_owned,
    on_side: |text, _| text,
    leaves: LEAVES,
    form: NUMPY,
    formulas: NUMPY,
    brackets: false,
    signs: true,
    element: |_, space| Err(format!("it has no {}", space.name())),
    rules: |problem| Ok(vec![""; problem.all_rules().len()]),
    by_hand: |_, _| false,
    sharing: Sharing::Together,
    points: (["x", "y", "z"], ""),
    has_eigen: false,
    lacks: |_| Ok(()),
    more: |_| Value::from(()),
};

/// Components are functions, and derivatives are arrays.
pub const LEAVES: Leaves = Leaves {
    name: |of, leaf| of.function(leaf),
    first: "",
    second: "",
    whole: None,
    index: |places| {
        let places: Vec<String> = places.iter().map(usize::to_string).collect();
        format!("[{}]", places.join(", "))
    },
    by_component: true,
    side_first: false,
    sided_data: true,
};
