//! Numbers over groups against those of solutions that are polynomials.

use crate::certify::tests::solved;
use crate::certify::{Numbers, OfPart, examine};
use crate::contact::{Discretisation, Method, Problem};
use crate::scene::{Boundary, Data, Expression, GroupName, Scene};
use faceoff_mesh::mesh::generate::union_jack;
use faceoff_mesh::mesh::{Group, Mesh, Triangulation};

/// The unit square with the lower half of its right side and the left half of its bottom as separate groups, and its cells in two.
fn mesh(n: usize) -> Mesh {
    let mut mesh = union_jack(n, [1.0; 2]);
    let cells: Vec<&[u32]> = mesh.blocks.iter().flat_map(|block| block.cells()).collect();
    let middle = |cell: u32| -> [f64; 2] {
        let nodes = cells[cell as usize];
        let of = |k: usize| {
            nodes
                .iter()
                .map(|&node| mesh.points[node as usize][k])
                .sum::<f64>()
        };
        [of(0), of(1)].map(|sum| sum / nodes.len() as f64)
    };
    let mut groups = Vec::new();
    for group in mesh.groups.iter().filter(|group| group.dim == 1) {
        let name = group.name.clone().unwrap();
        let part = |of: &dyn Fn([f64; 2]) -> bool, name: &str, tag: i64| {
            let mut part = Group::new(1, tag);
            part.name = Some(name.to_owned());
            part.cells = group
                .cells
                .iter()
                .copied()
                .filter(|&c| of(middle(c)))
                .collect();
            part
        };
        let tag = 10 + 2 * groups.len() as i64;
        match name.as_str() {
            "right" => {
                groups.push(part(&|x| x[1] < 0.5, "right below", tag));
                groups.push(part(&|x| x[1] > 0.5, "right above", tag + 1));
            }
            "bottom" => {
                groups.push(part(&|x| x[0] < 0.5, "bottom left", tag));
                groups.push(part(&|x| x[0] > 0.5, "bottom right", tag + 1));
            }
            _ => groups.push(part(&|_| true, &name, tag)),
        }
    }
    let mut left = Group::new(2, 50);
    left.cells = (0..cells.len() as u32)
        .filter(|&cell| cells[cell as usize].len() == 3 && middle(cell)[0] < 0.5)
        .collect();
    groups.push(left);
    mesh.groups = groups;
    mesh
}

fn numbers(mesh: &Mesh, [f, t, g]: [&str; 3], dirichlet: &[&str], contact: &[&str]) -> Numbers {
    let names = |of: &[&str]| {
        of.iter()
            .map(|name| GroupName::Name((*name).to_owned()))
            .collect()
    };
    let all = [
        "left",
        "top",
        "right above",
        "right below",
        "bottom left",
        "bottom right",
    ];
    let others: Vec<&str> = all
        .into_iter()
        .filter(|name| !dirichlet.contains(name) && !contact.contains(name))
        .collect();
    let [f, t, g] = [f, t, g].map(|text| Expression::parse(text).unwrap());
    let scene = Scene::find("one-zone").unwrap().with_boundary(Boundary {
        dirichlet: names(dirichlet),
        neumann: names(&others),
        contact: names(contact),
    });
    let scene = scene.with_data(Data {
        f,
        t,
        psi: g.clone(),
        g,
    });
    let mesh = Triangulation::new("mesh", mesh).unwrap();
    let problem = Problem::new(&scene, &mesh, &Discretisation::of(&scene, Method::cr())).unwrap();
    examine(&problem, &solved(&problem))
        .unwrap()
        .numbers
        .unwrap()
}

fn is_in(parts: &[OfPart], name: &str, truth: f64, width: f64) {
    let found = parts.iter().find(|of| of.part == name).unwrap();
    let [low, high] = found.interval.unwrap();
    assert!(
        low <= truth && truth <= high && high - low < width,
        "{found:?} {truth}"
    );
}

/// u = y + y² - x - x² is pressed everywhere: -∂u/∂y = -1 on the bottom, ∂u/∂x = -3 on the right.
#[test]
fn forces_on_groups_of_contact_are_in_their_intervals() {
    let u = "y+y^2-x-x^2";
    let t = "if(x<0.25,1,if(y>0.25,-3,-1))";
    let found = numbers(
        &mesh(8),
        ["0", t, u],
        &["top"],
        &["bottom left", "right below"],
    );
    is_in(&found.contact_forces, "bottom left", -0.5, 0.3);
    is_in(&found.contact_forces, "right below", -1.5, 0.3);
    let [low, high] = found.contact_force.unwrap();
    assert!(low <= -2.0 && -2.0 <= high, "{low} {high}");
    // Γ_D is one group, and the mean is that over 0 < x < 1/2.
    assert!(found.dirichlet_fluxes.is_empty());
    is_in(&found.means, "50", 0.5, 0.05);
    // What meets another group of Γ_C cannot be separated from it.
    let found = numbers(
        &mesh(8),
        ["0", t, u],
        &["top"],
        &["bottom left", "bottom right"],
    );
    assert!(found.contact_forces.len() == 2);
    assert!(found.contact_forces.iter().all(|of| of.interval.is_none()));
    assert!(found.contact_force.is_some());
}

/// u = x - x² - 3y is pressed at the top; its fluxes through both groups of Γ_D are 3/2 and -1/2.
#[test]
fn fluxes_through_groups_of_dirichlet_are_in_their_intervals() {
    let t = "if(x<0.25,-1,if(y<0.25,3,-1))";
    let found = numbers(
        &mesh(8),
        ["2", t, "x-x^2-3*y"],
        &["bottom left", "right below"],
        &["top"],
    );
    is_in(&found.dirichlet_fluxes, "bottom left", 1.5, 0.3);
    is_in(&found.dirichlet_fluxes, "right below", -0.5, 0.3);
}
