//! Writes the scripts and meshes of a form file for all codes: `cargo run -p faceoff-form --example scripts FORM.toml MESH FOLDER`.

use std::path::Path;

use faceoff_form::Problem;
use faceoff_form::codes::CODES;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().collect();
    let [_, form, mesh, folder] = &words[..] else {
        return Err("give FORM.toml MESH FOLDER".into());
    };
    let mesh = faceoff_mesh::io::read(Path::new(mesh))?;
    let text = std::fs::read_to_string(form)?;
    let problem = Problem::parse(Path::new(form), &text, &mesh)?;
    std::fs::create_dir_all(folder)?;
    for code in &CODES {
        match code.script(&problem) {
            Ok(script) => {
                std::fs::write(Path::new(folder).join(code.file(&problem)), script)?;
                code.write_mesh(Path::new(folder), &problem, &mesh)?;
            }
            Err(why) => println!("{}: {why}", code.name),
        }
    }
    Ok(())
}
