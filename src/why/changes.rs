//! Describes the form that a result solves instead of the given one, as text and as JSON.

use serde::Serialize;

use crate::text::number::{number, place, whole};
use crate::text::{Text, text};
use faceoff_form::Problem;
use faceoff_form::judge::{Cause, Change, Digits, Given, Interpolated, Part, Penalty, Size, Term};
use faceoff_form::problem::{Domain, Held};
use faceoff_form::scalar::Length;

/// A change of a form.
#[derive(Debug, Clone, Serialize)]
pub struct CauseTold {
    kind: &'static str,
    /// The text of the term, if it concerns one.
    #[serde(skip_serializing_if = "Option::is_none")]
    term: Option<String>,
    /// The name of the group, parameter, datum, unknown, rule, cells or facets.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    place: Option<String>,
    /// The factor of the term or of a part of it, the value of the parameter, or the slope of a factor; `None` for a change without a number.
    #[serde(skip_serializing_if = "Option::is_none")]
    factor: Option<f64>,
    /// The remaining residual with all changes together: the largest row, relative to the sizes of the rows.
    left: f64,
}

impl CauseTold {
    /// The kind of the change in JSON.
    pub fn kind(&self) -> &'static str {
        self.kind
    }
}

/// The context that is needed to name a change.
pub struct Names<'a> {
    pub problem: &'a Problem,
    pub terms: &'a [Term],
}

impl Names<'_> {
    fn term(&self, k: usize) -> &str {
        &self.terms[k].text
    }

    /// The measure of a term, as `dx` or `ds(top)`.
    fn measure(&self, k: usize) -> String {
        let measure = &self.problem.integrals[k].measure;
        let name = match measure.domain {
            Domain::Cells => "dx",
            Domain::Boundary => "ds",
            Domain::Interior => "dS",
        };
        let groups = measure
            .groups
            .iter()
            .map(|k| &*self.problem.groups[*k].name);
        match measure.groups.is_empty() {
            true => name.to_owned(),
            false => format!("{name}({})", groups.collect::<Vec<_>>().join(", ")),
        }
    }

    fn code(&self, k: usize) -> Text {
        code(self.term(k))
    }

    /// `the term … were missing and …`, to follow "as if".
    pub fn sentence(&self, causes: &[Cause]) -> Text {
        let mut all = causes.iter().map(|cause| self.words(cause));
        let first = all.next().unwrap_or_default();
        all.fold(first, |sentence, next| text!("{} and {}", sentence, next))
    }

    fn words(&self, Cause { change, factor }: &Cause) -> Text {
        let problem = self.problem;
        let group = |k: usize| code(&problem.groups[k].name);
        match change {
            Change::Factor { term } => {
                let words = has(text!("the term {}", self.code(*term)), *factor);
                text!("{}{}", words, self.of_plane_stress(None, *factor))
            }
            Change::Group { term, group: k } => has(
                text!("the term {} on {}", self.code(*term), group(*k)),
                *factor,
            ),
            Change::Parameter { parameter } => text!(
                "{} were {}{}",
                code(&problem.parameters[*parameter].name),
                few(*factor),
                self.origin(*parameter, *factor)
            ),
            Change::Rule { term, rule } => text!(
                "{} were integrated by the rule {}",
                match term {
                    Some(term) => text!("the term {}", self.code(*term)),
                    None => text!("all terms"),
                },
                code(rule)
            ),
            Change::Data { datum, term, by } => {
                let name = code(&problem.data[*datum].name);
                let within = term.map(|term| text!(" in {}", self.code(term)));
                let how = match by {
                    Interpolated::Points => "taken at the quadrature points".to_owned(),
                    Interpolated::Degree(0) => "taken at the centre of each cell".to_owned(),
                    Interpolated::Degree(k) => format!("interpolated by P{k}"),
                };
                text!("{}{} were {}", name, within, how)
            }
            Change::One { datum } => text!("{} were 1", code(&problem.data[*datum].name)),
            Change::Size { term, of, size } => {
                let within = term.map(|term| text!(" in {}", self.code(term)));
                let size = match size {
                    Size::Of(Length::Circumradius) => "the circumradius",
                    Size::Of(Length::Inradius) => "the inradius",
                    Size::Of(Length::Facet) => "the length of the facet",
                    Size::Of(Length::Diameter) => "the diameter",
                    Size::Largest => "the largest diameter of all cells",
                    Size::Smallest => "the smallest diameter of all cells",
                };
                text!("{} were {}{}", code(of.name()), size, within)
            }
            Change::Normal { term } => {
                let within = term.map(|term| text!(" in {}", self.code(term)));
                text!("{} pointed the other way{}", code("n"), within)
            }
            Change::Coordinates { digits } => text!(
                "the coordinates of the vertices were rounded to {}",
                match digits {
                    Digits::Single => "single precision".to_owned(),
                    Digits::Significant(k) => format!("{k} significant digits"),
                    Digits::Decimals(k) => format!("{k} decimals"),
                }
            ),
            Change::Slope { unknown, axis } => {
                let unknown = &problem.unknowns[*unknown];
                let axis = ["x", "y", "z"][*axis];
                let product = format!("d{}/d{axis}*{}*dx", unknown.name, unknown.test);
                text!("{} times {} were added", few(*factor), code(&product))
            }
            Change::Transposed { term } => text!(
                "the term {} had test function and unknown exchanged",
                self.code(*term)
            ),
            Change::Moved { term, group: k } => {
                text!("the term {} were taken on {}", self.code(*term), group(*k))
            }
            Change::Part { term, part } => {
                let part = match part {
                    Part::Slope(axis) => format!("derivative by {}", ["x", "y", "z"][*axis]),
                    Part::Component(k) => format!("component {k}"),
                };
                let what = text!(
                    "the part of the term {} with the {} of the test function",
                    self.code(*term),
                    part
                );
                has(what, *factor)
            }
            Change::Varying { term, axis } => text!(
                "the term {} had the factor 1 {} {} {}",
                self.code(*term),
                if *factor < 0.0 { "-" } else { "+" },
                few(factor.abs()),
                ["x", "y", "z"][*axis]
            ),
            Change::Mass { unknown, rule } => {
                let unknown = &problem.unknowns[*unknown];
                let by = rule.map(|rule| text!(" by the rule {}", code(rule)));
                let product = match unknown.space.size {
                    None => format!("{}*{}*dx", unknown.name, unknown.test),
                    Some(_) => format!("dot({}, {})*dx", unknown.name, unknown.test),
                };
                text!("{} times {}{} were added", few(*factor), code(&product), by)
            }
            Change::Given { condition, by } => {
                let held = &problem.held()[*condition];
                let of = text!("the Dirichlet values of {}", self.held(held));
                match by {
                    Given::Free => text!(
                        "the Dirichlet condition of {} were not imposed",
                        self.held(held)
                    ),
                    Given::Factor if *factor == 0.0 => text!("{} were 0", of),
                    Given::Factor => has(of, *factor),
                    Given::Added if *factor < 0.0 => {
                        text!("{} were smaller by {}", of, few(-factor))
                    }
                    Given::Added => text!("{} were larger by {}", of, few(*factor)),
                    Given::Linear => text!("{} were interpolated by P1", of),
                    Given::Of(other) => {
                        text!(
                            "{} were those of {}",
                            of,
                            self.held(&problem.held()[*other])
                        )
                    }
                    Given::Projected(rule) => {
                        text!("{} were projected in L² by the rule {}", of, code(rule))
                    }
                }
            }
            Change::Penalty { by } => {
                let term = match by {
                    Penalty::AtDofs => "(u - g) at each dof",
                    Penalty::Integrated => "(u - g)*v*ds",
                    Penalty::OverH => "(u - g)*v/h*ds",
                };
                text!(
                    "Dirichlet values g were imposed by the penalty {} times {}",
                    few(*factor),
                    code(term)
                )
            }
            Change::Uncoupled => text!("Nitsche's terms on the contact boundary were missing"),
            Change::Obstacle { by } => {
                let term = match by {
                    Penalty::OverH => "max(dot(u, n) - psi, 0)*dot(v, n)/h*ds",
                    _ => "max(dot(u, n) - psi, 0)*dot(v, n)*ds",
                };
                text!(
                    "contact was imposed by the penalty {} times {}",
                    few(*factor),
                    code(term)
                )
            }
            Change::Exchanged { count, of } => {
                text!(
                    "{} of {} values were at each other's places",
                    whole(*count),
                    whole(*of)
                )
            }
            Change::Values {
                count: 1,
                of,
                between,
            } => text!(
                "one value of {} were another one, at {}",
                whole(*of),
                self.at(&between[0])
            ),
            Change::Values { count, of, between } => text!(
                "{} values of {} were others, from {} to {}",
                whole(*count),
                whole(*of),
                self.at(&between[0]),
                self.at(&between[1])
            ),
            Change::Stopped { step, of } => {
                text!(
                    "Newton's method had stopped after step {} of {}",
                    whole(*step),
                    whole(*of)
                )
            }
            Change::Some { term, is_all, .. } => {
                let what = match is_all {
                    true => text!("all terms over {}", code(&self.measure(*term))),
                    false => text!("the term {}", self.code(*term)),
                };
                has(text!("{} {}", what, self.some(change)), *factor)
            }
        }
    }

    fn at(&self, x: &[f64; 3]) -> String {
        place(&x[..self.problem.dim])
    }

    /// Where the value of a parameter may come from.
    fn origin(&self, parameter: usize, value: f64) -> Text {
        let others = self.problem.parameters.iter().enumerate();
        let mut others = others.filter(|(k, _)| *k != parameter);
        match others.find(|(_, other)| is_near(other.value, value)) {
            Some((_, other)) => text!(", the value of {}", code(&other.name)),
            None => self.of_plane_stress(Some(parameter), value),
        }
    }

    /// Is it the λ, or the factor of a term, of plane stress instead of plane strain: 2λμ/(λ + 2μ), (1 - 2ν)/(1 - ν)?
    fn of_plane_stress(&self, parameter: Option<usize>, value: f64) -> Text {
        let parameters = &self.problem.parameters;
        let find = |names: &[&str]| {
            let found = parameters.iter().position(|p| names.contains(&&*p.name));
            found.map(|k| (k, parameters[k].value))
        };
        let lambda = find(&["lam", "lambda", "lmbda"]);
        let stress = match parameter {
            Some(parameter) => lambda
                .zip(find(&["mu", "G"]))
                .filter(|((k, _), _)| *k == parameter)
                .map(|((_, l), (_, m))| 2.0 * l * m / (l + 2.0 * m)),
            None => find(&["nu", "poisson"]).map(|(_, nu)| (1.0 - 2.0 * nu) / (1.0 - nu)),
        };
        match stress.is_some_and(|stress| is_near(stress, value)) {
            true => ", as in plane stress".into(),
            false => Text::default(),
        }
    }

    /// `u[1] on top`
    fn held(&self, held: &Held) -> Text {
        let unknown = &self.problem.unknowns[held.unknown];
        let component = held.component.filter(|_| unknown.space.size.is_some());
        let component = component.map_or(String::new(), |k| format!("[{k}]"));
        let group = &self.problem.groups[held.group].name;
        text!(
            "{} on {}",
            code(&format!("{}{component}", unknown.name)),
            code(group)
        )
    }

    /// `in one cell, at (…)`, `on 3 of 8 facets, from (…) to (…)`.
    fn some(&self, change: &Change) -> String {
        let Change::Some {
            domain,
            count,
            of,
            between: [low, high],
            ..
        } = change
        else {
            return String::new();
        };
        let at = |x: &[f64; 3]| self.at(x);
        let (within, what) = match domain {
            Domain::Cells => ("in", "cell"),
            _ => ("on", "facet"),
        };
        match count {
            1 => format!("{within} one {what} of {of}, at {}", at(low)),
            _ => format!(
                "{within} {count} {what}s of {of}, from {} to {}",
                at(low),
                at(high)
            ),
        }
    }

    /// Changes with their common remaining residual, for JSON.
    pub fn told(&self, causes: &[Cause], left: f64) -> Vec<CauseTold> {
        causes.iter().map(|cause| self.entry(cause, left)).collect()
    }

    fn entry(&self, cause: &Cause, left: f64) -> CauseTold {
        let problem = self.problem;
        let group = |k: usize| problem.groups[k].name.clone();
        let (kind, term, place) = match &cause.change {
            Change::Factor { term } => ("factor", Some(term), None),
            Change::Parameter { parameter } => {
                let name = &problem.parameters[*parameter].name;
                ("parameter", None, Some(name.clone()))
            }
            Change::Rule { term, rule } => ("rule", term.as_ref(), Some((*rule).to_owned())),
            Change::Data { datum, term, .. } => {
                let name = &problem.data[*datum].name;
                ("data", term.as_ref(), Some(name.clone()))
            }
            Change::One { datum } => ("one", None, Some(problem.data[*datum].name.clone())),
            Change::Size { term, of, .. } => ("size", term.as_ref(), Some(of.name().to_owned())),
            Change::Normal { term } => ("normal", term.as_ref(), Some("n".to_owned())),
            Change::Coordinates { .. } => ("coordinates", None, None),
            Change::Slope { unknown, .. } => {
                ("slope", None, Some(problem.unknowns[*unknown].name.clone()))
            }
            Change::Transposed { term } => ("transposed", Some(term), None),
            Change::Moved { term, group: k } => ("moved", Some(term), Some(group(*k))),
            Change::Group { term, group: k } => ("group", Some(term), Some(group(*k))),
            Change::Part { term, part } => {
                let place = match part {
                    Part::Slope(axis) => format!("derivative {axis}"),
                    Part::Component(k) => format!("component {k}"),
                };
                ("part", Some(term), Some(place))
            }
            Change::Varying { term, axis } => (
                "varying",
                Some(term),
                Some(["x", "y", "z"][*axis].to_owned()),
            ),
            Change::Mass { unknown, .. } => {
                ("mass", None, Some(problem.unknowns[*unknown].name.clone()))
            }
            Change::Given { condition, .. } => {
                let held = &problem.held()[*condition];
                ("dirichlet", None, Some(group(held.group)))
            }
            Change::Penalty { .. } | Change::Obstacle { .. } => ("penalty", None, None),
            Change::Uncoupled => ("uncoupled", None, None),
            Change::Exchanged { .. } => ("exchanged", None, None),
            Change::Values { between, .. } => ("values", None, Some(self.at(&between[0]))),
            Change::Stopped { .. } => ("iteration", None, None),
            Change::Some { term, .. } => ("some", Some(term), Some(self.some(&cause.change))),
        };
        CauseTold {
            kind,
            term: term.map(|k| self.term(*k).to_owned()),
            place,
            factor: (!cause.change.is_whole()).then_some(cause.factor),
            left,
        }
    }
}

/// Are they the same to six digits?
fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * a.abs()
}

/// As few of seven digits as represent the number.
fn few(x: f64) -> String {
    let rounded = |digits: usize| format!("{x:.*e}", digits - 1).parse::<f64>();
    let digits = (1..7).find(|digits| rounded(*digits) == rounded(7));
    number(rounded(7).unwrap_or(x), digits.unwrap_or(7))
}

fn code(words: &str) -> Text {
    Text::message(&format!("`{words}`"))
}

/// Something is missing, or has a factor.
fn has(what: Text, factor: f64) -> Text {
    match factor {
        0.0 => text!("{} were missing", what),
        -1.0 => text!("{} had the other sign", what),
        _ => text!("{} had the factor {}", what, few(factor)),
    }
}
