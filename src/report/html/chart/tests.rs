use super::*;

fn chart(ends: &[f64]) -> Chart {
    let line = |(k, end): (usize, &f64)| {
        Line::new(&format!("m{k}"), k, [[16.0, 10.0 * end], [64.0, *end]])
    };
    Chart {
        x: Axis::new("n"),
        y: Axis::new("error"),
        lines: ends.iter().enumerate().map(line).collect(),
        ..Chart::default()
    }
}

/// The position of each label of a line.
fn labels(svg: &str) -> Vec<[f64; 2]> {
    let number = |text: &str, name: &str| -> f64 {
        let from = text.find(name).unwrap() + name.len();
        text[from..].split('"').next().unwrap().parse().unwrap()
    };
    let all = svg
        .split("<text ")
        .filter(|t| t.starts_with("class=\"t b halo\""));
    all.map(|t| [number(t, " x=\""), number(t, " y=\"")])
        .collect()
}

#[test]
fn labels_do_not_collide_and_give_way_to_a_key() {
    let drawn = charts("", &[chart(&[1e-3, 1.01e-3, 1.02e-3, 1e-4])], 384.0).file();
    let found = labels(&drawn);
    assert_eq!(found.len(), 4);
    for (k, a) in found.iter().enumerate() {
        let apart = found[k + 1..].iter().map(|b| (a[1] - b[1]).abs());
        assert!(
            apart.fold(f64::INFINITY, f64::min) >= LINE - 1.0,
            "{found:?}"
        );
    }
    assert!(!drawn.contains("<g transform"));
    // If this many lines end at one position, no label would be at its line.
    let many: Vec<f64> = (0..24)
        .map(|k| 1e-3 * (1.0 + 1e-3 * f64::from(k)))
        .collect();
    let drawn = charts("", &[chart(&many)], 384.0).file();
    assert_eq!(
        (labels(&drawn).len(), drawn.matches("<g transform").count()),
        (0, 24)
    );
}

#[test]
fn axes_have_numbers_however_short_they_are() {
    for (low, high, labels) in [
        (1e-7, 1e-1, "10⁻⁷ 10⁻⁶ 10⁻⁵ 10⁻⁴ 10⁻³ 10⁻² 10⁻¹"),
        (0.05, 3.0, "0.05 0.1 0.2 0.5 1 2"),
        (0.011, 0.019, "0.012 0.014 0.016 0.018"),
        (3e-5, 2e-3, "5·10⁻⁵ 10⁻⁴ 2·10⁻⁴ 5·10⁻⁴ 10⁻³ 2·10⁻³"),
    ] {
        let found: Vec<String> = decades(low, high).into_iter().map(|t| t.1).collect();
        assert_eq!(found.join(" "), labels);
    }
    assert!(decades(1e-30, 1.0).len() <= 8);
}

#[test]
fn dotted_slopes_are_clear_of_all_points() {
    let mut of = chart(&[1e-3, 1e-4]);
    of.slopes = [-1.0, -2.0]
        .map(|power| Slope {
            power,
            name: String::new(),
        })
        .into();
    let points = vec![[16.0, 1e-2], [64.0, 1e-4]];
    let [above, below] = [0, 1].map(|k| of.slopes(points.clone(), &[16.0, 64.0])[k].1);
    assert!(above[0][1] > 1e-2 && above[1][1] > 1e-4, "{above:?}");
    assert!(below[0][1] < 1e-2 && below[1][1] < 1e-4, "{below:?}");
    assert!((below[0][1] / below[1][1] - 16.0).abs() < 1e-9);
}

#[test]
fn names_cannot_become_markup() {
    let evil = "</svg><script>\u{202e}&";
    let mut of = chart(&[1e-3]);
    of.name = evil.into();
    of.x.name = evil.into();
    of.lines[0].names[1] = evil.into();
    of.lines[0].points[0].title = evil.into();
    let of = [of, chart(&[1.0])];
    for width in [1090.0, 384.0] {
        let picture = charts(evil, &of, width);
        for text in [picture.file(), picture.html().as_str().to_owned()] {
            assert!(
                !text.contains("<script") && !text.contains('\u{202e}'),
                "{text}"
            );
            assert_eq!(text.matches("</svg>").count(), 1);
        }
    }
}

#[test]
fn what_is_all_zero_is_said_to_be() {
    let of = charts("", &[chart(&[0.0, f64::NAN])], 384.0);
    assert!(of.file().contains("No error is above zero."));
}

#[test]
fn what_fails_is_missing_or_equal_is_seen() {
    let point = |x: f64, y: f64, is_apart: bool| Point {
        is_apart,
        is_bad: y > 1e-9,
        ..Point::new([x, y])
    };
    let points = [(1.0, 1e-12, true), (2.0, 1e-10, false), (4.0, 1e-3, true)];
    let chart = Chart {
        x: Axis {
            is_linear: true,
            ..Axis::new("time")
        },
        y: Axis {
            also: Some((1e-12, "equal")),
            ..Axis::new("difference")
        },
        levels: vec![(1e-9, "tolerance")],
        gaps: vec![(3.0, "<not there>".into())],
        lines: vec![Line {
            is_bare: true,
            points: points.map(|(x, y, is_apart)| point(x, y, is_apart)).into(),
            ..Line::new("u", 0, [])
        }],
        ..Chart::default()
    };
    let drawn = charts("", &[chart], 600.0).file();
    let lines: Vec<&str> = drawn.split("<path class=\"ink\"").collect();
    let path = lines[1].split("/>").next().unwrap();
    assert_eq!((lines.len(), path.matches('M').count()), (2, 2), "{path}");
    // On a line without marks only failures have one.
    assert_eq!(drawn.matches("<circle class=\"redf\"").count(), 1);
    assert_eq!(drawn.matches("<circle").count(), 1);
    assert!(drawn.contains("class=\"redl dash\"") && drawn.contains("&lt;not there&gt;"));
    assert!(drawn.contains(">equal<") && !drawn.contains(">10⁻¹²<"));
    assert!(drawn.contains(">tolerance<"));
}

#[test]
fn an_axis_without_a_logarithm_has_no_decades() {
    for [low, high] in [
        [0.0, 1.0],
        [-1.0, 1.0],
        [f64::NAN, 1.0],
        [1.0, f64::INFINITY],
    ] {
        assert!(decades(low, high).is_empty(), "{low} {high}");
    }
    // A linear scale only has the given labels, whatever its axis says.
    let scale = Scale {
        ends: [0.0, 1.0],
        places: [0.0, 100.0],
        is_linear: true,
    };
    assert!(Axis::new("x").ticks(&scale).is_empty());
}

#[test]
fn a_strip_has_points_of_any_sign() {
    let chart = Chart {
        lines: vec![Line {
            is_bare: true,
            ..Line::new("u", 0, [[-1.0, 1.0], [0.0, 2.0], [1.0, 1.0]])
        }],
        ..Chart::default()
    };
    let svg = chart.strip([50.0, 0.0, 250.0, 70.0], [-1.0, 1.0], false);
    assert!(
        svg.contains("d=\"M50.0 ") && svg.contains("L150.0 "),
        "{svg}"
    );
    // Labels of an axis as low as this do not overlap.
    let heights: Vec<f64> = svg
        .split("class=\"t e\"")
        .skip(1)
        .map(|text| {
            let y = text.split(" y=\"").nth(1).unwrap();
            y.split('"').next().unwrap().parse().unwrap()
        })
        .collect();
    let far = heights
        .windows(2)
        .all(|pair: &[f64]| (pair[0] - pair[1]).abs() > 10.0);
    assert!(heights.len() > 1 && far, "{heights:?}");
}
