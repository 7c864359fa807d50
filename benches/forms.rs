//! Weak forms by this program and by dolfinx, in one run: assembling the matrix and the vector beside the compiled kernels of dolfinx, and
//! Newton's method beside those of dolfinx with MUMPS and FreeFEM with UMFPACK.
//!
//! ```sh
//! cargo bench --bench forms
//! cargo bench --bench forms -- --quick
//! cargo bench --bench forms -- --only contact --n 64
//! ```
//!
//! Each code has a process of its own; what is timed is repeated, and the shortest time counts. Reading the mesh, compiling forms, patterns
//! of matrices and orderings that are used again are not part of assembling. dolfinx runs in one process.
//!
//! Among the tests, without a word, it solves small forms by this program.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use clap::Parser;
use faceoff_form::own::{self, Assembler, State, Wanted};
use faceoff_form::{Problem, codes::Code};
use faceoff_mesh::mesh::Mesh;
use faceoff_mesh::mesh::generate::{union_cube, union_jack};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

#[derive(Parser)]
struct Arguments {
    /// Small meshes: does it run?
    #[arg(long)]
    quick: bool,
    /// Only rows with this in their names
    #[arg(long, default_value = "")]
    only: String,
    /// The refinement of all meshes
    #[arg(long)]
    n: Option<usize>,
    /// Time this row by this program alone
    #[arg(long, hide = true)]
    own: Option<usize>,
    #[arg(long, hide = true)]
    bench: bool,
}

/// A form on a mesh of 2 or 3 dimensions.
struct Row {
    name: &'static str,
    dim: usize,
    /// Of the mesh, and of the small one.
    n: [usize; 2],
    is_solved: bool,
    text: &'static str,
}

/// The penalty-free method on Crouzeix–Raviart elements in this dimension, for a body whose top is moved by this.
macro_rules! contact {
    ($dim:literal, $top:literal) => {
        concat!(
            "[spaces]\nu = \"CR^", $dim, "\"\n[parameters]\ngamma0 = 100.0\nbeta = 10.0\n[definitions]\n",
            "\"sigma(w)\" = \"0.8*sym(grad(w)) + 0.6*div(w)*Identity(", $dim, ")\"\n",
            "\"sigma_n(w)\" = \"dot(n, dot(sigma(w), n))\"\ngamma = \"gamma0*h/1.4\"\n[data]\npsi = \"0.05*x\"\n",
            "[form]\nF = \"inner(sigma(u), sym(grad(v)))*dx + 0.8*beta/facet_length*dot(jump(u), jump(v))*dS",
            " - sigma_n(u)*dot(v, n)*ds(bottom) + max(dot(u, n) - psi, gamma*sigma_n(u))*sigma_n(v)*ds(bottom)\"\n",
            "[dirichlet]\ntop = [", $top, "]\n",
        )
    };
}

const ROWS: [Row; 8] = [
    Row {
        name: "assemble P1 Laplace",
        dim: 2,
        n: [707, 16],
        is_solved: false,
        text: "[spaces]\nu = \"P1\"\n[form]\nF = \"inner(grad(u), grad(v))*dx - exp(x)*v*dx\"\n[dirichlet]\nleft = 0\n",
    },
    Row {
        name: "assemble P2 elasticity",
        dim: 3,
        n: [26, 3],
        is_solved: false,
        text: "[spaces]\nu = \"P2^3\"\n[form]\nF = \"2*inner(sym(grad(u)), sym(grad(v)))*dx + 1.5*div(u)*div(v)*dx - v[2]*dx\"\ndegree = 2\n[dirichlet]\nleft = [0, 0, 0]\n",
    },
    Row {
        name: "assemble Taylor–Hood",
        dim: 2,
        n: [224, 8],
        is_solved: false,
        text: "[spaces]\nu = \"P2^2\"\np = \"P1\"\n[form]\nF = \"inner(grad(u), grad(v))*dx + dot(dot(grad(u), u), v)*dx - p*div(v)*dx - q*div(u)*dx - x*v[0]*dx\"\n",
    },
    Row {
        name: "solve minimal surface, P1",
        dim: 2,
        n: [256, 8],
        is_solved: true,
        text: "[spaces]\nu = \"P1\"\n[form]\nF = \"inner(grad(u), grad(v))/sqrt(1 + inner(grad(u), grad(u)))*dx\"\n[dirichlet]\nleft = 0\nright = \"y\"\n\
               top = \"x\"\nbottom = 0\n",
    },
    Row {
        name: "solve Navier–Stokes, Taylor–Hood",
        dim: 2,
        n: [64, 4],
        is_solved: true,
        text: "[spaces]\nu = \"P2^2\"\np = \"P1\"\n[form]\nF = \"0.1*inner(grad(u), grad(v))*dx + dot(dot(grad(u), u), v)*dx - p*div(v)*dx - q*div(u)*dx\"\n[dirichlet]\n\
               u = { left = [\"4*y*(1 - y)\", 0], top = [0, 0], bottom = [0, 0] }\n",
    },
    Row {
        name: "solve P2 elasticity",
        dim: 3,
        n: [8, 2],
        is_solved: true,
        text: "[spaces]\nu = \"P2^3\"\n[form]\nF = \"2*inner(sym(grad(u)), sym(grad(v)))*dx + 1.5*div(u)*div(v)*dx - v[2]*dx\"\ndegree = 2\n[dirichlet]\nleft = [0, 0, 0]\n",
    },
    Row {
        name: "solve contact in elasticity, CR, 2D",
        dim: 2,
        n: [512, 8],
        is_solved: true,
        text: contact!("2", "0, -0.1"),
    },
    Row {
        name: "solve contact in elasticity, CR, 3D",
        dim: 3,
        n: [24, 2],
        is_solved: true,
        text: contact!("3", "0, 0, -0.1"),
    },
];

impl Row {
    fn mesh(&self, how: &Arguments) -> Mesh {
        let n = how.n.unwrap_or(self.n[usize::from(how.quick)]);
        match self.dim {
            2 => union_jack(n, [1.0, 1.0]),
            _ => union_cube(n, [1.0; 3]),
        }
    }

    fn problem(&self, mesh: &Mesh) -> Outcome<Problem> {
        let text = format!("name = \"bench\"\n{}", self.text);
        Ok(Problem::parse(Path::new("bench.toml"), &text, mesh)?)
    }
}

/// The shortest of some times, in seconds: so many, or as many as fit into ten seconds.
fn shortest(mut run: impl FnMut() -> Outcome<()>) -> Outcome<f64> {
    let all = Instant::now();
    let mut least = f64::INFINITY;
    for k in 0..7 {
        if k > 0 && all.elapsed().as_secs_f64() > 10.0 {
            break;
        }
        let clock = Instant::now();
        run()?;
        least = least.min(clock.elapsed().as_secs_f64());
    }
    Ok(least)
}

fn own(row: &Row, how: &Arguments) -> Outcome<f64> {
    let mesh = row.mesh(how);
    let problem = row.problem(&mesh)?;
    if row.is_solved {
        return shortest(|| {
            own::solve(&problem, &mesh)?;
            Ok(())
        });
    }
    let assembler = Assembler::new(&problem, &mesh)?;
    let u: Vec<f64> = (0..assembler.dofs.count())
        .map(|k| (k as f64).sin())
        .collect();
    shortest(|| {
        let system = assembler.assemble(
            State {
                u: &u,
                old: &[],
                parameters: &[],
            },
            Wanted::Both,
        );
        drop(std::hint::black_box(system));
        Ok(())
    })
}

/// What is timed in place of what follows the form in the script of dolfinx.
const ASSEMBLE: &str = r#"
import time
F, J = fem.form(F), fem.form(J)
A, b = petsc.create_matrix(J), petsc.create_vector(F)
least = 1e9
for k in range(5):
    clock = time.perf_counter()
    A.zeroEntries()
    petsc.assemble_matrix(A, J)
    A.assemble()
    with b.localForm() as local:
        local.set(0.0)
    petsc.assemble_vector(b, F)
    least = min(least, time.perf_counter() - clock)
print("TIME", least)
"#;

/// In seconds; what the script says where it fails.
fn dolfinx(row: &Row, how: &Arguments) -> Outcome<f64> {
    let mesh = row.mesh(how);
    let problem = row.problem(&mesh)?;
    let code = Code::of_name("dolfinx").ok_or("no dolfinx")?;
    let script = code.script(&problem)?;
    let newton = match row.is_solved {
        true => script.find("# Newton's method."),
        false => script.find("held = np.unique"),
    };
    let newton = newton.ok_or("another script")?;
    let (before, after) = script.split_at(newton);
    let script = match row.is_solved {
        // The forms are compiled before.
        true => {
            let end = after.find("\n\n\n").unwrap_or(after.len());
            format!(
                "{before}\nimport time\nclock = time.perf_counter()\n{}\nprint(\"TIME\", time.perf_counter() - clock)\n",
                &after[..end]
            )
        }
        false => {
            let at = before
                .find("F, J = fem.form(F), fem.form(J)")
                .ok_or("another script")?;
            format!("{}{ASSEMBLE}", &before[..at])
        }
    };
    told(code, &problem, &mesh, &script)
}

/// Newton's method of FreeFEM, in seconds; why there is none.
fn freefem(row: &Row, how: &Arguments) -> Outcome<f64> {
    if !row.is_solved {
        return Err("–".into());
    }
    let mesh = row.mesh(how);
    let problem = row.problem(&mesh)?;
    let code = Code::of_name("freefem").ok_or("no FreeFEM")?;
    let script = code.script(&problem)?;
    let begin = script.find("// Newton's method.").ok_or("another script")?;
    let (before, after) = script.split_at(begin);
    let end = after.find("if (!done)").ok_or("another script")?;
    let (newton, rest) = after.split_at(end);
    let script = format!(
        "{before}\nreal began = clock();\n{newton}\ncout << \"\\nTIME \" << clock() - began << endl;\n{rest}"
    );
    told(code, &problem, &mesh, &script)
}

/// The time that a script says, or its last line where it fails.
fn told(code: &Code, problem: &Problem, mesh: &Mesh, script: &str) -> Outcome<f64> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join(code.file(problem));
    std::fs::write(&path, script)?;
    code.write_mesh(folder.path(), problem, mesh)?;
    let ran = Command::new(code.command[0])
        .args(if code.name == "freefem" {
            &["-v", "0"][..]
        } else {
            &[]
        })
        .arg(&path)
        .env("OMP_NUM_THREADS", "1")
        .current_dir(folder.path())
        .output()?;
    let text = String::from_utf8_lossy(&ran.stdout);
    let time = text.lines().find_map(|line| line.strip_prefix("TIME "));
    // The time of a method that failed is no time of a solution.
    let Some(time) = time.filter(|_| ran.status.success()) else {
        let said = [&ran.stderr, &ran.stdout].map(|text| String::from_utf8_lossy(text));
        let last = said.iter().find_map(|text| text.trim_end().lines().last());
        return Err(format!("{}: {}", ran.status, last.unwrap_or_default()).into());
    };
    Ok(time.parse()?)
}

fn main() -> Outcome<()> {
    let arguments = Arguments::parse();
    if let Some(row) = arguments.own {
        println!("{}", own(&ROWS[row], &arguments)?);
        return Ok(());
    }
    if !arguments.bench && !arguments.quick {
        let small = Arguments {
            quick: true,
            ..arguments
        };
        for row in &ROWS {
            own(row, &small)?;
        }
        return Ok(());
    }
    println!(
        "{:<36}{:>10}{:>12}{:>12}{:>12}{:>12}{:>9}",
        "seconds", "cells", "1 thread", "all cores", "FreeFEM", "dolfinx", "ratio"
    );
    let rows = ROWS.iter().enumerate();
    for (k, row) in rows.filter(|(_, row)| row.name.contains(&arguments.only)) {
        let cells = row
            .mesh(&arguments)
            .cells()
            .filter(|(_, kind, _)| usize::from(kind.dim()) == row.dim)
            .count();
        let with = |threads: Option<&str>| -> Outcome<f64> {
            let mut command = Command::new(std::env::current_exe()?);
            command.arg("--own").arg(k.to_string());
            command.args(arguments.quick.then_some("--quick"));
            command.args(
                arguments
                    .n
                    .iter()
                    .flat_map(|n| ["--n".to_owned(), n.to_string()]),
            );
            command.envs(threads.map(|n| ("RAYON_NUM_THREADS", n)));
            Ok(String::from_utf8(command.output()?.stdout)?
                .trim()
                .parse()?)
        };
        let (one, all) = (with(Some("1"))?, with(None)?);
        let of_freefem = match freefem(row, &arguments) {
            Ok(time) => format!("{time:.4}"),
            Err(why) => why.to_string(),
        };
        let (theirs, ratio) = match dolfinx(row, &arguments) {
            Ok(time) => (format!("{time:.4}"), format!("{:.2}", time / one)),
            Err(why) => (why.to_string(), String::new()),
        };
        println!(
            "{:<36}{cells:>10}{one:>12.4}{all:>12.4}{of_freefem:>12}{theirs:>12}{ratio:>9}",
            row.name
        );
    }
    println!("ratio: dolfinx's time over that of one thread");
    Ok(())
}
