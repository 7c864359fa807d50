//! The examples of section 6: the scene that is solved, and its known solution.

use faceoff_fem::scene::{Expression, Scene};
use faceoff_fem::truth::{DEFAULT_RESOLUTION, Reference};
use faceoff_mesh::error::{Error, Result};

/// For larger N the list of contact zones would fill a file.
const MOST_ZONES: u32 = 100_000;

/// Example 6.1, or 6.2 for one N.
pub struct Example {
    /// The section of the paper.
    pub section: &'static str,
    /// N of (6.2); `None` for 6.1.
    pub zones: Option<u32>,
    /// Domain, boundary and load.
    pub scene: Scene,
    /// The mesh-free solution u.
    pub truth: Reference,
}

impl Example {
    /// 6.1, f = -2π sin 2πx.
    ///
    /// # Errors
    /// Only those of a broken installation.
    pub fn one_zone() -> Result<Self> {
        Ok(Example {
            section: "6.1",
            zones: None,
            scene: Scene::find("one-zone")?,
            truth: Reference::one_zone(DEFAULT_RESOLUTION)?,
        })
    }

    /// 6.2, f = (2πN)² cos 2πNx; `three-zones` and `five-zones` are the paper's N = 3 and 5, others are `zones-N`.
    ///
    /// # Errors
    /// N = 0, or an N for which the zones cannot be stored.
    pub fn zones(n: u32) -> Result<Self> {
        if n > MOST_ZONES {
            return Err(Error::usage(
                format!("{n} zones are more than a result can hold"),
                format!("ask for at most {MOST_ZONES}"),
            ));
        }
        let truth = Reference::zones(n, DEFAULT_RESOLUTION)?;
        let scene = match n {
            3 => Scene::find("three-zones")?,
            5 => Scene::find("five-zones")?,
            _ => {
                let scene = Scene::find("five-zones")?.renamed(&format!("zones-{n}"))?;
                let f = format!("(2*pi*{n})^2*cos(2*pi*{n}*x)");
                let mut data = scene.data().clone();
                data.f = Expression::parse(&f).map_err(|e| Error::Scene {
                    scene: scene.name().to_owned(),
                    place: "data.f".into(),
                    what: e.what,
                    remedy: "report this".into(),
                })?;
                scene.with_data(data)
            }
        };
        Ok(Example {
            section: "6.2",
            zones: Some(n),
            scene,
            truth,
        })
    }

    /// The name in tables.
    pub fn title(&self) -> String {
        match self.zones {
            None => self.section.to_owned(),
            Some(n) => format!("{}, N = {n}", self.section),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The solved scene and the reference solution have the same load and boundary.
    #[test]
    fn scenes_and_references_have_the_same_load() {
        let examples = [
            Example::one_zone(),
            Example::zones(3),
            Example::zones(4),
            Example::zones(5),
        ];
        for example in examples {
            let example = example.unwrap();
            for i in 0..=40 {
                let x = f64::from(i) / 40.0;
                let (scene, truth) = (
                    example.scene.data().f.value([x, 0.3, 0.0]),
                    example.truth.f(x),
                );
                assert!((scene - truth).abs() < 1e-10, "{}", example.title());
            }
        }
        assert!(Example::zones(0).is_err() && Example::zones(u32::MAX).is_err());
    }
}
