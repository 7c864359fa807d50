use super::*;
use crate::quadrature::{exact, parts};
use crate::scene::Scene;
use crate::sixty_digits::Big;

/// Points and weights of a composite rule on 4^dim parts.
fn points(dim: usize) -> Vec<([f64; 4], f64)> {
    let twice = parts(&WHOLE, dim)
        .into_iter()
        .flat_map(|part| parts(&part, dim));
    let twice: Vec<Piece> = twice.collect();
    let share = 1.0 / twice.len() as f64;
    let of = |part: &Piece| -> Vec<([f64; 4], f64)> {
        let inside = |inner: [f64; 4]| {
            std::array::from_fn(|i| (0..=dim).map(|k| inner[k] * part[k][i]).sum())
        };
        let rule = exact(dim, 5);
        rule.iter().map(|(l, w)| (inside(l), share * w)).collect()
    };
    twice.iter().flat_map(of).collect()
}

/// On random cells and faces: the bounds for f - p hold at the points of a rule, in its mean and in its mean square.
#[test]
fn models_hold_the_function() {
    let mut random = crate::Random::new(3);
    let mut random = || random.next();
    for text in [
        "sin(3*x + y - z) + x^2*y",
        "exp(x*y) / (2 + z) - x^y",
        "sqrt(2 + x - y) * cos(2*z)",
        "atan2(1 + y, 2 + x) + tanh(3*x)*z",
        "(x - 0.5)^4 - 2*(y - 0.3)^3*x + x*y*z",
        "abs(x - 0.4) + if(y < 0.6, 0, 1)",
        "sin(3*y) + 2*y^3",
    ] {
        let expression = Expression::parse(text).unwrap();
        for (dim, space) in [(1, 2), (2, 2), (2, 3), (3, 3)] {
            // What is known of other boxes, and by fewer derivatives, is not taken for what it is not.
            let mut boxes = Boxes::default();
            for _ in 0..40 {
                let size = 0.4 * 10f64.powf(-2.0 * random());
                let first: [f64; 3] = std::array::from_fn(|_| 0.3 + random());
                let mut corner = || -> [f64; 3] {
                    let mut at = |k: usize| first[k] + size * random();
                    std::array::from_fn(|k| if k < space { at(k) } else { 0.0 })
                };
                let vertices: [[f64; 3]; 4] = std::array::from_fn(|_| corner());
                // The same corners in another order are another simplex, and so are the same but for one.
                let (mut turned, mut moved) = (vertices, vertices);
                turned[..=dim].rotate_left(1);
                moved[dim] = corner();
                for vertices in [vertices, turned, moved] {
                    let domain = Domain {
                        expression: &expression,
                        vertices: Box::new(move |_| vertices),
                        measures: vec![1.0],
                        dim,
                        space,
                        unit: 0,
                    };
                    let left = |lambda: &[f64; 4], leaf: &Leaf| {
                        let all = vertices.iter().zip(lambda).take(dim + 1);
                        let x = std::array::from_fn(|k| all.clone().map(|(v, l)| l * v[k]).sum());
                        let linear = leaf.values.iter().zip(lambda).take(dim + 1);
                        expression.value(x) - linear.map(|(p, l)| p * l).sum::<f64>()
                    };
                    let errors = [AT_FIRST, MOST].map(|order| {
                        let leaf =
                            domain.model((0, &WHOLE, 1.0), order, &domain.axes(), &mut boxes);
                        let (mut mean, mut square) = (0.0, 0.0);
                        for (lambda, weight) in points(dim) {
                            let off = left(&lambda, &leaf);
                            assert!(
                                off.abs() <= leaf.wave + leaf.most() + 1e-12,
                                "{text} {leaf:?}"
                            );
                            mean += weight * off;
                            square += weight * off * off;
                        }
                        // Spots are smaller than what the rule sees.
                        if leaf.is_smooth && leaf.peak == 0.0 {
                            // The rule itself has an error.
                            let slack = 1e-12 + 1e-5 * size.powi(6);
                            let most = leaf.unknown() + slack;
                            assert!(mean.abs() <= most, "{text} {mean} {leaf:?}");
                            let root = square.sqrt();
                            assert!(
                                root <= leaf.swell + leaf.error + slack,
                                "{text} {root} {leaf:?}"
                            );
                        }
                        leaf.error
                    });
                    // Third and fourth derivatives are worth their time.
                    if size < 0.1 && !text.contains("if") {
                        let [second, fourth] = errors;
                        assert!(fourth <= 0.02 * second + 1e-13, "{text} {size} {errors:?}");
                    }
                }
            }
        }
    }
}

/// The model of an expression on a triangle with a given number of derivatives.
fn on_triangle(text: &str, corners: [[f64; 2]; 3], order: usize) -> Leaf {
    let expression = Expression::parse(text).unwrap();
    let mut vertices = [[0.0; 3]; 4];
    for (vertex, [x, y]) in vertices.iter_mut().zip(corners) {
        *vertex = [x, y, 0.0];
    }
    let domain = Domain {
        expression: &expression,
        vertices: Box::new(move |_| vertices),
        measures: vec![1.0],
        dim: 2,
        space: 2,
        unit: 0,
    };
    domain.model(
        (0, &WHOLE, 1.0),
        order,
        &domain.axes(),
        &mut Boxes::default(),
    )
}

/// The uncertainty of a derivative at the centre: x + 1e9 - 1e9 is x up to 1e-7.
#[test]
fn what_derivatives_are_off_is_in_the_error() {
    let c = 0.3125 + 0.5_f64.powi(25);
    let x = [c - 0.0625, c + 0.0625, c + 0.03];
    let corners = [[x[0], 0.0], [x[1], 0.1], [x[2], 1.0]];
    let leaf = on_triangle(&format!("((x+1e9)-1e9)*(x-{c:?})"), corners, AT_FIRST);
    // The mean of x (x - c) less that of p.
    let sum: f64 = x.iter().sum();
    let squares: f64 = x.iter().map(|x| x * x).sum();
    let mean = (squares + sum * sum) / 12.0 - c * sum / 3.0;
    let off = (mean - leaf.values[..3].iter().sum::<f64>() / 3.0).abs();
    assert!(1e-12 < off && off <= leaf.error, "{off} {leaf:?}");
}

/// The mean of a cube counts where the wave is largest: t³ has the mean 1/5 where t is -1, 1 and 1 at the corners.
#[test]
fn the_mean_is_part_of_the_wave() {
    let corners = [[-0.75, 0.0], [1.25, 0.1], [1.25, 1.0]];
    let leaf = on_triangle("(x-0.25)^3", corners, MOST);
    assert!((leaf.values[0] - 0.2).abs() < 1e-14);
    assert!(leaf.wave >= 1.2 - 1e-14, "{leaf:?}");
}

/// x + y is exact but at the corners.
#[test]
fn what_corners_are_off_is_in_the_error() {
    let (mut random, mut off) = (crate::Random::new(6), 0);
    for _ in 0..100 {
        let [x, y] = [0; 2].map(|_| 0.1875 + 0.125 * random.next());
        let corners = [[0.1875; 2], [0.3125; 2], [x, y]];
        let leaf = on_triangle("x+y", corners, AT_FIRST);
        let apart = (Big::of(x) + Big::of(y) - Big::of(leaf.values[2])).abs();
        assert!(apart.at_most(leaf.error), "{x} {y} {leaf:?}");
        off += usize::from(!apart.at_most(0.0));
    }
    assert!(off > 20, "{off}");
}

/// Trees of what jumps on lines and planes: every leaf holds the function at points of it, its spots are no larger than bounded,
/// and there are few leaves.
#[test]
fn leaves_follow_a_jump() {
    let mut random = crate::Random::new(5);
    for (scene, n, text, most) in [
        ("one-zone", 8, "if(x+2*y<1.3,0,5)", 3),
        (
            "one-zone",
            8,
            "-1-if(x+2*y<1.3,0,5)*if(3*x-y<0.7,1+x,exp(y))",
            3,
        ),
        (
            "one-zone",
            8,
            "if((x-0.5)^2+(y-0.5)^2<0.09,40,sin(x*y))",
            12,
        ),
        ("one-zone", 8, "if(x<y,1,-1)", 3),
        ("one-zone", 8, "if(x+2*y<1.3,if(x-y>0.1,2,3),5)", 3),
        ("one-zone-3d", 3, "if(x+2*y-z<1.3,0,5)", 3),
        ("one-zone-3d", 3, "if(x^2+y^2+z^2<0.49,x,5)", 70),
    ] {
        let mesh = Scene::find(scene).unwrap();
        let mesh = mesh.triangulation(Some(n)).unwrap();
        let expression = Expression::parse(text).unwrap();
        let dim = mesh.dim;
        let domain = Domain {
            expression: &expression,
            vertices: Box::new(|cell| mesh.vertices(cell)),
            measures: (0..mesh.cell_count()).map(|k| mesh.measure(k)).collect(),
            dim,
            space: dim,
            unit: 0,
        };
        let effort = Effort {
            tolerance: 1e-3,
            budget: 60 * mesh.cell_count(),
        };
        let trees = domain.enclose(&effort).unwrap();
        let mut leaves = 0;
        for (cell, tree) in trees.iter().enumerate() {
            let (geometry, mut all) = (mesh.geometry(cell), 0.0);
            tree.for_each(&mut |node, piece, share| {
                let leaf = tree.leaf(node);
                all += share;
                leaves += 1;
                let (mut mean, mut square) = (0.0, 0.0);
                const POINTS: usize = 400;
                for _ in 0..POINTS {
                    let mut inner = [0.0; 4];
                    inner[..=dim].fill_with(|| -random.next().ln());
                    let sum: f64 = inner.iter().sum();
                    let at = std::array::from_fn(|i| {
                        (0..=dim).map(|k| inner[k] / sum * piece[k][i]).sum()
                    });
                    let p: f64 = (0..=dim).map(|k| inner[k] / sum * leaf.values[k]).sum();
                    let off = (expression.value(geometry.point(&at)) - p).abs();
                    assert!(off <= leaf.wave + leaf.most() + 1e-12, "{text} {leaf:?}");
                    let beyond = (off - leaf.wave - leaf.error - 1e-12).max(0.0);
                    mean += beyond / POINTS as f64;
                    square += beyond * beyond / POINTS as f64;
                }
                // Six standard deviations of the result of this number of points.
                let [of_mean, of_square] = leaf.spots;
                let found = (of_square / POINTS as f64).sqrt() + leaf.peak / POINTS as f64;
                assert!(mean <= of_mean + 6.0 * found, "{text} {mean} {leaf:?}");
                let most = of_square + 6.0 * leaf.peak * found;
                assert!(square <= most, "{text} {square} {leaf:?}");
            });
            assert!((all - 1.0).abs() < 1e-12, "{text} {cell}");
        }
        assert!(leaves < most * trees.len(), "{text}: {leaves} leaves");
    }
}
