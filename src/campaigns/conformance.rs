//! Checks whether a code implements the protocol: small cases with known answers, each of which tests one thing.

use std::path::Path;

use serde::Serialize;

use crate::engine::{Answer, Case, Engine, Settings, Silent, raw_values};
use crate::run::{Runner, Setup, Variation, Written, tolerance};
use crate::text::{Text, text};
use crate::why::{elsewhere, examine, order};
use faceoff_fem::contact::{Iteration, Method, Stop, solve};
use faceoff_fem::scene::{Boundary, Data, Expression, GroupName, Scene};
use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};
use faceoff_mesh::file::Temporary;

/// The result of one case of a check.
#[derive(Debug, Serialize)]
pub struct Finding {
    /// The subject of the check.
    pub about: String,
    /// `None` if it does not concern a method.
    pub method: Option<String>,
    /// Undetermined, if there was no answer.
    pub verdict: Verdict,
    /// The largest difference from the known answer at any dof, relative to its largest value.
    pub difference: Option<f64>,
    /// The fault, as far as it is known.
    pub why: Option<Text>,
}

/// A scene and the property of a code that it tests.
struct Check {
    about: &'static str,
    /// The scene that this one modifies, as [`Change`] describes.
    scene: &'static str,
    n: usize,
    change: Change,
    methods: &'static [&'static str],
}

/// The modification of a built-in scene.
enum Change {
    None,
    /// f, g, t, ψ; the sides of Γ_N, while Γ_C stays and all others are Γ_D; and u, if it is in the space.
    Data(
        [&'static str; 4],
        &'static [&'static str],
        Option<&'static str>,
    ),
    /// The rules for (f, v), and on Γ_C and Γ_N.
    Rules(&'static str, &'static str),
}

const SIDES_2D: &[&str] = &["top", "left", "right"];
const SIDES_3D: &[&str] = &["top", "left", "right", "front", "back"];

/// Every function and operator of expressions; the value is of order 1 on the unit square.
const FORMULA: &str = "sin(x)+cos(y)+tan(0.5*x)+asin(0.5*x)+acos(0.5*y)+atan(x)+atan2(y+0.1,x-0.3)+sinh(x)\
    +cosh(y)+tanh(x)+exp(-x)+log(1+x)+sqrt(x+y)+abs(x-0.3)+min(x,y)+max(x,0.25)+pow(1+x,1.5)+(x-0.5)^2-1/3\
    +if(x < 0.31, 2, -1)+if(y >= 0.27, x, pi)+2e-3";

/// From independent checks to those that need all earlier ones.
const CHECKS: [Check; 13] = [
    Check {
        about: "g on Γ_D, Γ_C pressed, and which dof is where",
        scene: "one-zone",
        n: 3,
        change: Change::Data(["0", "1+2*x+3*y", "0", "1+2*x"], &[], Some("1+2*x+3*y")),
        methods: &["cr", "p1", "p2"],
    },
    Check {
        about: "t on Γ_N",
        scene: "one-zone",
        n: 3,
        change: Change::Data(
            ["0", "1+2*x+3*y", "if(x < 0.5, -2, 2)", "1+2*x"],
            &["left", "right"],
            Some("1+2*x+3*y"),
        ),
        methods: &["cr", "p1", "p2"],
    },
    Check {
        about: "f, with Γ_C free",
        scene: "one-zone",
        n: 3,
        change: Change::Data(["-2", "x*x", "0", "10"], &[], Some("x*x")),
        methods: &["p2"],
    },
    Check {
        about: "f that needs its rule, with Γ_C free",
        scene: "one-zone",
        n: 3,
        change: Change::Data(["exp(x)*cos(3*y)", "x*y", "0", "10"], &[], None),
        methods: &["cr", "p1", "p2"],
    },
    Check {
        about: "contact in part: the law, γ and θ",
        scene: "one-zone",
        n: 4,
        change: Change::None,
        methods: &[
            "cr", "p2", "p1", "cr(1,1)", "cr(0,1)", "p1(-1,1)", "p2(1,0)",
        ],
    },
    Check {
        about: "ψ under a contact in part",
        scene: "one-zone",
        n: 4,
        change: Change::Data(
            ["-2*pi*sin(2*pi*x)", "0", "0", "0.02*cos(2*x)-0.01"],
            &["left", "right"],
            None,
        ),
        methods: &["cr", "p2"],
    },
    Check {
        about: "the flux corrected by the load",
        scene: "one-zone",
        n: 4,
        change: Change::None,
        methods: &["cr-fc"],
    },
    Check {
        about: "other points of quadrature",
        scene: "one-zone",
        n: 4,
        change: Change::Rules("centroid", "midpoint"),
        methods: &["cr", "cr-fc", "p2"],
    },
    Check {
        about: "every function of formulas",
        scene: "one-zone",
        n: 4,
        change: Change::Data([FORMULA, "0", "0", "0.3"], &["left", "right"], None),
        methods: &["cr"],
    },
    Check {
        about: "an unstructured mesh with all data: γ of each cell",
        scene: "plate",
        n: 16,
        change: Change::None,
        methods: &["cr", "cr-fc", "p2"],
    },
    Check {
        about: "3D: g on Γ_D, Γ_C pressed, and which dof is where",
        scene: "one-zone-3d",
        n: 2,
        change: Change::Data(
            ["0", "1+2*x-y+3*z", "0", "1+2*x-y"],
            &[],
            Some("1+2*x-y+3*z"),
        ),
        methods: &["cr", "p1", "p2"],
    },
    Check {
        about: "3D: f, t, and contact in part",
        scene: "one-zone-3d",
        n: 2,
        change: Change::Data(
            [
                "-2*pi*sin(2*pi*x)",
                "0.1*x",
                "0.1*y",
                "0.02*cos(2*x+y)-0.03",
            ],
            &["left", "right", "front", "back"],
            None,
        ),
        methods: &["cr", "cr-fc", "p1", "p2"],
    },
    Check {
        about: "3D: an unstructured mesh with all data",
        scene: "block",
        n: 4,
        change: Change::None,
        methods: &["cr", "p2"],
    },
];

const SEVERAL: &str = "several cases in one job";
const STOPS: &str = "stop.max_iterations";
const PROTOCOL: &str = "a protocol that is not its own";

/// How many findings there are about something: of the checks whose subject contains `about`.
pub fn check_count(about: &str) -> usize {
    let cases = CHECKS.iter().filter(|check| check.about.contains(about));
    let others = [SEVERAL, STOPS, PROTOCOL];
    let others = others.iter().filter(|other| other.contains(about));
    cases.map(|check| check.methods.len()).sum::<usize>() + others.count()
}

/// Runs `engine` through the checks whose subject contains `about`; `ended` gets each finding as it is made. All cases go into one job,
/// and each that is not right there into one of its own, so that no case is blamed for another.
///
/// # Errors
/// An interruption; no check is about this; a code that answers nothing at all. Whatever else the engine does is a finding.
pub fn conformance(
    engine: &dyn Engine,
    settings: &Settings,
    about: &str,
    mut ended: impl FnMut(&Finding),
) -> Result<Vec<Finding>> {
    if check_count(about) == 0 {
        let all = CHECKS.iter().map(|check| check.about);
        let all: Vec<&str> = all.chain([SEVERAL, STOPS, PROTOCOL]).collect();
        let what = format!("no check is about `{about}`");
        return Err(Error::usage(what, format!("there are: {}", all.join("; "))));
    }
    let mut checks = Vec::new();
    for check in CHECKS.iter().filter(|check| check.about.contains(about)) {
        for method in check.methods {
            checks.push((check, check.setup(parse_method(method)?, settings)?));
        }
    }
    let cases = checks.iter().map(|(_, setup)| setup.case());
    let cases = cases.collect::<Result<Vec<_>>>()?;
    let all: Vec<&Case> = cases.iter().collect();
    let together = match all.is_empty() {
        true => Ok(Vec::new()),
        false => run(engine, &all, settings, Temporary::new()?.path())?,
    };
    let mut findings = Vec::new();
    let mut add = |finding: Finding| {
        ended(&finding);
        findings.push(finding);
    };
    let (mut right, mut silent) = (Vec::new(), Vec::new());
    for (k, ((check, setup), case)) in checks.iter().zip(&cases).enumerate() {
        let known = known(case, check.u())?;
        let finding = match &together {
            Ok(answers) if is_right(case, &answers[k], &known) => {
                let difference = difference(&answers[k].u, &known);
                check.finding(setup, Verdict::Agree, Some(difference), None)
            }
            _ => alone(engine, check, setup, case, &known)?,
        };
        match (finding.verdict, &finding.why) {
            (Verdict::Agree, _) => right.push((k, known)),
            (Verdict::Undetermined, Some(why)) => silent.push(why.clone()),
            _ => {}
        }
        add(finding);
        // A code that answers no method of the first check does not run.
        if k + 1 == CHECKS[0].methods.len().min(checks.len()) && silent.len() > k {
            let what = format!("it answers nothing: {}", silent[0]);
            let remedy = "see that it runs; tests/engines/README.md says what it must do";
            return Err(Error::engine(engine.name(), what, remedy));
        }
    }
    if SEVERAL.contains(about) {
        add(several(engine, settings, &together, &cases, &right)?);
    }
    if STOPS.contains(about) {
        add(stops(engine, settings)?);
    }
    if PROTOCOL.contains(about) {
        add(protocol(engine, settings)?);
    }
    Ok(findings)
}

impl Check {
    /// u, if it is in the space.
    fn u(&self) -> Option<&'static str> {
        match self.change {
            Change::Data(_, _, u) => u,
            _ => None,
        }
    }

    fn finding(
        &self,
        setup: &Setup,
        verdict: Verdict,
        difference: Option<f64>,
        why: Option<Text>,
    ) -> Finding {
        Finding {
            about: self.about.into(),
            method: Some(setup.discretisation.method.to_string()),
            verdict,
            difference,
            why,
        }
    }

    fn setup(&self, method: Method, settings: &Settings) -> Result<Setup> {
        let mut scene = Scene::find(self.scene)?;
        if let Change::Data([f, g, t, psi], neumann, _) = &self.change {
            let sides = match self.scene {
                "one-zone-3d" => SIDES_3D,
                _ => SIDES_2D,
            };
            let named = |sides: &mut dyn Iterator<Item = &&str>| {
                sides.map(|side| GroupName::Name((*side).into())).collect()
            };
            scene = scene.with_boundary(Boundary {
                dirichlet: named(&mut sides.iter().filter(|side| !neumann.contains(side))),
                neumann: named(&mut neumann.iter()),
                contact: scene.boundary().contact.clone(),
            });
            scene = scene.with_data(Data {
                f: parse(f)?,
                g: parse(g)?,
                t: parse(t)?,
                psi: parse(psi)?,
            });
        }
        let setup = Setup::new(&scene, Some(self.n), method, settings)?;
        match self.change {
            Change::Rules(load, contact) => setup
                .with(&Variation::LoadRule(load.into()))?
                .with(&Variation::ContactRule(contact.into())),
            _ => Ok(setup),
        }
    }
}

fn parse(text: &str) -> Result<Expression> {
    Expression::parse(text)
        .map_err(|e| Error::usage(format!("`{text}`: {}", e.what), "report this"))
}

fn parse_method(name: &str) -> Result<Method> {
    name.parse()
        .map_err(|e: String| Error::usage(e, "report this"))
}

/// The known answer to a case: u if it is in the space, else the solution of the Rust solver.
fn known(case: &Case, u: Option<&str>) -> Result<Vec<f64>> {
    if let Some(u) = u {
        let u = parse(u)?;
        return Ok(case.problem.space.points().map(|x| u.value(x)).collect());
    }
    let solution = solve(&case.problem, Iteration::Newton, Stop::default(), |_, _| {
        Ok(())
    })?;
    Ok(solution.u)
}

/// Does an answer solve a case, by its own statement and by comparison?
fn is_right(case: &Case, answer: &Answer, known: &[f64]) -> bool {
    answer.converged && difference(&answer.u, known) <= tolerance(&case.problem.method())
}

/// One case in a separate job.
fn alone(
    engine: &dyn Engine,
    check: &Check,
    setup: &Setup,
    case: &Case,
    known: &[f64],
) -> Result<Finding> {
    let in_order = |raw: &[f64]| {
        let known = of_cells(case, known);
        let order = order(&case.problem, raw, &known);
        (order, elsewhere(&case.problem, raw, &known))
    };
    let kept = Temporary::new()?;
    let answer = match run(engine, &[case], &setup.settings, kept.path())? {
        Ok(answers) => answers.into_iter().next(),
        Err(message) => {
            // The files that it wrote may show more than that the answer is invalid.
            let raw = raw_values(&kept.path().join(engine.name()), 0, &case.problem);
            let cause = raw.map(|raw| in_order(&raw));
            return Ok(
                match cause.and_then(|(order, elsewhere)| order.or(elsewhere)) {
                    Some(cause) => {
                        check.finding(setup, Verdict::Disagree, None, Some(cause.into()))
                    }
                    None => {
                        let message = Some(Text::message(&message));
                        check.finding(setup, Verdict::Undetermined, None, message)
                    }
                },
            );
        }
    };
    let Some(answer) = answer else {
        let message = Some("it gave no answer".into());
        return Ok(check.finding(setup, Verdict::Undetermined, None, message));
    };
    let difference = difference(&answer.u, known);
    if is_right(case, &answer, known) {
        return Ok(check.finding(setup, Verdict::Agree, Some(difference), None));
    }
    let mut why = Vec::new();
    if !answer.converged {
        why.push(text!("it says that it has not converged"));
    }
    if difference > tolerance(&case.problem.method()) {
        let (order, elsewhere) = in_order(&of_cells(case, &answer.u));
        why.extend(match order {
            Some(order) => Some(order.into()),
            None => match elsewhere {
                Some(elsewhere) => Some(elsewhere.into()),
                None => single_change(setup, &answer.u)?,
            },
        });
    }
    let why = (!why.is_empty()).then(|| Text::joined(why, "; "));
    Ok(check.finding(setup, Verdict::Disagree, Some(difference), why))
}

/// The explanation of an answer, as text.
fn single_change(setup: &Setup, u: &[f64]) -> Result<Option<Text>> {
    let runner = Runner::new(&setup.settings, &Silent);
    let found = examine(&runner, setup, u, Written::of(u))?;
    Ok(found.culprit().map(|culprit| culprit.what.clone()))
}

/// The answers, or why there are none.
fn run(
    engine: &dyn Engine,
    cases: &[&Case],
    settings: &Settings,
    keep: &Path,
) -> Result<Result<Vec<Answer>, String>> {
    let settings = Settings {
        keep: Some(keep.to_owned()),
        ..settings.clone()
    };
    match engine.run(cases, &settings, &Silent) {
        Ok(run) => Ok(Ok(run.answers)),
        Err(Error::Ended(cause)) => Err(Error::Ended(cause)),
        Err(Error::Engine { what, .. }) => Ok(Err(what)),
        Err(other) => Ok(Err(other.to_string())),
    }
}

/// max |a - b| / max |b|
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    a.iter()
        .zip(b)
        .fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
        / largest
}

/// u cell by cell, in the form that engines write.
fn of_cells(case: &Case, u: &[f64]) -> Vec<f64> {
    let space = &case.problem.space;
    let dofs = (0..space.mesh.cell_count()).flat_map(|cell| space.cell_dofs(cell));
    dofs.map(|dof| u[*dof as usize]).collect()
}

/// All cases that are right by themselves in one job: either the first job, or one without the wrong cases.
fn several(
    engine: &dyn Engine,
    settings: &Settings,
    together: &Result<Vec<Answer>, String>,
    cases: &[Case],
    right: &[(usize, Vec<f64>)],
) -> Result<Finding> {
    let answers = match together {
        Ok(answers) => Ok(right.iter().map(|(k, _)| answers[*k].clone()).collect()),
        Err(_) if right.is_empty() => Err("no case is right by itself".into()),
        Err(_) => {
            let batch: Vec<&Case> = right.iter().map(|(k, _)| &cases[*k]).collect();
            run(engine, &batch, settings, Temporary::new()?.path())?
        }
    };
    let mut finding = Finding {
        about: SEVERAL.into(),
        method: None,
        verdict: Verdict::Agree,
        difference: None,
        why: None,
    };
    match answers {
        Err(message) => {
            finding.verdict = Verdict::Undetermined;
            finding.why = Some(Text::message(&message));
        }
        Ok(answers) => {
            for ((k, known), answer) in right.iter().zip(&answers) {
                let case = &cases[*k];
                let difference = difference(&answer.u, known);
                if !is_right(case, answer, known) {
                    finding.verdict = Verdict::Disagree;
                    let (scene, method) = (case.scene().name(), case.problem.method());
                    finding.why = Some(text!(
                        "in such a job {}, {} is wrong",
                        scene,
                        method.to_string()
                    ));
                }
                finding.difference = Some(finding.difference.unwrap_or(0.0).max(difference));
            }
        }
    }
    Ok(finding)
}

/// One step is allowed, and more are needed by every iteration that does not solve the problem in one.
fn stops(engine: &dyn Engine, settings: &Settings) -> Result<Finding> {
    let mut setup = Setup::new(&Scene::find("one-zone")?, Some(8), Method::cr(), settings)?;
    setup.settings.stop.max_iterations = 1;
    let case = setup.case()?;
    let (verdict, why) = match run(engine, &[&case], &setup.settings, Temporary::new()?.path())? {
        Err(message) => (Verdict::Undetermined, Some(Text::message(&message))),
        Ok(answers) => {
            let answer = &answers[0];
            let is_right = difference(&answer.u, &known(&case, None)?) <= tolerance(&Method::cr());
            let steps = answer.increments.len();
            if steps > 1 {
                let why = text!("stop.max_iterations is 1, and it took {} steps", steps);
                (Verdict::Disagree, Some(why))
            } else if answer.converged && !is_right {
                let why = "after one step it says that it has converged, which it has not";
                (Verdict::Disagree, Some(why.into()))
            } else {
                (Verdict::Agree, None)
            }
        }
    };
    Ok(Finding {
        about: STOPS.into(),
        method: Some("cr".into()),
        verdict,
        difference: None,
        why,
    })
}

fn protocol(engine: &dyn Engine, settings: &Settings) -> Result<Finding> {
    let setup = Setup::new(&Scene::find("one-zone")?, Some(2), Method::cr(), settings)?;
    let case = setup.case()?;
    let refuses = engine.refuses_other_protocols(&case, settings)?;
    let why =
        "it answers a job of another protocol, which may mean something else: end with an error";
    Ok(Finding {
        about: PROTOCOL.into(),
        method: None,
        verdict: if refuses {
            Verdict::Agree
        } else {
            Verdict::Disagree
        },
        difference: None,
        why: (!refuses).then(|| why.into()),
    })
}
