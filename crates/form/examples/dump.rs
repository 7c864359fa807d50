use faceoff_form::{Problem, codes::CODES};
use faceoff_mesh::mesh::generate;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&args[1]).unwrap();
    let n = args[3].parse().unwrap();
    let mut mesh = if text.contains("union-cube") { generate::union_cube(n, [1.0; 3]) } else { generate::union_jack(n, [1.0; 2]) };
    let mut dx = faceoff_mesh::mesh::Group::new(mesh.dim(), 1);
    dx.name = Some("domain".into());
    let mut at = 0u32;
    for b in &mesh.blocks { let e = at + b.len() as u32; if b.kind.dim() == mesh.dim() { dx.cells.extend(at..e); } at = e; }
    mesh.groups.push(dx);
    let problem = match Problem::parse(args[1].as_ref(), &text, &mesh) { Ok(p) => p, Err(e) => { println!("{e}"); std::process::exit(2) } };
    for code in CODES {
        match code.script(&problem) {
            Ok(s) => std::fs::write(format!("{}/{}", args[2], code.file(&problem)), s).unwrap(),
            Err(e) => println!("{}: {e}", code.name),
        }
    }
    for code in CODES { code.write_mesh(args[2].as_ref(), &problem, &mesh).unwrap(); }
}
