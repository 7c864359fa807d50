//! What templates are filled with: a problem in the words of a code.

use minijinja::Value;
use serde::Serialize;

use super::frame::{Sharing, Speaker};
use super::python;
use super::spelling::{comment, head, measure};
use crate::problem::{self, Bilinear, Domain, Element, Measure, Problem, Space};
use crate::scalar::{Field, Id, Node};

/// The fields of all templates.
#[derive(Serialize)]
pub struct Fields {
    name: String,
    /// The file name of the script.
    file: String,
    dim: usize,
    /// Names of the coordinates.
    axes: &'static [&'static str],
    /// What is solved, line by line.
    head: Vec<String>,
    parameters: Vec<Named>,
    data: Vec<Datum>,
    /// The components of data that are interpolated.
    interpolated: Vec<Interpolated>,
    unknowns: Vec<Unknown>,
    /// The scalar functions that make up the unknowns, and functions in spaces of vectors.
    functions: Vec<Function>,
    /// The components of all unknowns.
    components: Vec<Names>,
    groups: Vec<Group>,
    /// The rules on cells and facets.
    rules: Vec<Rule>,
    /// Names for what occurs more than once, parts first.
    shared: Vec<Named>,
    /// Those of the derivative, where it has its own.
    shared_by_derivative: Vec<Named>,
    integrals: Vec<Integral>,
    held: Vec<Held>,
    means: Vec<Mean>,
    /// None where nothing depends on time.
    time: Option<Time>,
    has_diameter: bool,
    /// Is some Dirichlet value one of a component, and is some one of a whole vector?
    holds_parts: bool,
    holds_wholes: bool,
    output: Output,
    /// What no other code needs.
    more: Value,
}

#[derive(Serialize, Clone)]
pub struct Named {
    pub name: String,
    pub value: String,
}

/// A formula in coordinates and parameters.
#[derive(Serialize, Clone)]
struct Formula {
    text: String,
    /// As a function of NumPy's arrays.
    at_points: String,
    is_number: bool,
    /// Its value, where it depends on neither coordinates nor parameters.
    constant: Option<String>,
}

#[derive(Serialize)]
struct Datum {
    name: String,
    shape: Vec<usize>,
    /// The space it is interpolated in; none where it is evaluated at the quadrature points.
    element: Option<String>,
    degree: usize,
    parts: Vec<Part>,
}

/// A component of data.
#[derive(Serialize)]
struct Part {
    name: String,
    #[serde(flatten)]
    formula: Formula,
}

#[derive(Serialize)]
struct Interpolated {
    name: String,
    element: String,
    degree: usize,
    #[serde(flatten)]
    formula: Formula,
}

#[derive(Serialize)]
struct Unknown {
    /// Its name in the form.
    title: String,
    /// The position of its first component among all.
    position: usize,
    #[serde(flatten)]
    names: Names,
    element: String,
    is_continuous: bool,
    is_vector: bool,
    size: Option<usize>,
    parts: Vec<Names>,
}

/// The names of an unknown and what goes with it.
#[derive(Serialize)]
struct Names {
    name: String,
    test: String,
    increment: String,
    /// At the end of the step before; empty without steps.
    old: String,
}

#[derive(Serialize)]
struct Function {
    #[serde(flatten)]
    names: Names,
    element: String,
    is_vector: bool,
    /// Its space's name in form files.
    family: String,
    degree: usize,
    unknown: usize,
    held: Vec<Held>,
}

#[derive(Serialize)]
struct Group {
    name: String,
    tag: i64,
    /// How many dimensions it has less than the mesh.
    less: usize,
}

#[derive(Serialize)]
struct Rule {
    /// What the code calls it.
    name: String,
    points: Vec<String>,
    /// They sum to the volume of the reference simplex.
    weights: Vec<String>,
}

#[derive(Serialize)]
struct Integral {
    /// The measure as the form writes it.
    title: String,
    position: usize,
    #[serde(flatten)]
    over: Over,
    terms: Vec<Term>,
    /// Empty where the code differentiates by itself.
    derivative: Vec<Term>,
    /// Is the derivative written out?
    by_hand: bool,
}

/// A measure.
#[derive(Serialize)]
pub struct Over {
    /// `dx`, `ds` or `dS`.
    pub kind: &'static str,
    /// The numbers of its groups.
    pub tags: Vec<i64>,
    /// The same, and those of the whole boundary where a code integrates over all facets otherwise.
    pub named: Vec<i64>,
    /// Their positions among all groups, from 1.
    pub places: Vec<usize>,
}

/// A term of a sum, as in `a`, `+ b`, `- c`.
#[derive(Serialize)]
pub struct Term {
    /// With the sign before it, unless it is the first one.
    signed: String,
    text: String,
}

#[derive(Serialize, Clone)]
struct Held {
    name: String,
    /// Where it is among the components of all unknowns.
    position: usize,
    unknown: usize,
    /// None where it is a function of vectors as a whole.
    component: Option<usize>,
    is_whole: bool,
    element: String,
    degree: usize,
    /// `normal` or `tangential`.
    trace: &'static str,
    tag: i64,
    /// The position of its group, from 1.
    place: usize,
    is_between: bool,
    values: Vec<Formula>,
}

#[derive(Serialize)]
struct Mean {
    name: String,
    test: String,
    /// The first component of its unknown among all.
    position: usize,
    value: String,
}

#[derive(Serialize)]
struct Time {
    t: String,
    dt: String,
    steps: usize,
    initial: Vec<Initial>,
}

#[derive(Serialize)]
struct Initial {
    name: String,
    position: usize,
    unknown: usize,
    component: usize,
    /// The position of its function.
    function: usize,
    family: String,
    degree: usize,
    #[serde(flatten)]
    formula: Formula,
}

/// The cells of the result.
#[derive(Serialize)]
struct Output {
    degree: usize,
    is_continuous: bool,
    /// VTK's number of the cells.
    kind: u8,
    /// Barycentric coordinates of the nodes.
    nodes: Vec<Vec<String>>,
}

impl Term {
    /// The sign of another term than the first is set off.
    pub fn new(text: String, is_first: bool) -> Self {
        let signed = match text.strip_prefix('-') {
            _ if is_first => text.clone(),
            Some(rest) => format!("- {rest}"),
            None => format!("+ {text}"),
        };
        Term { signed, text }
    }
}

impl Over {
    pub fn new(problem: &Problem, measure: &Measure) -> Self {
        let tags = |groups: &[usize]| groups.iter().map(|k| problem.groups[*k].tag).collect();
        Over {
            kind: match measure.domain {
                Domain::Cells => "dx",
                Domain::Boundary => "ds",
                Domain::Interior => "dS",
            },
            tags: tags(&measure.groups),
            named: tags(&problem.named(measure)),
            places: measure.groups.iter().map(|k| k + 1).collect(),
        }
    }
}

impl Fields {
    /// The problem in a code's words.
    ///
    /// # Errors
    /// What the code lacks.
    pub fn new(speaker: &mut Speaker<'_>, file: &str) -> Result<Self, String> {
        let rules = speaker.rules()?;
        let held = speaker.held()?;
        let functions = speaker.functions(&held)?;
        let unknowns = speaker.unknowns()?;
        let head = head(&mut speaker.problem, "");
        let data = speaker.data()?;
        let more = (speaker.table.more)(speaker)?;
        let sums = speaker.sums();
        let of = &speaker.problem;
        let parameters = of.parameters.iter().zip(&speaker.words.parameters);
        let parameters = parameters.map(|(parameter, name)| Named {
            name: name.clone(),
            value: format!("{:?}", parameter.value),
        });
        let groups = of.groups.iter().map(|group| Group {
            name: comment(&group.name),
            tag: group.tag,
            less: of.dim - group.dim,
        });
        let components = of.components();
        let components = components.iter().map(|(k, c)| speaker.names(*k, Some(*c)));
        Ok(Fields {
            name: of.name.clone(),
            file: file.to_owned(),
            dim: of.dim,
            axes: &["x", "y", "z"][..of.dim],
            head,
            parameters: parameters.collect(),
            data,
            interpolated: speaker.interpolated()?,
            unknowns,
            functions,
            components: components.collect(),
            groups: groups.collect(),
            rules,
            shared: sums.shared,
            shared_by_derivative: sums.by_derivative,
            integrals: sums.integrals,
            holds_parts: held.iter().any(|held| held.component.is_some()),
            holds_wholes: held.iter().any(|held| held.component.is_none()),
            held,
            means: speaker.means(),
            time: speaker.time(),
            has_diameter: of.has_diameter(),
            output: output(of)?,
            more,
        })
    }
}

/// The integrals as sums, and what they share.
struct Sums {
    shared: Vec<Named>,
    by_derivative: Vec<Named>,
    integrals: Vec<Integral>,
}

impl Speaker<'_> {
    /// The value of a formula without coordinates and parameters.
    pub fn constant(&self, id: Id) -> Option<String> {
        let scalars = &self.problem.scalars;
        let nodes = scalars.nodes_of([id]);
        let is_given = |node| matches!(node, Node::Coordinate(_) | Node::Parameter(_));
        let value = scalars.value(id, &|_| f64::NAN);
        let is_constant = !nodes.iter().any(|id| is_given(scalars.node(*id)));
        (is_constant && value.is_finite()).then(|| format!("{value:?}"))
    }

    fn formula_of(&self, id: Id) -> Formula {
        Formula {
            text: self.formula(id),
            at_points: self.at_points(id),
            is_number: self.problem.scalars.number_of(id).is_some(),
            constant: self.constant(id),
        }
    }

    /// The names of a component of an unknown, or of the whole.
    fn names(&self, unknown: usize, component: Option<usize>) -> Names {
        let name = |field| match component {
            Some(c) => self.words.parts(field)[c].clone(),
            None => self.words.whole(field).to_owned(),
        };
        Names {
            name: name(Field::Unknown(unknown)),
            test: name(Field::Test(unknown)),
            increment: name(Field::Increment(unknown)),
            old: match self.problem.time {
                Some(_) => name(Field::Old(unknown)),
                None => String::new(),
            },
        }
    }

    fn element(&self, space: Space) -> Result<String, String> {
        (self.table.element)(&self.problem, space)
    }

    /// The space of a component.
    fn of_part(&self, element: Element) -> Result<String, String> {
        self.element(Space {
            element,
            size: None,
        })
    }

    fn rules(&self) -> Result<Vec<Rule>, String> {
        let names = (self.table.rules)(&self.problem)?;
        let rules = self.problem.rules();
        let each = rules.iter().zip(names).map(|(rule, name)| {
            let volume = [1.0, 0.5, 1.0 / 6.0][rule.points[0].len() - 1];
            let weights = rule.weights.iter().map(|w| format!("{:?}", w * volume));
            Rule {
                name,
                points: rule.points.iter().map(|p| format!("{p:?}")).collect(),
                weights: weights.collect(),
            }
        });
        Ok(each.collect())
    }

    fn data(&self) -> Result<Vec<Datum>, String> {
        let all = self.problem.data.iter().enumerate();
        let all = all.map(|(k, datum)| {
            let names = self.words.parts(Field::Datum(k)).iter();
            let parts = names.zip(&datum.components).map(|(name, id)| Part {
                name: name.clone(),
                formula: self.formula_of(*id),
            });
            Ok(Datum {
                name: self.words.whole(Field::Datum(k)).to_owned(),
                shape: datum.shape.clone(),
                element: datum
                    .space
                    .map(|space| self.of_part(space.element))
                    .transpose()?,
                degree: datum.space.map_or(0, |space| space.element.degree()),
                parts: parts.collect(),
            })
        });
        all.collect()
    }

    fn interpolated(&self) -> Result<Vec<Interpolated>, String> {
        let all = self.words.interpolated(&self.problem).into_iter();
        let all = all.map(|(name, element, id)| {
            Ok(Interpolated {
                name,
                element: self.of_part(element)?,
                degree: element.degree(),
                formula: self.formula_of(id),
            })
        });
        all.collect()
    }

    fn unknowns(&self) -> Result<Vec<Unknown>, String> {
        let all = self.problem.unknowns.iter().enumerate();
        let all = all.map(|(k, unknown)| {
            let parts = 0..unknown.space.count();
            Ok(Unknown {
                title: unknown.name.clone(),
                position: self.problem.position(k, 0),
                names: self.names(k, None),
                element: self.element(unknown.space)?,
                is_continuous: unknown.space.element.is_continuous(),
                is_vector: unknown.space.element.is_vector(),
                size: unknown.space.size,
                parts: parts.map(|c| self.names(k, Some(c))).collect(),
            })
        });
        all.collect()
    }

    fn functions(&self, held: &[Held]) -> Result<Vec<Function>, String> {
        let all = self.problem.blocks().into_iter();
        let all = all.map(|(unknown, component)| {
            let space = self.problem.unknowns[unknown].space;
            let is_mine = |held: &&Held| (held.unknown, held.component) == (unknown, component);
            let held = held.iter();
            Ok(Function {
                names: self.names(unknown, component),
                element: self.element(space)?,
                is_vector: component.is_none(),
                family: space.element.name(),
                degree: space.element.degree(),
                unknown,
                held: held.filter(is_mine).cloned().collect(),
            })
        });
        all.collect()
    }

    /// The residual, and its derivative where the code does not have its own.
    fn sums(&mut self) -> Sums {
        let mut sums = Sums {
            shared: Vec::new(),
            by_derivative: Vec::new(),
            integrals: Vec::new(),
        };
        let sharing = self.table.sharing;
        if sharing == Sharing::Own {
            return sums;
        }
        let residual = self.problem.residual();
        let by_hand = |i| (self.table.derivative)(&mut self.problem, i);
        let by_hand: Vec<bool> = residual.iter().map(by_hand).collect();
        let derivative = residual.iter().zip(&by_hand).map(|(i, by_hand)| {
            let by = by_hand.then(|| self.problem.derivative(i));
            by.unwrap_or_default()
        });
        let derivative: Vec<Bilinear> = derivative.collect();
        let mut roots: Vec<Id> = residual
            .iter()
            .flat_map(|i| i.terms.values().copied())
            .collect();
        let more: Vec<Id> = derivative
            .iter()
            .flat_map(|d| d.values().copied())
            .collect();
        if sharing == Sharing::Together {
            roots.extend(&more);
        }
        let (shared, known) = self.share(&roots);
        sums.shared = shared;
        let each = residual.iter().zip(by_hand).enumerate();
        let each = each.map(|(position, (integral, by_hand))| {
            let products = integral.terms.iter().map(|(test, c)| (*c, vec![*test]));
            Integral {
                title: comment(&measure(&self.problem, &integral.measure)),
                position,
                over: Over::new(&self.problem, &integral.measure),
                terms: self.sum(products, &known),
                derivative: Vec::new(),
                by_hand,
            }
        });
        sums.integrals = each.collect();
        self.in_derivative = true;
        let known = match sharing {
            Sharing::Apart => {
                let (shared, known) = self.share(&more);
                sums.by_derivative = shared;
                known
            }
            _ => known,
        };
        for (integral, by) in sums.integrals.iter_mut().zip(&derivative) {
            let products = by.iter().map(|((test, d), c)| (*c, vec![*d, *test]));
            integral.derivative = self.sum(products, &known);
        }
        self.in_derivative = false;
        sums
    }

    fn held(&self) -> Result<Vec<Held>, String> {
        let all = self.problem.held().into_iter();
        let all = all.map(|held: problem::Held| {
            let space = self.problem.unknowns[held.unknown].space;
            let group = &self.problem.groups[held.group];
            let first = held.component.unwrap_or(0);
            Ok(Held {
                name: self.names(held.unknown, held.component).name,
                position: self.problem.position(held.unknown, first),
                unknown: held.unknown,
                component: held.component,
                is_whole: held.component.is_none(),
                element: self.element(space)?,
                degree: space.element.degree(),
                trace: match space.element {
                    Element::RaviartThomas => "normal",
                    _ => "tangential",
                },
                tag: group.tag,
                place: held.group + 1,
                is_between: group.on == Some(Domain::Interior),
                values: held.values.iter().map(|id| self.formula_of(*id)).collect(),
            })
        });
        all.collect()
    }

    fn means(&self) -> Vec<Mean> {
        let all = self.problem.means.iter().map(|mean| {
            let Names { name, test, .. } = self.names(mean.unknown, None);
            Mean {
                name,
                test,
                position: self.problem.position(mean.unknown, 0),
                value: format!("{:?}", mean.value),
            }
        });
        all.collect()
    }

    fn time(&self) -> Option<Time> {
        let time = self.problem.time.as_ref()?;
        let initial = time.initial.iter().map(|initial| {
            let (unknown, component) = (initial.unknown, initial.component);
            let element = self.problem.unknowns[unknown].space.element;
            Initial {
                name: self.names(unknown, Some(component)).name,
                position: self.problem.position(unknown, component),
                unknown,
                component,
                function: self.problem.block(unknown, component),
                family: element.name(),
                degree: element.degree(),
                formula: self.formula_of(initial.value),
            }
        });
        let [t, dt] = [0, 1].map(|k| self.words.parameters[time.parameter + k].clone());
        Some(Time {
            t,
            dt,
            steps: time.steps,
            initial: initial.collect(),
        })
    }
}

fn output(problem: &Problem) -> Result<Output, String> {
    let element = problem.output();
    let (nodes, kind) = python::nodes(element, problem.dim)?;
    let texts = |node: Vec<f64>| node.iter().map(|t| format!("{t:?}")).collect();
    Ok(Output {
        degree: element.degree(),
        is_continuous: element.is_continuous(),
        kind,
        nodes: nodes.into_iter().map(texts).collect(),
    })
}
