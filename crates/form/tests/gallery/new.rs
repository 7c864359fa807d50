use super::*;
#[test]
fn one() {
    let text = std::fs::read_to_string(std::env::var("FORM").unwrap()).unwrap();
    let mesh = if std::env::var("CUBE").is_ok() { cube() } else { square() };
    let problem = Problem::parse(Path::new("form.toml"), &text, &mesh).unwrap_or_else(|e| panic!("{e}"));
    let mut all: Vec<(&str, Values)> = Vec::new();
    for code in &CODES {
        match code.script(&problem) {
            Err(why) => println!("{}: {why}", code.name),
            Ok(script) => {
                std::fs::create_dir_all("/tmp/B/s").unwrap();
                std::fs::write(format!("/tmp/B/s/{}", code.file(&problem)), &script).unwrap();
                code.write_mesh(Path::new("/tmp/B/s"), &problem, &mesh).unwrap();
                let start = std::time::Instant::now();
                let ran = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(code, &problem, &mesh, &script)));
                println!("{} {:?}", code.name, start.elapsed());
                if let Ok(values) = ran { all.push((code.name, values)); }
            }
        }
    }
    for (name, values) in &all[1..] { println!("{} – {name} {:.1e}", all[0].0, difference(&all[0].1, values)); }
}
