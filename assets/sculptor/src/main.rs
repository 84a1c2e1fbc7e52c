//! Carves a model and writes it:
//! `sculptor [--model statue|betta] --out DIR [--preview FILE.png]`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use sculptor::betta::{Animal, Betta};
use sculptor::preview::{self, Shading, View};
use sculptor::statue::Statue;
use sculptor::{Piece, Sculpture, carve, obj};

fn main() {
    if let Err(problem) = run() {
        eprintln!("sculptor: {problem}");
        std::process::exit(1);
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let mut out: Option<PathBuf> = None;
    let mut picture: Option<PathBuf> = None;
    let mut of = 20_000;
    let mut step = sculptor::STEP;
    let mut model = String::from("statue");
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments
            .next()
            .ok_or_else(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--out" => out = Some(value.into()),
            "--preview" => picture = Some(value.into()),
            "--model" => model = value,
            "--of" => of = value.parse()?,
            "--step" => step = value.parse()?,
            _ => return Err(format!("unknown option {flag}").into()),
        }
    }
    if out.is_none() && picture.is_none() {
        return Err("usage: sculptor [--model statue|betta] --out DIR \
             [--preview FILE.png [--of TRIANGLES]] [--step MM]"
            .into());
    }
    let clock = Instant::now();
    match model.as_str() {
        "statue" => carve_statue(step, out.as_deref(), picture.as_deref(), of)?,
        "betta" => carve_betta(step, out.as_deref(), picture.as_deref())?,
        _ => return Err(format!("no model {model}; there are statue and betta").into()),
    }
    println!("{:.1} s", clock.elapsed().as_secs_f32());
    Ok(())
}

/// Anything that can go wrong.
type Outcome = Result<(), Box<dyn std::error::Error>>;

fn carve_statue(step: f32, out: Option<&Path>, picture: Option<&Path>, of: usize) -> Outcome {
    let statue = Statue::new();
    let pieces = carve(&statue, step)?;
    for piece in &pieces {
        report(piece);
    }
    if let Some(folder) = out {
        std::fs::create_dir_all(folder)?;
        for piece in pieces.iter().filter(|p| p.name.ends_with(".obj")) {
            let comment = format!(
                "The marmor statue, {} triangles, mm, Y up, facing +Z.\n\
                 Made by: cargo run --release -p sculptor -- --out assets\n\
                 Licence: MIT OR Apache-2.0",
                piece.mesh.triangles.len()
            );
            let text = obj::write(&piece.mesh, &piece.normals, &comment);
            std::fs::write(folder.join(&piece.name), text)?;
        }
    }
    if let Some(path) = picture {
        let piece = pieces
            .iter()
            .min_by_key(|p| p.mesh.triangles.len().abs_diff(of))
            .ok_or("nothing carved")?;
        draw(&statue, piece, path)?;
    }
    Ok(())
}

fn carve_betta(step: f32, out: Option<&Path>, picture: Option<&Path>) -> Outcome {
    let fish = Betta::new();
    let animal = Animal::new(&fish, step)?;
    report(&animal.piece);
    if let Some(folder) = out {
        std::fs::create_dir_all(folder)?;
        let bytes = animal.glb()?;
        println!(
            "betta.glb: {} joints, {} bytes",
            animal.rig.joints.len(),
            bytes.len()
        );
        std::fs::write(folder.join("betta.glb"), bytes)?;
    }
    if let Some(path) = picture {
        draw_swim(&fish, &animal, path)?;
    }
    Ok(())
}

/// Eight poses through the swim clip, from the side and from above in turn.
fn draw_swim(fish: &Betta, animal: &Animal, path: &Path) -> std::io::Result<()> {
    const POSES: usize = 8;
    let Piece { mesh, normals, .. } = &animal.piece;
    let rest = Shading::new(mesh, normals, &|p| fish.distance(p));
    let clip = &animal.clips[0];
    let length = clip.times[clip.times.len() - 1];
    let poses: Vec<_> = (0..POSES)
        .map(|k| {
            let (mesh, normals) = animal.posed(clip, length * k as f32 / POSES as f32);
            let mut shading = rest.clone();
            shading.normals = normals;
            (mesh, shading)
        })
        .collect();
    let view = |azimuth: f32, elevation: f32, back_lit: bool| View {
        azimuth,
        elevation,
        target: glam::Vec3::new(-1.5, -2.0, 0.0),
        height: 74.0,
        back_lit,
    };
    let mut pictures = Vec::new();
    for (row, half) in poses.chunks(POSES / 2).enumerate() {
        pictures.extend(half.iter().map(|(m, s)| (m, s, view(20.0, 6.0, row == 1))));
        pictures.extend(half.iter().map(|(m, s)| (m, s, view(0.0, 89.0, false))));
    }
    preview::poses(&pictures, POSES / 2, 480, path)
}

fn report(piece: &Piece) {
    println!(
        "{}: {} triangles, {} vertices, genus {}, {:.0} mm3, closed and manifold",
        piece.name,
        piece.mesh.triangles.len(),
        piece.mesh.positions.len(),
        piece.mesh.genus(),
        piece.mesh.volume(),
    );
}

fn draw(statue: &Statue, piece: &Piece, path: &Path) -> std::io::Result<()> {
    let whole = |azimuth: f32, back_lit: bool| View {
        azimuth,
        elevation: 4.0,
        target: glam::Vec3::new(0.0, 41.0, 0.0),
        height: 88.0,
        back_lit,
    };
    let face = |azimuth: f32| View {
        azimuth,
        elevation: 2.0,
        target: statue.face_centre(),
        height: 36.0,
        back_lit: false,
    };
    let views = [
        whole(0.0, false),
        whole(-35.0, false),
        whole(35.0, false),
        whole(-100.0, false),
        whole(180.0, false),
        whole(-30.0, true),
        face(statue.face_azimuth()),
        face(statue.face_azimuth() + 40.0),
        face(statue.face_azimuth() - 90.0),
    ];
    let field = |p| statue.distance(p);
    preview::sheet(&piece.mesh, &piece.normals, &field, &views, 3, 640, path)
}
