//! `cutis demo`: the whole line in one command, through the entry points that a co-simulation tool uses.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use cutis::ffi::host::Host;
use cutis::geometry::Head;
use cutis::math::Vec3;
use cutis::mesh::{FaceSet, SKIN, TetMesh};
use cutis::{io, load};

use super::output::{Series, picture};
use super::{fmu, progress};

#[derive(clap::Args)]
pub struct Demo {
    /// Folder for what the demo leaves behind
    #[arg(short, long, default_value = "out/demo")]
    out: PathBuf,
}

impl Demo {
    pub fn run(self) -> super::Done {
        let spinner = progress::stages();
        let stage = |name: &'static str, share: u64| {
            spinner.set_message(name);
            spinner.set_position(share);
        };
        stage("meshing the head", 0);
        let (_, report) = Head::default().mesh()?;
        stage("packing the components", 20);
        let archives = fmu::write(None, fmu::own_binary(None)?, &self.out, false)?;
        stage("unpacking, instantiating", 60);
        let before = Instant::now();
        let mut host = Host::open(&archives[0].0)?;
        host.initialise(0.0)?;
        let instantiated = before.elapsed();
        spinner.finish_and_clear();

        let loaded = load::embedded()?;
        let (model, programme) = (&loaded.model, &loaded.programme);
        let skin = skin_mesh(&mut host)?;
        let mut series = Series::new(&self.out)?;
        let mut x = positions(&mut host)?;
        series.add(0.0, &skin, &[], &x)?;
        let mut panels = vec![("REST", x.clone())];
        let (mut spent, mut reaction) = (Duration::ZERO, Vec::new());
        let mut slowest = Duration::ZERO;
        let bar = progress::bar(programme.steps(), "driving cutis.fmu");
        let mut inputs: Vec<(String, Vec<f64>)> = model
            .ports()
            .iter()
            .filter(|p| p.is_settable() && p.is_continuous())
            .map(|p| (p.name.clone(), p.start.clone()))
            .collect();
        for k in 1..=programme.steps() {
            let (t, dt) = (programme.time(k), programme.step(k));
            for s in programme.settings(t) {
                let name = &model.ports()[s.port].name;
                let (_, values) = inputs.iter_mut().find(|(n, _)| n == name).expect("keyframes name inputs");
                values[s.offset..s.offset + s.values.len()].copy_from_slice(&s.values);
            }
            for (name, values) in &inputs {
                host.set_f64(name, values)?;
            }
            let before = Instant::now();
            host.step(t - dt, dt)?;
            let took = before.elapsed();
            spent += took;
            slowest = slowest.max(took);
            x = positions(&mut host)?;
            series.add(t, &skin, &[], &x)?;
            match k {
                8 => panels.push(("JAW OPEN 8 DEG", x.clone())),
                13 => {
                    panels.push(("ADVANCED 5 MM", x.clone()));
                    reaction = host.get_f64("bone.reactionForce")?;
                }
                18 => panels.push(("CHEEK PUSHED 1 N", x.clone())),
                _ => {}
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        let residual = host.get_f64("solver.residual")?[0];
        let quality = host.get_f64("quality.minDetF")?[0];
        host.terminate()?;

        let moved =
            |(_, x): &(&str, Vec<Vec3>)| x.iter().zip(&skin.nodes).map(|(x, X)| (x - X).norm()).fold(0.0, f64::max);
        let jaw = Vec3::from_column_slice(&reaction[3..6]);
        say!("{report}");
        say!("FMI 3.0 archive      {} ({:.2} MB)", archives[0].0.display(), archives[0].1 as f64 / 1e6);
        say!("FMI 2.0 archive      {} ({:.2} MB)", archives[1].0.display(), archives[1].1 as f64 / 1e6);
        say!("nodes, tets          {}, {}", model.mesh().nodes.len(), model.mesh().tets.len());
        say!("skin vertices        {}", skin.nodes.len());
        say!("unpack + instantiate {:.2} s", instantiated.as_secs_f64());
        say!(
            "step                 {:.1} ms mean, {:.1} ms worst, of {} steps",
            1e3 * spent.as_secs_f64() / programme.steps() as f64,
            1e3 * slowest.as_secs_f64(),
            programme.steps()
        );
        for panel in &panels[1..] {
            say!("{:<20} moves the skin by up to {:.2} mm", panel.0.to_lowercase(), 1e3 * moved(panel));
        }
        say!("jaw reaction         {:.2} N when advanced ({:.2}, {:.2}, {:.2})", jaw.norm(), jaw.x, jaw.y, jaw.z);
        say!("residual             {residual:.1e} N");
        say!("smallest det F       {quality:.3}");
        say!("wrote {}", series.index().display());
        let path = self.out.join("picture.png");
        let panels: Vec<(&str, &[Vec3])> = panels.iter().map(|(name, x)| (*name, x.as_slice())).collect();
        io::write_bytes(&path, &picture(&skin, &panels).to_png())?;
        say!("wrote {}", path.display());
        Ok(())
    }
}

/// The skin as the host sees it: vertices and triangles, no tetrahedra.
fn skin_mesh(host: &mut Host) -> Result<TetMesh, Box<dyn std::error::Error>> {
    let nodes = host.get_f64("skin.restPosition")?.chunks_exact(3).map(Vec3::from_column_slice).collect();
    let triangles = host.get_i32("skin.triangles")?;
    let triangles = triangles.chunks_exact(3).map(|t| [t[0] as u32, t[1] as u32, t[2] as u32]).collect();
    let face_sets = vec![FaceSet { name: SKIN.into(), triangles }];
    Ok(TetMesh { nodes, face_sets, ..TetMesh::default() })
}

fn positions(host: &mut Host) -> Result<Vec<Vec3>, Box<dyn std::error::Error>> {
    Ok(host.get_f64("skin.position")?.chunks_exact(3).map(Vec3::from_column_slice).collect())
}
